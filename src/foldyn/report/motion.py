"""Figures and the page of a computed motion: what `foldyn run` leaves for people to look at."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from foldyn import plots
from foldyn.cases.casefile import CaseFile
from foldyn.report.page import write_report
from foldyn.report.sections import Heading, Picture, Section, Table, Text

if TYPE_CHECKING:
    import xarray

DPI = 150
MOST_NODES = 12
"""Nodes that one figure of a motion shows at most, a row each."""


def write_motion(
    case_file: CaseFile, results: Mapping[str, xarray.Dataset], folder: str | Path
) -> Path:
    """Draw a case and its motions into `folder`; returns the path of report.html.

    Parameters
    ----------
    case_file : CaseFile
    results : mapping
        Trajectories by mass rule.
    folder : path
        Exists already; files of the same names are replaced.
    """
    folder = Path(folder)
    first = next(iter(results))
    case, trajectory = case_file.case(first), results[first]
    chosen = case_file.output.nodes.tolist()
    nodes = chosen[:MOST_NODES]
    some = f" (the first {len(nodes)} of {len(chosen)})" if len(chosen) > len(nodes) else ""

    def figure(name: str, caption: str, draw: Callable[[], Any]) -> Picture:
        path = folder / f"{name}.png"
        draw().savefig(path, dpi=DPI)
        return Picture(path, caption)

    start, duration = float(trajectory["time"][0]), float(trajectory.attrs["duration"])
    scale = _scale(case, trajectory)
    rules = "all mass rules" if len(results) > 1 else f"mass rule {first}"
    sections: list[Section] = [
        Heading("The structure"),
        figure(
            "structure",
            "The pattern with its nodes, supports and loads.",
            lambda: plots.draw_structure(case),
        ),
        figure(
            "laws",
            "Constitutive curves: moment of a fold and of a bend against the dihedral, stress of "
            "a bar against its stretch.",
            lambda: plots.plot_laws(case.structure),
        ),
    ]
    if case.loads or case.imposed_terms or case.base_terms:
        sections.append(
            figure(
                "load",
                "Loads and imposed motions over time.",
                lambda: plots.plot_load_history(case, duration, start=start),
            )
        )
    sections += [
        Heading("The motion"),
        figure(
            "motion",
            f"Displacement of the chosen nodes{some} (left) and its frequency content (right), "
            f"{rules}.",
            lambda: plots.plot_history(
                results,
                nodes,
                axes=case_file.output.axis,
                max_frequency=case_file.output.max_frequency,
            ),
        ),
        Picture(
            plots.animate(
                case, trajectory, folder / f"motion.{case_file.output.animation}", scale=scale
            ),
            f"The motion with mass rule {first}{_enlarged(scale)}; at rest in gray.",
        ),
        figure(
            "energies",
            f"Energies over time and the error of their balance, mass rule {first}.",
            lambda: plots.plot_energies(trajectory),
        ),
        Heading("The numbers"),
        _table(case_file, results, nodes),
        Text(
            f"Computed with Foldyn {trajectory.attrs['foldyn_version']}. The energy error is the "
            "largest imbalance of kinetic + strain + dissipated energy - work, relative to the "
            "largest of them. The results carry their own case and can be run again from it."
        ),
    ]
    title = case_file.title or case_file.path.stem
    return write_report(folder / "report.html", title, sections)


def _table(case_file: CaseFile, results: Mapping[str, xarray.Dataset], nodes: list[int]) -> Table:
    rows = []
    for rule, result in results.items():
        a = result.attrs
        moved = result["displacement"].to_numpy()[:, nodes]
        rows.append(
            [
                rule,
                a["steps"],
                a["dt"],
                a["critical_step"],
                a["steps"] / max(a["wall_seconds"], 1e-9),
                a["energy_error"],
                float(np.linalg.norm(moved, axis=-1).max()),
            ]
        )
    header = [
        "mass rule",
        "steps",
        "step (s)",
        "critical step (s)",
        "steps per second",
        "energy error",
        "largest displacement (m)",
    ]
    shown = ", ".join(map(str, nodes))
    return Table(
        header, rows, f"{case_file.path.name}: the runs; displacement of nodes {shown}", digits=3
    )


def _scale(case: Any, trajectory: xarray.Dataset) -> float:
    """Enlargement with which a small motion can be seen: 1, 2, 5, 10, ... at most 1000."""
    largest = float(np.abs(trajectory["displacement"].to_numpy()).max())
    wanted = 0.1 * case.structure.pattern.size / max(largest, 1e-30)
    steps = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0]
    return max((s for s in steps if s <= wanted), default=1.0)


def _enlarged(scale: float) -> str:
    return "" if scale == 1.0 else f", displacements enlarged {scale:g} times"
