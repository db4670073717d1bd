"""Sections of the page for one case: geometry, statics, motion, modes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from foldyn import plots
from foldyn.cases import Force
from foldyn.report import Heading, Section, Table
from foldyn.report.album import Album
from foldyn.report.sections import cell
from foldyn.studies.herkal.figures import plot_statics
from foldyn.studies.herkal.metric import FAR, LEAST_MAC
from foldyn.studies.herkal.runs import SECANT
from foldyn.studies.herkal.sheet_models import REFERENCE, label, model_of
from foldyn.studies.herkal.study import Study

NO_BREAK = "\N{NO-BREAK SPACE}"


def sections(study: Study, case: str, album: Album) -> list[Section]:
    """Geometry, statics, motion and modes of one case."""
    case_file = study.case_file(case)
    nodes, axis = study.reported(case)
    sections: list[Section] = [
        Heading(case_file.title or case),
        album.figure(
            f"{case}-structure",
            "The pattern with its vertices, supports and loads.",
            lambda: plots.draw_structure(case_file.case()),
        ),
    ]
    paths = study.paths(case)
    if paths:
        sections += [
            album.figure(
                f"{case}-statics",
                f"The load applied slowly: force over the {axis} displacement of the reported "
                "nodes.",
                lambda: plot_statics(paths, nodes, axis, _force(case_file.case().loads)),
            ),
            _statics(study, case, nodes),
        ]
    motions = {m: study.result(case, m, "motion") for m in (REFERENCE, *study.plan.models)}
    there = {label(m): motion for m, motion in motions.items() if motion is not None}
    papers = {label(m) for m in study.plan.models if model_of(m).paper} | {label(REFERENCE)}
    beyond = set(there) - papers | {label(REFERENCE)}
    for name, group, what in (
        ("motion", papers, "the paper's distributions"),
        ("motion-beyond", beyond, "the distributions beyond the paper"),
    ):
        shown = {key: motion for key, motion in there.items() if key in group}
        if len(shown) > 1:
            sections.append(
                album.figure(
                    f"{case}-{name}",
                    f"Displacement of the reported nodes along {axis} (left) and its frequency "
                    f"content (right): shell and {what}.",
                    lambda shown=shown: plots.plot_history(
                        shown, nodes, axes=axis, max_frequency=case_file.output.max_frequency
                    ),
                )
            )
    return [*sections, _errors(study, case, nodes), _modes(study, case)]


def _force(loads: Sequence[Any]) -> float:
    return next(float(np.linalg.norm(load.vector)) for load in loads if isinstance(load, Force))


def _statics(study: Study, case: str, nodes: list[int]) -> Table:
    found = study.displacements(case)
    shell = found.get("shell")
    force = _force(study.case_file(case).case().loads)
    rows = []
    for name, moved in found.items():
        off = [None] * len(nodes) if shell is None else (100.0 * (moved / shell - 1.0)).tolist()
        rows.append([name, *moved.tolist(), *off, force / float(np.abs(moved).max())])
    return Table(
        ["model", *[f"node {n} (m)" for n in nodes], *[f"node {n} (% off)" for n in nodes],
         "stiffness (N/m)"],
        rows,
        "Displacement at full load, its deviation from the shell's, and the force on a loaded node "
        "over the largest of these displacements.",
        digits=3,
    )  # fmt: skip


def _errors(study: Study, case: str, nodes: list[int]) -> Table:
    rows = []
    for model in study.plan.models:
        found = study.node_errors(case, model)
        if found is not None:
            rows.append([label(model), *found.tolist(), float(found.mean())])
    return Table(
        ["distribution", *[f"node {n}" for n in nodes], "mean"],
        rows,
        "Error of the frequency content against the shell, per node.",
        digits=3,
    )


def _modes(study: Study, case: str) -> Table:
    rows: list[list[Any]] = []
    for model in study.plan.models:
        found = study.frequencies(case, model)
        if found is None:
            continue
        if not rows:
            rows.append(["shell (Hz)", *found.reference.tolist(), None])
        cells = [
            f"{f:.3g} ({100 * d:+.0f} %, {m:.2f})".replace(" ", NO_BREAK)
            if math.isfinite(f)
            else "none"
            for f, d, m in zip(found.frequency, found.deviation, found.mac, strict=True)
        ]
        rows.append([label(model), *cells, cell(100.0 * found.mean_error)])
    count = len(rows[0]) - 2 if rows else 0
    rows = [[c if isinstance(c, str) or c is None or k == count + 1 else f"{c:.3g}"
             for k, c in enumerate(row)] for row in rows]  # fmt: skip
    return Table(
        ["model", *[f"mode {k + 1}" for k in range(count)], "mean error (%)"],
        rows,
        "Frequencies at rest of the shell's first modes and of their partners: Hz, deviation, and "
        f"how alike the shapes are at the vertices (MAC, 1 is equal; at least {LEAST_MAC:g}, and "
        f"frequencies less than {FAR:g} times apart). Bends are superlinear and have no stiffness "
        f"at rest: taken for turns of {SECANT:g} degree.",
        digits=2,
    )
