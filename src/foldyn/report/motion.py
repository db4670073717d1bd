"""Figures and the page of a computed motion: what `foldyn run` leaves for people to look at."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from foldyn import plots
from foldyn.cases.casefile import CaseFile
from foldyn.report.album import Album, enlarged, shown_nodes, visible_scale
from foldyn.report.page import write_report
from foldyn.report.sections import Heading, Picture, Section, Table, Text

if TYPE_CHECKING:
    import xarray


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
    album = Album(folder)
    first = next(iter(results))
    case, trajectory = case_file.case(first), results[first]
    nodes, some = shown_nodes(case_file.output.nodes.tolist())
    start, duration = float(trajectory["time"][0]), float(trajectory.attrs["duration"])
    scale = visible_scale(case, trajectory)
    rules = "all mass rules" if len(results) > 1 else f"mass rule {first}"
    sections: list[Section] = album.structure(case)
    if case.loads or case.imposed_terms or case.base_terms:
        sections.append(
            album.figure(
                "load",
                "Loads and imposed motions over time.",
                lambda: plots.plot_load_history(case, duration, start=start),
            )
        )
    sections += [
        Heading("The motion"),
        album.figure(
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
                case, trajectory, album.folder / f"motion.{case_file.output.animation}", scale=scale
            ),
            f"The motion with mass rule {first}{enlarged(scale)}; at rest in gray.",
        ),
        album.figure(
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
    return write_report(album.folder / "report.html", title, sections)


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
                a["critical_step"] if np.isfinite(a["critical_step"]) else None,
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
