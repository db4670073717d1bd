"""Motions: [analysis] of kind "dynamics", arguments of `simulate`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Self

import numpy as np
import xarray

from foldyn import plots
from foldyn.analyses.casefile import Analysis, Begun, CaseFile, Compute, arguments_of
from foldyn.analyses.sections import (
    AnalysisSection,
    Animation,
    CaseSchema,
    Count,
    Positive,
    ShownSection,
    Switch,
    one_of,
)
from foldyn.analyses.start import MotionStart
from foldyn.analyses.stress_page import FILES, stress_sections
from foldyn.arguments import Check
from foldyn.cases import Case
from foldyn.dynamics import METHODS, Keeping, prepare, simulate
from foldyn.dynamics.driver import prepared
from foldyn.dynamics.initial import MODAL
from foldyn.dynamics.method_choice import AUTO
from foldyn.dynamics.timing import check_room, check_samples
from foldyn.errors import InputError
from foldyn.plots.flight import attitude_charts
from foldyn.plots.load_curves import load_charts
from foldyn.report.album import (
    Album,
    ByRule,
    by_mass_rule,
    crossing_panels,
    releases,
    rules,
    shown_nodes,
    visible_scale,
)
from foldyn.report.sections import Charts, Heading, Picture, Section, Table, Text, cell
from foldyn.signals.spectra import MINIMUM_SAMPLES
from foldyn.strength.resultants import check_stresses
from foldyn.values import number

LOADS = "Loads and imposed motions over time."

SAMPLING = ("every_steps", "interval")
"""Keys of [output] that are arguments of `simulate`."""
SAMPLES = 2000
"""Default number of samples of a motion."""


class MotionSection(AnalysisSection):
    """[analysis] of kind "dynamics"."""

    like = (simulate,)
    duration: Positive
    method: Annotated[str, one_of((AUTO, *METHODS, MODAL))] = AUTO
    dt: Positive | None = None
    force: Switch = False
    tolerance: Positive | None = None
    start: Annotated[float, Check(number)] = 0.0
    spectral_radius: Annotated[float | None, Check(number, least=0.0, most=1.0)] = None
    device: Annotated[str, one_of(("cpu", "gpu"))] = "cpu"


class MotionOutput(ShownSection):
    """[output] of a motion.

    Parameters
    ----------
    every_steps : int, optional
        Steps between samples, instead of `interval`.
    interval : float, optional
        Time between samples (s), by default 1/2000 of the duration.
    max_frequency : float, optional
        Upper end of drawn spectra (Hz).
    animation : {"gif", "mp4"}, optional
        Film of the motion next to the page.
    stresses : bool
        Whether the page shows stresses of panels and moments of creases.
    """

    every_steps: Count | None = None
    interval: Positive | None = None
    max_frequency: Positive | None = None
    animation: Animation = None
    stresses: Switch = False


class MotionSchema(CaseSchema):
    """A case file of kind "dynamics"."""

    initial: MotionStart | None = None
    analysis: MotionSection
    output: MotionOutput = MotionOutput()


class MotionAnalysis(Analysis):
    """The motion from an initial state under loads and moving supports."""

    kind = "dynamics"
    moving = True
    schema = MotionSchema
    needs_density = "a motion needs"
    takes = arguments_of(prepare)
    files = ("load", "motion", "motion.gif", "motion.mp4", "energies", "attitude", *FILES)

    @classmethod
    def of(cls, schema: Any, case: Case) -> Self:
        """See `Analysis`; the sampling in [output] becomes arguments of `simulate`, too."""
        analysis, output = super().of(schema, case), schema.output
        if output.stresses:
            check_stresses(case, "output.stresses")
        own = {name: getattr(output, name) for name in SAMPLING}
        given = {name: value for name, value in own.items() if value is not None}
        analysis.arguments.update(given or {"interval": schema.analysis.duration / SAMPLES})
        return analysis

    def prepare(self, case_file: CaseFile, mass: str, changes: Mapping[str, Any]) -> Compute:
        """See `Analysis`."""
        kept = self.arguments
        if any(name in changes for name in SAMPLING):
            kept = {name: value for name, value in kept.items() if name not in SAMPLING}
        given = {**kept, **changes}
        if "initial" not in given:
            given["initial"] = case_file.start(mass).state
        return MotionComputation(prepared(case_file.case(mass), **given, kept=True))

    def check(self, computations: Sequence[Compute], figures: bool) -> None:
        """Refuse more samples than memory holds, or fewer than spectra need."""
        prepared = [one for one in computations if isinstance(one, MotionComputation)]
        motions = [one.motion for one in prepared]
        samples = min(motion.expected_samples for motion in motions)
        if figures and samples < MINIMUM_SAMPLES:
            raise InputError(
                f": gives {samples} samples, spectra need {MINIMUM_SAMPLES}: lower it, lengthen "
                "analysis.duration, or run without --figures",
                "interval",
            )
        case, count = motions[0].case, sum(motion.expected_samples for motion in motions)
        size = count, len(case.structure.nodes), len(case.reaction_dofs)
        kept = [one.kept for one in prepared if one.kept]
        if kept:
            check_room(*size, kept[0].room)
        if len(kept) < len(motions) or any(one.shown for one in prepared):
            check_samples(*size, len(motions))

    def line(self, name: str, result: xarray.Dataset) -> str:
        """Method (and why, if it was chosen automatically), steps, speed and accuracy."""
        a = result.attrs
        size = f"{a['dt']:.3g} s"
        if "smallest_step" in a:
            size = f"{a['smallest_step']:.3g} to {a['largest_step']:.3g} s"
        if "modes" in a:
            off = f"half of them change displacements by {a['left_out']:.2%}"
            return f"  {name}: {a['modes']} modes ({off}), energy error {a['energy_error']:.1e}"
        detail = f"critical {a['critical_step']:.3g} s"
        if "iterations" in a:
            detail = f"{a['iterations'] / max(a['steps'], 1):.1f} iterations each"
            detail += f", {a['halved_steps']} in parts" if a["halved_steps"] else ""
        chosen = ""
        if "method_reason" in a:
            chosen = f"  {name}: {a['method']}, {a['method_reason']}\n"
        return (
            f"{chosen}  {name}: {a['steps']} steps of {size} ({detail}), "
            f"{_speed(a):,.0f} steps/s, energy error {a['energy_error']:.1e}"
        )

    @staticmethod
    def sections(case_file: CaseFile, results: ByRule, album: Album) -> Iterator[Section]:
        """See `Analysis`."""
        first = next(iter(results))
        case, trajectory = case_file.case(first), results[first]
        shown = case_file.output
        nodes, some = shown_nodes(shown.nodes.tolist())
        start, duration = float(trajectory["time"][0]), float(trajectory.attrs["duration"])
        scale, enlarged = visible_scale(case, trajectory)
        yield from album.structure(case)
        yield Heading("The motion")
        if case.loads or case.imposed_terms or case.base_terms:
            yield from album.figure(
                "load",
                LOADS,
                lambda: plots.plot_load_history(case, duration, start=start),
                Charts(load_charts(case, start, duration), LOADS),
            )
        yield from album.figure(
            "motion",
            f"Displacement of the chosen nodes{some} (left) and its frequency content (right), "
            f"{rules(results)}.",
            lambda: plots.plot_history(
                results, nodes, axes=shown.axis, max_frequency=shown.max_frequency
            ),
        )
        if shown.animation:
            film = album.folder / f"motion.{shown.animation}"
            yield Picture(
                plots.animate(case, trajectory, path=film, scale=scale),
                f"The motion with mass rule {first}{enlarged}; at rest in gray.",
            )
        yield from album.figure(
            "energies",
            f"Energies over time and the error of their balance, mass rule {first}.",
            lambda: plots.plot_energies(trajectory),
        )
        if not len(case.reaction_dofs) and not case.structure.linear:
            text = (
                "Attitude of the body, which nothing holds: its mean rotation from rest as a "
                f"vector, and its angular velocity, mass rule {first}."
            )
            charts = Charts(attitude_charts(trajectory), text)
            yield from album.figure(
                "attitude", text, lambda: plots.plot_attitude(trajectory), charts
            )
        if shown.stresses:
            yield from stress_sections(trajectory, album)
        yield Heading("The numbers")
        yield _table(case_file, results, nodes)
        yield from releases(results)
        yield from crossing_panels(results)
        yield Text(
            "The energy error is the largest imbalance of kinetic + strain + dissipated energy - "
            "work, relative to the largest of them. The results carry their own case and can be "
            "run again from it."
        )


@dataclass(eq=False)
class MotionComputation:
    """A checked motion, which may be stored while it runs.

    Attributes
    ----------
    motion : Motion or LinearMotion
    kept : Keeping or None
        How it is stored.
    shown : bool
        Whether its whole result is loaded for figures, and so must fit in memory.
    integrated : bool
        Whether it was integrated in a batch with others beforehand.
    """

    motion: Any
    kept: Keeping | None = None
    shown: bool = True
    integrated: bool = False

    def __call__(self, progress: bool, begun: Begun) -> xarray.Dataset:
        """The result, integrated, or as it was finished before."""
        begun()
        if self.integrated:
            return self.motion.result(progress)
        found = None if self.kept is None else self.motion.finished(self.kept)
        return self.motion.run(progress, self.kept) if found is None else found


def _table(case_file: CaseFile, results: ByRule, nodes: list[int]) -> Table:
    def largest(result: xarray.Dataset) -> float:
        return float(np.linalg.norm(result["displacement"].to_numpy()[:, nodes], axis=-1).max())

    columns = {
        "steps": "steps",
        "step (s)": "dt",
        "critical step (s)": lambda result: cell(result.attrs["critical_step"]),
        "steps per second": lambda result: _speed(result.attrs),
        "energy error": "energy_error",
        "largest displacement (m)": largest,
    }
    moved = ", ".join(map(str, nodes))
    caption = f"{case_file.path.name}: the runs; displacement of nodes {moved}"
    return by_mass_rule(results, columns, caption)


def _speed(attributes: Mapping[str, Any]) -> float:
    """Steps per second."""
    return attributes["steps"] / max(attributes["wall_seconds"], 1e-9)
