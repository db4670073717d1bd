"""Frequency responses: [analysis] of kind "frf", arguments of `frf` and options of its methods.

The drive is given under [[drive]].
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn import plots
from foldyn.analyses.bars import bar_closed, share_bar
from foldyn.analyses.casefile import Analysis, Begun, CaseFile, Compute, arguments_of, movable
from foldyn.analyses.sections import AnalysisSection, Positive, ShownSection, one_of
from foldyn.analyses.vibration import GONE, About, Secant, VibrationSchema, about, slope_notes
from foldyn.arguments import Check, arguments
from foldyn.cases import BaseMotion, Case, Force
from foldyn.cases.decode import PartOf
from foldyn.cases.directions import DIRECTIONS
from foldyn.dynamics import Progress
from foldyn.errors import InputError
from foldyn.linear import Peak, frf, peaks_of
from foldyn.linear.frf import METHODS, PER_FORCE, quantity_of
from foldyn.plots.charts import Chart, Curve
from foldyn.plots.readings import along_drive, unit_of
from foldyn.report.album import Album, ByRule, computation, listed, rules, shown_nodes
from foldyn.report.sections import Charts, Heading, Section, Table, Text, cell
from foldyn.tables import ListOf, check_keys
from foldyn.values import increasing, number, show, whole

MOST_FREQUENCIES = 100_000
SLOPES_AT_REST = ("direct", "modal")
"""Methods that need nothing but a linear structure."""
PER_MODES = 12
"""Frequencies that the method "direct" solves in the time of the modes."""
OPTIONS = frozenset(key for method in METHODS.values() for key in arguments(method.options))
"""Options of all methods."""


def frequencies_of(name: str, value: Any) -> NDArray[np.float64]:
    """Frequencies (m,), Hz, from a list, or from the first, the last and their count."""
    if isinstance(value, dict):
        return _range(name, value)
    if not isinstance(value, list) or not value:
        raise InputError(
            f" = {show(value)}: must be {{ first = 1, last = 25, count = 241 }}, in Hz, or a list "
            "of frequencies",
            name,
        )
    return increasing(name, value, least=0.0, unit="Hz")


def _range(name: str, table: dict[str, Any]) -> NDArray[np.float64]:
    """Evenly spaced frequencies, including the first and last."""
    known = ("first", "last", "count")
    check_keys(table, known, name)
    for key in known:
        if key not in table:
            raise InputError(": missing; give first and last (Hz) and their count", f"{name}.{key}")
    first = number(f"{name}.first", table["first"], least=0.0)
    last = number(f"{name}.last", table["last"], above=first)
    count = whole(f"{name}.count", table["count"], least=2, most=MOST_FREQUENCIES)
    return np.linspace(first, last, count)


class FrfSection(*(method.options for method in METHODS.values()), AnalysisSection):
    """[analysis] of kind "frf"."""

    like = (frf,)
    frequencies: Annotated[Sequence[float] | Mapping[str, float], Check(frequencies_of)]
    method: Annotated[str, one_of(METHODS)] = "direct"
    state: About = "rest"
    secant: Secant = None
    amplitude: Positive = 1.0
    gone = GONE
    check_model: bool = True

    def agree(self) -> None:
        """Refuse options that do not fit the method."""
        given, method = self.stated, METHODS[self.method]
        for key in sorted(given & OPTIONS):
            owners = [name for name, other in METHODS.items() if key in arguments(other.options)]
            if self.method not in owners:
                raise InputError(
                    f": only for method = {' or '.join(show(owner) for owner in owners)}; leave it "
                    "out",
                    key,
                )
        if "secant" in given and method.by_amplitude:
            raise InputError(
                f" = {show(self.secant)}: the method {self.method} takes the amplitude of the "
                "drive instead; leave it out, and give amplitude",
                "secant",
            )
        method.options(**self.options())

    def options(self) -> dict[str, Any]:
        """Options of the method that the file gives."""
        return {key: getattr(self, key) for key in OPTIONS & self.stated}


NO_HISTORY = (
    "a drive has an amplitude only, analysis.method says how it goes over time; leave it out"
)


class DriveOf(PartOf):
    """A table of [[drive]]: a force on nodes, or a motion of the base."""

    def _made(self, name: str, value: Any, folder: Path | None) -> Any:
        if isinstance(value, Mapping):
            number(f"{name}.displacement", value.get("displacement", 1.0), above=0.0)
            value = {**value, "history": {"kind": "constant"}}
        return super()._made(name, value, folder)


ASKED = "nodes and force, or base (the axis of a base that moves)"
DRIVE = DriveOf((Force, BaseMotion), "drive", ASKED, history=NO_HISTORY)


class FrfOutput(ShownSection):
    """[output] of a frequency response.

    Parameters
    ----------
    axis : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Direction shown in figures; by default the direction of the drive.
    quantity : {"receptance", "mobility", "accelerance"}, optional
        Shown quantity: displacement, velocity or acceleration per force.
    """

    axis: Annotated[str | None, one_of(DIRECTIONS)] = None
    quantity: Annotated[str | None, one_of(PER_FORCE)] = None


class FrfSchema(VibrationSchema):
    """A case file of kind "frf"."""

    analysis: FrfSection
    drive: Annotated[Sequence[Any], ListOf(DRIVE, least=1)]
    output: FrfOutput = FrfOutput()

    @property
    def beyond_rest(self) -> str:
        """See `VibrationSchema`."""
        linear = self.analysis.method in SLOPES_AT_REST
        return super().beyond_rest or ("" if linear else "analysis.method")

    @property
    def solutions(self) -> tuple[float, str]:
        """See `VibrationSchema`."""
        count = len(self.analysis.frequencies)
        if self.analysis.method != "direct" or count <= PER_MODES:
            return super().solutions
        return count / PER_MODES, f" at {count} frequencies"

    def agree(self) -> None:
        """Refuse further drives with a moving base."""
        super().agree()
        bases = [i for i, one in enumerate(self.drive) if isinstance(one, BaseMotion)]
        if bases and len(self.drive) > 1:
            raise InputError(
                ": a moving base must be the only drive; run a case file for each drive",
                f"drive[{bases[0]}]",
            )
        if bases and self.output.quantity is not None:
            raise InputError(
                f" = {show(self.output.quantity)}: the response to a moving base is always shown "
                "as transmissibility; leave it out",
                "output.quantity",
            )


class FrfAnalysis(Analysis):
    """The response to a harmonic drive about a state."""

    kind = "frf"
    moving = True
    schema = FrfSchema
    needs_density = "a frequency response needs"
    takes = (*arguments_of(frf), *sorted(OPTIONS))
    files = ("response", "nyquist")

    @classmethod
    def of(cls, schema: Any, case: Case) -> Self:
        """See `Analysis`."""
        section = schema.analysis
        keys = "frequencies", "method", "secant", "amplitude", "check_model"
        given: dict[str, Any] = {key: getattr(section, key) for key in keys}
        given["state"] = None if section.state == "rest" else section.state
        return cls({**given, **section.options(), "drive": schema.drive})

    def prepare(self, case_file: CaseFile, mass: str, changes: Mapping[str, Any]) -> Compute:
        """See `Analysis`; `frf` refuses bad input before it first reports progress."""
        given = {**self.arguments, **about(case_file, mass), **changes}
        case = case_file.case(mass)

        def compute(progress: bool, begun: Begun) -> xarray.Dataset:
            def tell(now: Progress) -> None:
                if not reached.n:
                    reached.clear()
                    begun()
                reached.total = now.duration
                reached.update(now.time - reached.n)

            with bar_closed(share_bar(progress, "response")) as reached:
                return frf(case, progress=tell, **given)

        return compute

    def line(self, name: str, result: xarray.Dataset) -> str:
        """Method, frequencies and effort."""
        f = result["frequency"].values
        count = f"{len(f)} frequencies" if len(f) > 1 else "1 frequency"
        return (
            f"  {name}: {result.attrs['method']}, {count} from {f[0]:.4g} to {f[-1]:.4g} Hz, "
            f"{result.attrs['wall_seconds']:.1f} s"
        )

    def shown(self, case: Case) -> NDArray[np.int64]:
        """Nodes with a driving force, or else all nodes that can move."""
        forces = [
            one.loaded(case.structure, f"drive[{i}]")
            for i, one in enumerate(self.arguments["drive"])
            if isinstance(one, Force)
        ]
        return np.unique(np.concatenate(forces)) if forces else movable(case)

    @staticmethod
    def sections(case_file: CaseFile, results: ByRule, album: Album) -> Iterator[Section]:
        """See `Analysis`."""
        first = next(iter(results))
        case, response = case_file.case(first), results[first]
        drive = case_file.analysis.arguments["drive"]
        most = max(1, MOST_CURVES // len(results))
        nodes, some = shown_nodes(case_file.output.nodes.tolist(), most)
        axis = case_file.output.axis or driven_direction(response)
        quantity = case_file.output.quantity or quantity_of(response)
        shown = quantity if quantity in PER_FORCE else None
        parts = (
            "Magnitude, phase and coherence" if "coherence" in response else "Magnitude and phase"
        )
        caption = "The pattern with its nodes, supports and drive."
        yield from album.structure(_driven(case, drive), caption)
        yield Heading("The response")
        yield from album.figure(
            "response",
            f"{parts} of the {quantity} of {listed('node', nodes)}{some} along {axis}, "
            f"{rules(results)}: {_meaning(quantity, axis, response)}. Dots mark peaks.",
            lambda: plots.plot_frf(results, nodes, axes=axis, quantity=shown),
            *_coherence(results, nodes, axis),
        )
        peaks = {
            (rule, node): peaks_of(result, node, axis=axis, quantity=shown)
            for rule, result in results.items()
            for node in nodes
        }
        own = () if shown is None else peaks[first, nodes[0]]
        if any(np.isfinite(peak.damping_ratio) for peak in own):
            rule = f" with mass rule {first}" if len(results) > 1 else ""
            yield from album.figure(
                "nyquist",
                f"Mobility of node {nodes[0]} along {axis}{rule} around its peaks, in the complex "
                "plane: a mode makes a circle, from which its natural frequency and damping are "
                "found. Points that leave the circle show what other modes or nonlinearity add.",
                lambda: plots.plot_nyquist(response, nodes[0], axis=axis, peaks=own),
            )
        yield Heading("The numbers")
        yield _peaks(peaks, quantity, axis, len(results) > 1)
        yield _run(case_file, results)
        yield Text(_notes(response, case, peaks))


MOST_CURVES = 8
"""Largest number of responses in one figure, each in its own color."""
MOST_REASONS = 6
"""Largest number of peaks whose missing numbers the page explains."""


def _coherence(results: ByRule, nodes: list[int], axis: str) -> list[Section]:
    """Coherence of estimated responses, for a page without figures."""
    curves = []
    for rule, response in results.items():
        for node in nodes if "coherence" in response else ():
            label = f"node {node}" if len(results) == 1 else f"node {node}, {rule}"
            values = response["coherence"].sel(node=node, axis=axis[-1]).values
            curves.append(Curve(label, response["frequency"].values, values))
    if not curves:
        return []
    chart = Chart("frequency (Hz)", "coherence", curves)
    return [Charts([chart], f"Coherence of the motion along {axis} with the drive.")]


def driven_direction(response: xarray.Dataset) -> str:
    """Axis along which the drive is largest."""
    drive = response["drive"].transpose("node", "axis").values
    return along_drive(response)[int(np.abs(drive).sum(axis=0).argmax())]


def _driven(case: Case, drive: list[Any]) -> Case:
    """The case including the drive, for the picture of the structure."""
    bases = [part for part in drive if isinstance(part, BaseMotion)]
    forces = [part for part in drive if not isinstance(part, BaseMotion)]
    return replace(case, supports=[*case.supports, *bases], loads=[*case.loads, *forces])


def _meaning(quantity: str, axis: str, response: xarray.Dataset) -> str:
    """Definition of the quantity in words."""
    if quantity == "transmissibility":
        base = response.attrs["base_axis"]
        return f"displacement along {axis} per displacement of the base along {base}"
    motion = {"receptance": "displacement", "mobility": "velocity", "accelerance": "acceleration"}
    return f"{motion[quantity]} per newton of driving force, on all driven nodes together"


def _peaks(
    peaks: Mapping[tuple[str, int], tuple[Peak, ...]], quantity: str, axis: str, several: bool
) -> Table:
    header = [*(["mass rule"] if several else []), "node", "peak (Hz)"]
    header += [f"height{unit_of(quantity)}", "3 dB (%)", "textbook (%)"]
    header += ["f0 (Hz)", "circle (%)", "misfit (%)"]
    rows = [
        [
            *([rule] if several else []), node, peak.frequency, peak.height,
            _percent(peak.half_power), _percent(peak.textbook), cell(peak.natural_frequency),
            _percent(peak.damping_ratio), _percent(peak.misfit),
        ]
        for (rule, node), found in peaks.items() for peak in found
    ]  # fmt: skip
    return Table(
        header,
        rows,
        f"Peaks of the {quantity} along {axis} and the damping ratios they give: from the "
        "half-power points (3 dB: exact for a single mode; textbook: (f2 - f1) / 2f), and from "
        "fitted circles, with the natural frequency f0 and how far points lie off the circle",
        digits=4,
    )


def _run(case_file: CaseFile, results: ByRule) -> Table:
    keys = {
        "secant": "secant (degrees)",
        "modes": "modes",
        "amplitude": "amplitude",
        "pulse": "pulse (s)",
        "record": "record (s)",
        "interval": "sampling (s)",
        "averages": "averages",
        "seed": "seed",
        "estimator": "estimator",
        "sweep": "sweep",
        "cycles_in_all": "cycles",
        "window_rate": "window (1/s)",
    }
    a = next(iter(results.values())).attrs
    if not METHODS[a["method"]].by_amplitude:
        del keys["amplitude"]
    columns = {title: key for key, title in keys.items() if key in a}
    return computation(case_file, results, {"method": "method", "state": "state", **columns})


def _notes(
    response: xarray.Dataset, case: Case, peaks: Mapping[tuple[str, int], tuple[Peak, ...]]
) -> str:
    """Notes on the numbers."""
    notes = [
        f"Damping: alpha {case.rayleigh.alpha:g} 1/s, beta {case.rayleigh.beta:g} s. The result "
        "carries its own case."
    ]
    notes += slope_notes(response)
    swing = response["swing"].values if "swing" in response else np.zeros(1)
    if (swing > 0.0).any():  # without a swing no hinge is superlinear
        at = int(np.nanargmax(swing)) if np.isfinite(swing).any() else 0
        notes.append(
            "Each superlinear hinge is linearized for its own amplitude: the largest is "
            f"{np.degrees(swing[at]):.3g} degrees, at {response['frequency'].values[at]:.4g} Hz."
        )
    missing = [
        f"Peak at {peak.frequency:.4g} Hz of node {node}, {rule}: {_reason(peak.note)}."
        for (rule, node), found in peaks.items()
        for peak in found
        if peak.note
    ]
    if missing:
        notes.append("Why numbers are missing from the table:")
        notes += missing[:MOST_REASONS]
        if len(missing) > MOST_REASONS:
            notes.append(f"And {len(missing) - MOST_REASONS} more.")
    return "\n\n".join(notes)


def _reason(note: str) -> str:
    """A note without its advice for users of Python."""
    parts = [part for part in note.split("; ") if part.startswith(("half power", "circle fit"))]
    return "; ".join(parts or [note]).replace("magnitude: ", "")


def _percent(ratio: float) -> float | None:
    return float(f"{100.0 * ratio:.3g}") if np.isfinite(ratio) else None
