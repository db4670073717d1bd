"""The page of the study: figures and tables of the four cases, and the paper's numbers beside."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from foldyn import plots
from foldyn.cases import Force
from foldyn.report import Heading, Section, Table, Text, write_report
from foldyn.report.album import Album
from foldyn.studies.herkal.claims import TARGETS, claims, table1
from foldyn.studies.herkal.figures import plot_statics
from foldyn.studies.herkal.metric import ranks
from foldyn.studies.herkal.models import MODELS, REFERENCE, model_of
from foldyn.studies.herkal.runs import SECANT
from foldyn.studies.herkal.study import FAR, FULL, LEAST_MAC, Study, best, label, mean_ranks
from foldyn.studies.targets import read_targets

TITLE = "Dynamic behavior of origami structures: the case studies of Herkal et al."


def write(study: Study) -> Path:
    """Draw the figures of a study into its folder and write report.html; returns its path."""
    album = Album(study.folder)
    sections: list[Section] = [Text(_opening(study)), Heading("What reproduces")]
    sections += [Text(verdict(study)), _table_1(study), _rank_table(study), _claims(study)]
    for case in study.plan.cases:
        sections += _case(study, case, album)
    sections += [Heading("How it was computed"), Text(_how(study))]
    return write_report(study.folder / "report.html", TITLE, sections)


def _opening(study: Study) -> str:
    n = study.plan.numerics
    short = (
        ""
        if n == FULL.numerics
        else (
            f"\n\nThis is a coarse run: {n.divisions} divisions of the shell instead of "
            f"{FULL.numerics.divisions}, {n.duration:g} s of motion instead of "
            f"{FULL.numerics.duration:g} s. The metric depends on the length of the motion: its "
            "numbers here are not those of the full study and not to be held against the paper's."
        )
    )
    return (
        "The paper compares ways of sharing the mass of a panel among its nodes: it moves bars and "
        "hinges and shell elements by the same pulse and measures how far the frequency content of "
        "the displacements is from that of the shell. This page does the same with Foldyn's own "
        "shell as the reference.\n\n"
        "The metric: per reported node, the norm of the difference of the amplitude spectra up to "
        "5 Hz over the norm of the shell's spectrum; then the mean over the nodes. 0 is equal; 1 "
        "is as far away as no motion at all."
        f"{short}"
    )


def _paper(case: str) -> dict[str, float]:
    targets = read_targets(TARGETS, "table1")
    return {m: targets[f"{case}_{m}"].value for m in MODELS if f"{case}_{m}" in targets}


def _papers(study: Study) -> list[str]:
    return [m for m in study.plan.models if model_of(m).paper]


def verdict(study: Study) -> str:
    """Say from the numbers what reproduces and what does not."""
    rows = table1(study)
    within = sum(v.holds is True for v in rows)
    paper_rules = _papers(study)
    coarse = "" if study.plan.numerics == FULL.numerics else "In this coarse run: "
    parts = [
        f"{coarse}Of the {len(rows)} numbers of the paper's Table 1 that were computed, {within} "
        "come out within 25 %."
        if rows
        else "None of the paper's numbers could be computed."
    ]
    table = study.table(models=paper_rules)
    for case, row in table.items():
        ours, theirs = best(row), best({m: _paper(case)[m] for m in paper_rules})
        known = [m for m in paper_rules if math.isfinite(row[m])]
        if len(known) < 3:
            continue
        likeness = _rank_correlation(row, _paper(case), known)
        same = "as in the paper" if ours == theirs else f"in the paper {label(theirs)}"
        parts.append(
            f"Case {case[-1]}: the smallest error is that of {label(ours)}, {same}; the order of "
            f"the distributions has a rank correlation of {likeness:+.1f} with the paper's."
        )
    judged = claims(study)
    failing = [v.target.what for v in judged if v.holds is False]
    parts.append(
        f"Of {len(judged)} claims that could be judged, {len(judged) - len(failing)} hold."
        + (f" Not so: {'; '.join(failing)}." if failing else "")
    )
    parts.append(
        "Why numbers may differ: the paper leaves density, supports, direction and history of the "
        "load, and the length of the motion unsaid. Ours were chosen once so that its frequencies "
        "come out; which distribution is best moves with them. Its shell has transverse shear and "
        "hinge connectors, ours has exact creases and no shear. Its bars and hinges presumably had "
        "another order of bend stiffnesses and bar areas (the calibration merlin2), ours have "
        "those of the published formulas."
    )
    return "\n\n".join(parts)


def _rank_correlation(
    a: Mapping[str, float], b: Mapping[str, float], names: Sequence[str]
) -> float:
    """Spearman's: 1 for the same order, -1 for the reverse."""
    first, second = (ranks({m: row[m] for m in names}) for row in (a, b))
    n = len(names)
    apart = sum((first[m] - second[m]) ** 2 for m in names)
    return 1.0 - 6.0 * apart / (n * (n * n - 1))


def _cell(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _table_1(study: Study) -> Table:
    models = study.plan.models
    rows: list[list[Any]] = []
    for case, row in study.table().items():
        paper = _paper(case)
        rows.append([case[-1], "paper", *[paper.get(m) for m in models]])
        rows.append(["", "here", *[_cell(row[m]) for m in models]])
    return Table(
        ["case", "", *map(label, models)],
        rows,
        "Table 1 of the paper and ours: mean error of the frequency content against the shell. The "
        "paper has none for what is beyond it.",
        digits=3,
    )


def _rank_table(study: Study) -> Table:
    paper_rules = _papers(study)
    theirs = mean_ranks({c: _paper(c) for c in study.plan.cases}, paper_rules)
    five = mean_ranks(study.table(models=paper_rules), paper_rules)
    every = mean_ranks(study.table(), study.plan.models)
    frequency = {m: _mean_frequency_error(study, m) for m in study.plan.models}
    rows = [
        [label(m), theirs.get(m), _cell(five.get(m, math.nan)), _cell(every[m]),
         _cell(100.0 * frequency[m])]
        for m in study.plan.models
    ]  # fmt: skip
    return Table(
        ["distribution", "mean rank, paper", "mean rank, here", "among all here",
         "error of frequencies (%)"],
        rows,
        f"Mean rank over {len(study.plan.cases)} cases (1 is best), and a measure that does not "
        "depend on the load: mean size of the deviation of the shell's first five frequencies, of "
        "modes that have a partner.",
        digits=3,
    )  # fmt: skip


def _mean_frequency_error(study: Study, model: str) -> float:
    found = [study.frequencies(case, model) for case in study.plan.cases]
    known = [partners.mean_error for partners in found if partners is not None]
    return float(np.nanmean(known)) if np.isfinite(known).any() else math.nan


def _claims(study: Study) -> Table:
    rows = [
        [v.target.what, v.target.source, v.asked, _cell(v.computed), f"{v.deviation:+.0%}", v.told]
        for v in claims(study)
    ]
    return Table(
        ["claim and what is measured", "source", "paper, or bound of ours", "here",
         "from that by", ""],
        rows,
        "The paper's claims on the case studies. Bounds (at least, at most) are ours: they say in "
        "a number what a claim in words means.",
        digits=3,
    )  # fmt: skip


def _case(study: Study, case: str, album: Album) -> list[Section]:
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
    papers = {label(m) for m in (REFERENCE, *_papers(study))}
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
            f"{f:.3g} ({100 * d:+.0f} %, {m:.2f})" if math.isfinite(f) else "none"
            for f, d, m in zip(found.frequency, found.deviation, found.mac, strict=True)
        ]
        rows.append([label(model), *cells, _cell(100.0 * found.mean_error)])
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


def _how(study: Study) -> str:
    n = study.plan.numerics
    first = study.result(study.plan.cases[0], REFERENCE, "motion")
    version = "" if first is None else f"Foldyn {first.attrs['foldyn_version']}. "
    return (
        f"{version}Shell: {n.divisions} divisions of every panel edge, lumped mass, Newmark's "
        f"method with steps of {n.dt:g} s. Bars and hinges: N5B8, the settings of the shipped case "
        f"files herkal/case1 to case4, RK4. Motions of {n.duration:g} s sampled every 0.01 s. "
        "Results are in the folder runs, one NetCDF file each, with what happens at the pattern's "
        "vertices; a study that is started again computes what is missing or was computed with "
        "other settings."
    )
