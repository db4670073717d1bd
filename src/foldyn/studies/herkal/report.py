"""The page of the study: figures and tables of the four cases, and the paper's numbers beside."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from foldyn.report import Heading, Section, Table, Text, write_report
from foldyn.report.album import Album
from foldyn.report.sections import cell
from foldyn.studies.herkal import case_page, sensitivity_page, variations
from foldyn.studies.herkal.case_page import NO_BREAK
from foldyn.studies.herkal.claims import claims, paper_table, table1, tolerance
from foldyn.studies.herkal.metric import best
from foldyn.studies.herkal.sheet_models import MODELS, REFERENCE, label, model_of
from foldyn.studies.herkal.specimen import page as specimen_page
from foldyn.studies.herkal.study import FULL, RESULTS, Study, mean_ranks, second_table
from foldyn.studies.herkal.variations import Variations, likeness, rank_correlation
from foldyn.studies.targets import Verdict

TITLE = "Dynamic behavior of origami structures: the case studies of Herkal et al."
CHOSEN_BY = "case1_"  # rows of the targets by which assumptions were chosen
SENSITIVITY = "sensitivity"  # folder of its tables in that of the study


def write(study: Study) -> Path:
    """Draw the figures of a study into its folder and write report.html; returns its path."""
    album = Album(study.folder)
    varied = variations.read(study.folder / SENSITIVITY) or variations.read(variations.STORED)
    sections: list[Section] = [Text(_opening(study)), Heading("What reproduces")]
    sections += [Text(verdict(study, varied)), _table_1(study), rank_table(study), _claims(study)]
    sections += [Heading("Why numbers differ"), Text(_differences()), *_second(study)]
    if varied is not None:
        sections += sensitivity_page.sections(varied, album, tolerance())
    for case in study.plan.cases:
        sections += case_page.sections(study, case, album)
    if study.data is not None:
        sections += specimen_page.sections(study.folder / RESULTS, study.parts[1], album)
    sections += [Heading("How it was computed"), Text(_how(study))]
    return write_report(study.folder / "report.html", TITLE, sections)


def write_sensitivity(folder: Path, varied: Variations) -> Path:
    """Write sensitivity.html, the page of the sensitivity alone; returns its path."""
    page = folder / "sensitivity.html"
    sections = sensitivity_page.sections(varied, Album(folder), tolerance())
    return write_report(page, f"{TITLE}: sensitivity", sections)


def _opening(study: Study) -> str:
    n = study.plan.numerics
    specimen = (
        ""
        if study.data is None
        else "\n\nThe last part is the paper's specimen, from a film to a calibrated model."
    )
    short = (
        ""
        if n == FULL.numerics
        else (
            f"\n\nThis is a coarse run: {n.divisions} divisions of the shell instead of "
            f"{FULL.numerics.divisions}, steps of {n.dt:g} s instead of {FULL.numerics.dt:g} s, "
            f"{n.duration:g} s of motion. The shell is too soft for its numbers to be held against "
            "the paper's: they show what the study does."
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
        f"{specimen}{short}"
    )


def _papers(study: Study) -> list[str]:
    return [m for m in study.plan.models if model_of(m).paper]


def verdict(study: Study, varied: Variations | None = None) -> str:
    """Say from the numbers what reproduces and what does not."""
    rows, names, paper = table1(study), _papers(study), paper_table()
    coarse = "" if study.plan.numerics == FULL.numerics else "In this coarse run: "
    if not rows:
        return "None of the paper's numbers could be computed."
    near = [v.target.key for v in rows if v.holds]
    chosen = [v.target.key for v in rows if v.target.key.startswith(CHOSEN_BY)]
    parts = [
        f"{coarse}Of the {len(rows)} numbers of the paper's Table 1 that were computed, "
        f"{len(near)} come out within {tolerance():.0%}: "
        f"{len(set(near) & set(chosen))} of {len(chosen)} in case 1, by whose row we chose what "
        "the paper leaves unsaid, so that they are no evidence, and "
        f"{len(set(near) - set(chosen))} of {len(rows) - len(chosen)} in the other cases. "
        f"{_why_so_wide(varied)}"
    ]
    for case, row in study.table(models=names).items():
        known = {m: row[m] for m in names if math.isfinite(row[m])}
        if len(known) < 3:
            continue
        ours, theirs = best(known), best({m: paper[case][m] for m in names})
        same = "as in the paper" if ours == theirs else f"in the paper {label(theirs)}"
        parts.append(
            f"Case {case[-1]}: the smallest error is that of {label(ours)}, {same}; the order of "
            "the distributions has a rank correlation of "
            f"{rank_correlation(known, paper[case]):+.1f} with the paper's."
        )
    judged = [v for v in claims(study) if v.holds is not None]
    failing = [f"{v.target.what}: {v.computed:.3g}" for v in judged if v.holds is False]
    parts.append(
        f"Of {len(judged)} claims that could be judged, {len(judged) - len(failing)} hold."
        + (f" Not so: {'; '.join(failing)}." if failing else "")
    )
    return "\n\n".join(parts)


WIDER = {"a pulse half as long": {"pulse": 0.25}, "one twice as long": {"pulse": 1.0},
         "every node of the edge loaded": {"loads": "edge"}}  # fmt: skip


def _why_so_wide(varied: Variations | None) -> str:
    """Reason of the tolerance: what the numbers change by with what the paper leaves open."""
    if varied is None:
        return ""
    filed, names = varied.filed(), [m for m in MODELS if model_of(m).paper]
    changed = {what: varied.filed(**change) for what, change in WIDER.items()}
    moved = [
        f"{likeness(table, filed, names, tolerance()).median:.0%} with {what}"
        for what, table in changed.items()
        if table
    ]
    if not moved:
        return ""
    return (
        "The bound is ours, and narrow beside what the paper leaves open, how long the pulse is "
        f"and where it acts: half of the numbers change by more than {', '.join(moved)}. Agreement "
        "says that our reading of the paper is near to what was computed there, and no more."
    )


def _differences() -> str:
    return (
        "Known to differ from the paper's computation. The shell: the paper's has transverse "
        "shear, a mesh of 0.1 m and connectors at the nodes of the creases; ours has no shear and "
        "exact creases. What another shell changes is in the table below. Bars and hinges: the "
        "paper's were presumably computed with MERLIN2, which orders some bend stiffnesses and bar "
        "areas otherwise (the calibration merlin2); ours have those of the published formulas.\n\n"
        "Not said in the paper: density, supports, damping, direction and history of the load, "
        "the length of the motion. Ours were chosen once, so that the paper's second peaks and its "
        "row of case 1 come out; these are therefore no evidence. Pulse, loaded nodes, law and "
        "calibration of the bends and the heavy corners of equi-inertial masses are varied below; "
        "supports, damping and the length of the motion are not."
    )


def _second(study: Study) -> list[Section]:
    found = second_table(study)
    if not found:
        return []
    rows: list[list[Any]] = []
    for case, (divisions, row) in found.items():
        ours = study.table()[case]
        divided = study.plan.numerics.divisions
        rows.append([case[-1], f"Foldyn,{NO_BREAK}{divided}", *[cell(ours[m]) for m in row]])
        rows.append(["", f"OpenSees,{NO_BREAK}{divisions}", *row.values()])
    return [
        Table(
            ["case", "shell, divisions", *map(label, study.plan.models)],
            rows,
            "The same errors against another shell: triangles of OpenSees, with transverse shear "
            "and springs between the nodes of creases. Its motions come with the package.",
            digits=3,
        )
    ]


def _table_1(study: Study) -> Table:
    models = study.plan.models
    rows: list[list[Any]] = []
    for case, row in study.table().items():
        paper = paper_table()[case]
        rows.append([case[-1], "paper", *[paper.get(m) for m in models]])
        rows.append(["", "here", *[cell(row[m]) for m in models]])
    return Table(
        ["case", "", *map(label, models)],
        rows,
        "Table 1 of the paper and ours: mean error of the frequency content against the shell. The "
        "paper has none for what is beyond it.",
        digits=3,
    )


def rank_table(study: Study) -> Table:
    """Mean rank of each distribution, the paper's and ours."""
    paper_rules = _papers(study)
    theirs = mean_ranks({c: paper_table()[c] for c in study.plan.cases}, paper_rules)
    five = mean_ranks(study.table(models=paper_rules), paper_rules)
    every = mean_ranks(study.table(), study.plan.models)
    frequency = {m: _mean_frequency_error(study, m) for m in study.plan.models}
    rows = [
        [label(m), theirs.get(m), cell(five.get(m, math.nan)), cell(every[m]),
         cell(100.0 * frequency[m])]
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
        [f"{v.target.what} [{v.target.source}]", v.asked, _found(v), v.told] for v in claims(study)
    ]
    return Table(
        ["claim, what is measured, and source", "paper, or our bound", "here", ""],
        rows,
        "The paper's claims on the case studies. Bounds (at least, at most) are ours: they say in "
        "a number what a claim in words means. Rows that are only shown beside are not judged. In "
        "brackets where the paper has it.",
    )


def _found(verdict: Verdict) -> str:
    """What was computed, and by how much it fails or deviates."""
    found = f"{verdict.computed:.3g}"
    if verdict.target.bound is None or not verdict.holds:
        found += f" ({100.0 * verdict.deviation:+.1f} %)"
    return found.replace(" ", NO_BREAK)


def _how(study: Study) -> str:
    n = study.plan.numerics
    first = study.result(study.plan.cases[0], REFERENCE, "motion")
    version = "" if first is None else f"Foldyn {first.attrs['foldyn_version']}. "
    return (
        f"{version}Shell: {n.divisions} divisions of every panel edge, lumped mass, Newmark's "
        f"method with steps of {n.dt:g} s. Bars and hinges: N5B8, the settings of the shipped case "
        f"files herkal/case1 to case4, RK4. Motions of {n.duration:g} s sampled every 0.01 s. "
        "Results are in the folder runs, one NetCDF file each, with what happens at the pattern's "
        "vertices; a study that is started again computes what is missing, and what was computed "
        "with other settings or by another version of the program."
    )
