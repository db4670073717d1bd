"""Paths of equilibria: [analysis] of kind "statics", arguments of `trace` and of its settings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from typing import Annotated, Any, Self

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn import plots
from foldyn.analyses.bars import bar
from foldyn.analyses.casefile import Analysis, Begun, CaseFile, Compute, arguments_of, counted
from foldyn.analyses.sections import (
    AnalysisSection,
    Animation,
    CaseSchema,
    Count,
    ModelSection,
    Positive,
    ShownSection,
    Switch,
    check_mass,
    one_of,
    some_shapes,
    still,
)
from foldyn.analyses.start import StoredStart
from foldyn.analyses.stress_page import FILES, stress_sections
from foldyn.arguments import Check
from foldyn.cases import Case, Contact
from foldyn.cases.directions import DIRECTIONS
from foldyn.cases.loads import LOAD
from foldyn.cases.reached import REACHED, Reached
from foldyn.cases.supports import SUPPORT
from foldyn.errors import ComputationError, InputError, within
from foldyn.plots.charts import Chart, Curve
from foldyn.plots.readings import along, critical_word, evenly, is_loose, main_direction
from foldyn.report.album import (
    Album,
    ByRule,
    crossing_panels,
    listed,
    releases,
    shown_nodes,
    visible_scale,
)
from foldyn.report.sections import Charts, Heading, Picture, Section, Table, Text, cell
from foldyn.statics import METHODS, Landscape, Point, Settings, landscape, trace
from foldyn.statics.newton import settings_of
from foldyn.strength.resultants import check_stresses
from foldyn.tables import ListOf, TableOf
from foldyn.values import indices, number, number_or_list, show

SETTINGS = ("tolerance", "largest_turn", "stability")
"""Keys for settings of the solver."""


def _one_mass(name: str, value: Any, beside: Mapping[str, Any]) -> list[str]:
    if isinstance(value, list):
        raise InputError(
            f" = {show(value)}: a path is computed once; give one rule, or none: only gravity and "
            "inertia relief use the mass",
            name,
        )
    return [check_mass(name, value, beside)]


def constant_loads(name: str, value: Any) -> str | tuple[int, ...]:
    """Return "gravity", or numbers of loads as a tuple."""
    if value == "gravity":
        return "gravity"
    if isinstance(value, str):
        raise InputError(
            f' = {show(value)}: give "gravity", or numbers of [[loads]], as in [0]', name
        )
    return indices(name, value, "load", 'or "gravity"')


TIMELESS = (
    "a path has no time; leave it out: what loads and moves the structure grows with the load "
    "factor (or is named in analysis.constant)"
)
NO_BASE = (
    "a base moves over time, and a path has no time; give nodes, axis and displacement instead"
)
WOUND = SUPPORT.without("cable_change", "rest_change", base=NO_BASE, history=TIMELESS)
"""Supports, of which cables and springs wind with the load factor."""


class PathSection(AnalysisSection):
    """[analysis] of kind "statics"."""

    like = (trace, Settings)
    method: Annotated[str, one_of(METHODS)] = "newton"
    load_factors: Annotated[
        Sequence[float] | None,
        ListOf(Check(number), "a list of numbers, as in [0, 0.5, 1]", least=1),
    ] = None
    steps: Count | None = None
    duration: Annotated[
        float | Sequence[float] | None, Check(number_or_list, what="interval", least=0.0, unit="s")
    ] = None
    first_step: Annotated[float | None, Check(number)] = None
    constant: Annotated[str | Sequence[int], Check(constant_loads)] = ()
    until: Annotated[Reached | None, REACHED] = None
    inertia_relief: Switch = False
    tolerance: Annotated[float, Check(number, least=1e-14, most=1e-2)] = Settings.tolerance
    largest_turn: Positive = Settings.largest_turn
    stability: Switch = Settings.stability


class PathOutput(ShownSection):
    """[output] of a path.

    Parameters
    ----------
    axis : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Direction shown in figures; by default the direction of the largest motion.
    shapes : int or sequence of int
        Number of drawn shapes, or the numbers of their points.
    animation : {"gif", "mp4"}, optional
        Film of the path next to the page.
    stresses : bool
        Whether the page shows stresses of panels and moments of creases.
    """

    axis: Annotated[str | None, one_of(DIRECTIONS)] = None
    shapes: Annotated[int | Sequence[int], Check(some_shapes, drawn="shapes", what="point")] = 4
    animation: Animation = None
    stresses: Switch = False


class PathModel(ModelSection):
    """[model] of a path, with at most one mass rule."""

    mass: Annotated[str | None, Check(_one_mass)] = None


class PathSchema(CaseSchema):
    """A case file of kind "statics"."""

    model: PathModel = PathModel()
    supports: Annotated[Sequence[Any], ListOf(WOUND)] = ()
    loads: Annotated[Sequence[Any], ListOf(LOAD.without(history=TIMELESS))] = ()
    contact: Annotated[Contact | None, Check(still, why=TIMELESS), TableOf(Contact)] = None
    initial: StoredStart | None = None
    analysis: PathSection
    output: PathOutput = PathOutput()


class PathAnalysis(Analysis):
    """The path of equilibria under loads and moving supports that grow together."""

    kind = "statics"
    moving = True
    schema = PathSchema
    files = ("reaction", "curve", "energies", "landscape", "shapes", "path.gif", "path.mp4", *FILES)
    needs_density = ""
    takes = (*arguments_of(trace), *SETTINGS)

    @classmethod
    def of(cls, schema: Any, case: Case) -> Self:
        """See `Analysis`."""
        given = super().of(schema, case).arguments
        until = schema.analysis.until
        if schema.output.stresses:
            check_stresses(case, "output.stresses")
        if until is not None:
            with within("analysis.until."):
                until.share(case)
        settings = Settings(**{name: given.pop(name) for name in SETTINGS})
        return cls({**given, "settings": settings})

    def prepare(self, case_file: CaseFile, mass: str, changes: Mapping[str, Any]) -> Compute:
        """See `Analysis`; bad input, such as a mechanism, is refused before the first point."""
        own = dict(self.arguments)
        for one, other in (("load_factors", "steps"), ("steps", "load_factors")):
            if one in changes:
                own[other] = None  # both arguments set the same thing
        given = {"initial": case_file.start(mass).state, **own, **changes}
        turned = {name: given.pop(name) for name in SETTINGS if name in given}
        given["settings"] = replace(settings_of(given["settings"]), **turned)
        case = case_file.case(mass)

        def compute(progress: bool, begun: Begun) -> xarray.Dataset:
            count = 0

            def tell(point: Point) -> None:
                nonlocal count
                if not count:
                    points.clear()
                    begun()
                count += 1
                points.set_postfix_str(f"load factor {point.factor:.4g}", refresh=False)
                points.update()

            layout = "points: {n_fmt}{postfix} [{elapsed}]"  # nobody knows how many
            with closing(bar(progress, bar_format=layout, mininterval=0.0)) as points:
                return trace(case, progress=tell, **given)

        return compute

    def line(self, name: str, result: xarray.Dataset) -> str:
        """Points, limit points and bifurcations among them, iterations and time."""
        a, kinds = result.attrs, result["point"].values
        limits, crossings = int((kinds == "limit").sum()), int((kinds == "bifurcation").sum())
        loose = [critical_word(result, int(k)) for k in np.flatnonzero(is_loose(result))]
        more = f"; not located: {', '.join(loose)}" if loose else ""
        special = f" ({counted(limits, 'limit point')}, {counted(crossings, 'bifurcation')}{more})"
        unstable = f", {a['unstable_points']} of them unstable," if a["unstable_points"] > 0 else ""
        missed = f" ({a['status']})" if a["status"] != "complete" else ""
        return (
            f"  {a['method']}: {counted(result.sizes['step'], 'point')}"
            f"{special if limits or crossings else ''}{unstable} to the load factor "
            f"{float(result['load_factor'][-1]):.4g}{missed}, {a['newton_iterations']} iterations, "
            f"{a['wall_seconds']:.1f} s"
        )

    def shown(self, case: Case) -> NDArray[np.int64]:
        """Loaded nodes, or else nodes that supports move, or else all nodes that can move."""
        moved = [vectors.any(axis=1) for vectors, _ in case.prescribed_terms]
        if not case.loaded_nodes.size and np.any(moved):
            return np.flatnonzero(np.any(moved, axis=0))
        return super().shown(case)

    @staticmethod
    def sections(case_file: CaseFile, results: ByRule, album: Album) -> Iterator[Section]:
        """See `Analysis`."""
        (path,) = results.values()
        case = case_file.case()
        moved = plots.moved_supports(case)
        nodes, some = shown_nodes(case_file.output.nodes.tolist(), MOST_CURVES)
        direction = case_file.output.axis or main_direction({"": path}, nodes)
        yield from album.structure(case)
        yield Heading("The path")
        if moved is not None:
            yield from album.figure(
                "reaction",
                f"Total force of the supports at {listed('node', moved[0])}, which are moved along "
                f"{moved[1]}, over their displacement.",
                lambda: plots.plot_reaction(path, moved[0], direction=moved[1]),
                _reaction(path, *moved),
            )
        if moved is None or not set(nodes) <= set(moved[0]):
            yield from album.figure(
                "curve",
                f"Load factor against the displacement of {listed('node', nodes)}{some} along "
                f"{direction}.",
                lambda: plots.plot_load_displacement(path, nodes, direction=direction),
            )
        if path.sizes["step"] > 1:
            over: tuple[list[int], str] | tuple[None, None] = None, None
            if moved is not None and (np.diff(along(path, *moved)) > 0.0).all():
                over = moved  # moved nodes only move forward
            yield from album.figure(
                "energies",
                f"Strain energies of {', '.join(plots.energy_shares(path))}, stacked, with the "
                "work done on the structure; below, their shares.",
                lambda: plots.plot_path_energies(path, over[0], direction=over[1]),
            )
        found = _landscape(case, path, moved)
        if found is not None:
            yield from album.figure(
                "landscape",
                "Energy and force against the stroke, with the states without force (dots: "
                "stable; rings: unstable); shaded where the force falls.",
                lambda: plots.plot_landscape(found),
                _energy(found),
            )
        scale, enlarged = visible_scale(case, path)
        yield from album.figure(
            "shapes",
            f"The deformed sheet{enlarged}; the undeformed one in gray.",
            lambda: plots.draw_shapes(case, path, points=case_file.output.shapes or 4, scale=scale),
        )
        if path.sizes["step"] > 1 and case_file.output.animation:
            film = album.folder / f"path.{case_file.output.animation}"
            plots.animate(case, path, path=film, frames=FRAMES, fps=FPS, scale=scale)
            yield Picture(film, f"Along the path{enlarged}; at rest in gray.")
        if case_file.output.stresses:
            yield from stress_sections(path, album)
        yield Heading("The numbers")
        yield _points(case_file, path, nodes[:MOST_COLUMNS], direction, moved)
        if found is not None:
            yield _states(found)
        yield from releases(results)
        yield from crossing_panels(results)
        yield _run(case_file, path)
        yield Text(
            f"{_multiplied(path)} Stable means that the tangent stiffness of the free nodes has no "
            "negative eigenvalue: nodes that supports move stay where they are. At every point the "
            "out-of-balance force is below the tolerance times the forces at play, or rounding. "
            "The result carries its own case, can be run again from it, and motions can start from "
            "its points."
        )


FRAMES, FPS = 60, 15
MOST_CURVES = 8
"""Largest number of nodes in a figure of curves, each in its own color."""
MOST_ROWS = 12
"""Largest number of regular points in the table."""
MOST_COLUMNS = 4
"""Largest number of nodes with displacements in the table."""


def _reaction(path: xarray.Dataset, nodes: list[int], direction: str) -> Charts:
    """Force of moved supports against their displacement, for a page without figures."""
    curve = Curve(
        listed("node", nodes), along(path, nodes, direction),
        plots.total_reaction(path, nodes, direction=direction),
    )  # fmt: skip
    chart = Chart(f"displacement along {direction} (m)", "force (N)", [curve])
    return Charts([chart], f"Total force of the supports that are moved along {direction}.")


def _landscape(
    case: Case, path: xarray.Dataset, moved: tuple[list[int], str] | None
) -> Landscape | None:
    """Energy landscape of a path whose load or reaction falls somewhere; otherwise None."""
    driven = path["load_factor"].values
    if moved is not None:
        driven = plots.total_reaction(path, moved[0], direction=moved[1])
    if not (np.diff(driven) < 0.0).any():
        return None
    try:
        found = landscape(path, case)
    # driven by loads and supports, or by folds; or too coarse
    except (InputError, ComputationError):
        return None
    return found if found.negative_stiffness else None


def _energy(found: Landscape) -> Charts:
    """Curve of the energy against the stroke, for a page without figures."""
    stroke, _, energy = plots.with_states(found)
    states = np.array([[state.stroke, state.energy] for state in found.states]).reshape(-1, 2)
    curves = [Curve("energy", stroke, energy), Curve("states", *states.T, dots=True)]
    chart = Chart("stroke (m)", "energy (J)", curves, note=plots.barriers(found))
    return Charts([chart], "Energy against the stroke, with the states without force.")


def _states(found: Landscape) -> Table:
    """Table of the states without force, and of the energy barriers between the stable ones."""
    rows, passed = [], 0
    for state in found.states:
        ahead = back = None
        if state.stable:
            ahead = found.barrier(passed, passed + 1) if passed + 1 < len(found.stable) else None
            back = found.barrier(passed, passed - 1) if passed else None
            passed += 1
        word = "stable" if state.stable else "unstable"
        rows.append([state.stroke, cell(state.energy), word, ahead, back])
    header = ["stroke (m)", "energy (J)", "stability", "barrier ahead (J)", "barrier back (J)"]
    ranges = "; ".join(f"{start:.4g} to {end:.4g} m" for start, end in found.negative_stiffness)
    return Table(header, rows, f"States without force. The force falls from {ranges}.")


def _multiplied(path: xarray.Dataset) -> str:
    """Meaning of the load factor, in words."""
    constant = np.atleast_1d(path.attrs.get("constant", [])).astype(int).tolist()
    but = f", except {listed('load', constant)} (in full throughout)" if constant else ""
    return f"The load factor multiplies all loads and imposed displacements{but}."


def _points(
    case_file: CaseFile,
    path: xarray.Dataset,
    nodes: list[int],
    direction: str,
    moved: tuple[list[int], str] | None,
) -> Table:
    special = np.flatnonzero(path["point"].values != "regular").tolist()
    drawn = plots.chosen_points(path, case_file.output.shapes or 4)
    rows = sorted({*special, *drawn, *evenly(path, MOST_ROWS)})
    shares = plots.energy_shares(path)
    keys = [f"strain_{name}" if f"strain_{name}" in path else name for name in shares]
    total = sum(path[key].values for key in keys)
    columns = {"load factor": path["load_factor"].values}
    if moved is not None:
        columns[f"moved along {moved[1]} (m)"] = along(path, *moved)
        columns["force (N)"] = plots.total_reaction(path, moved[0], direction=moved[1])
    for node in nodes:
        if moved is None or node not in moved[0]:
            columns[f"node {node} along {direction} (m)"] = along(path, [node], direction)
    columns["strain energy (J)"] = np.asarray(total)
    columns |= {f"{name} (%)": 100.0 * share for name, share in shares.items()}
    negative = path["negative_eigenvalues"].values
    judged = ["" if n < 0 else "stable" if n == 0 else "unstable" for n in negative.tolist()]
    shown = {name: map(cell, column[rows]) for name, column in columns.items()}
    words = {"stability": [judged[k] for k in rows], "kind": [critical_word(path, k) for k in rows]}
    table = {"point": rows, **shown, "iterations": path["iterations"].values[rows], **words}
    return Table.of(table, "Points of the path, with all limit points and bifurcations")


def _run(case_file: CaseFile, path: xarray.Dataset) -> Table:
    kinds = path["point"].values
    cells = {
        "method": path.attrs["method"],
        "status": path.attrs["status"],
        "points": path.sizes["step"],
        "limit points": int((kinds == "limit").sum()),
        "bifurcations": int((kinds == "bifurcation").sum()),
        "Newton iterations": path.attrs["newton_iterations"],
        "factorizations": path.attrs["factorizations"],
        "step cuts": path.attrs["step_cuts"],
        "tolerance": path.attrs["tolerance"],
        "time (s)": path.attrs["wall_seconds"],
    }
    return Table(list(cells), [list(cells.values())], f"{case_file.path.name}: the run", digits=3)
