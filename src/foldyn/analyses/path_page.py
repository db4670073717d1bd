"""Figures and the page of a path of equilibria."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import xarray

from foldyn import plots
from foldyn.analyses.casefile import CaseFile
from foldyn.cases import Case
from foldyn.errors import ComputationError, InputError
from foldyn.plots.along import along, critical_word, evenly, main_direction
from foldyn.plots.charts import Chart, Curve
from foldyn.report.album import (
    Album,
    ByRule,
    crossing_panels,
    listed,
    shown_nodes,
    visible_scale,
)
from foldyn.report.charts import Charts
from foldyn.report.sections import Heading, Picture, Section, Table, Text, cell
from foldyn.statics import Landscape, landscape

FRAMES, FPS = 60, 15
MOST_CURVES = 8
"""Nodes whose curves one figure shows at most, each in its color."""
MOST_ROWS = 12
"""Regular points that the table shows at most."""
MOST_COLUMNS = 4
"""Nodes whose displacements the table shows at most."""


def path_sections(case_file: CaseFile, results: ByRule, album: Album) -> Iterator[Section]:
    """See `Analysis.sections`."""
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
            f"Load factor over the displacement of {listed('node', nodes)}{some} along "
            f"{direction}.",
            lambda: plots.plot_load_displacement(path, nodes, direction=direction),
        )
    if path.sizes["step"] > 1:
        over: tuple[list[int], str] | tuple[None, None] = None, None
        if moved is not None and (np.diff(along(path, *moved)) > 0.0).all():
            over = moved  # they only move forward
        yield from album.figure(
            "energies",
            f"Strain energies of {', '.join(plots.energy_shares(path))}, stacked, with the work "
            "done on the structure; below, their shares.",
            lambda: plots.plot_path_energies(path, over[0], direction=over[1]),
        )
    found = _landscape(case, path, moved)
    if found is not None:
        yield from album.figure(
            "landscape",
            "Energy and force over the stroke, with the states that stay without force (dots: "
            "stable; rings: unstable) and shaded where the force falls.",
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
    yield Heading("The numbers")
    yield _points(case_file, path, nodes[:MOST_COLUMNS], direction, moved)
    if found is not None:
        yield _states(found)
    yield from crossing_panels(results)
    yield _run(case_file, path)
    yield Text(
        f"{_multiplied(path)} Stable means that the tangent stiffness of the free nodes has no "
        "negative eigenvalue: nodes that supports move stay where they are. At every point the "
        "out-of-balance force is below the tolerance times the forces at play, or rounding. The "
        "result carries its own case, can be run again from it, and motions can start from its "
        "points."
    )


def _reaction(path: xarray.Dataset, nodes: list[int], direction: str) -> Charts:
    """The force of moved supports over their displacement, for a page without figures."""
    curve = Curve(
        listed("node", nodes), along(path, nodes, direction),
        plots.total_reaction(path, nodes, direction=direction),
    )  # fmt: skip
    chart = Chart(f"displacement along {direction} (m)", "force (N)", [curve])
    return Charts([chart], f"Total force of the supports that are moved along {direction}.")


def _landscape(
    case: Case, path: xarray.Dataset, moved: tuple[list[int], str] | None
) -> Landscape | None:
    """The energy landscape of a path along which what drives it falls; None of others."""
    driven = (
        path["load_factor"].values
        if moved is None
        else plots.total_reaction(path, moved[0], direction=moved[1])
    )
    if not (np.diff(driven) < 0.0).any():
        return None
    try:
        found = landscape(path, case)
    except (InputError, ComputationError):  # driven by both or by folds, or too coarse
        return None
    return found if found.negative_stiffness else None


def _energy(found: Landscape) -> Charts:
    """Energy over the stroke, for a page without figures."""
    stroke, _, energy = plots.with_states(found)
    states = np.array([[state.stroke, state.energy] for state in found.states]).reshape(-1, 2)
    curves = [Curve("energy", stroke, energy), Curve("states", *states.T, dots=True)]
    chart = Chart("stroke (m)", "energy (J)", curves, note=plots.barriers(found))
    return Charts([chart], "Energy over the stroke, with the states that stay without force.")


def _states(found: Landscape) -> Table:
    """States without force, and the barriers between the stable ones."""
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
    """What the load factor is."""
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
    total = sum(path[f"strain_{name}"].values for name in shares)
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
    table = [
        [
            k,
            *(cell(column[k]) for column in columns.values()),
            int(path["iterations"][k]),
            judged[k],
            critical_word(path, k),
        ]
        for k in rows
    ]
    header = ["point", *columns, "iterations", "stability", "kind"]
    return Table(header, table, "Points of the path, with all limit points and bifurcations")


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
    caption = f"{case_file.path.name}: the run"
    return Table(list(cells), [list(cells.values())], caption, digits=3)
