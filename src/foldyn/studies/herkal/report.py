"""The page of the study: figures and tables of the four cases, with the paper's numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from matplotlib.figure import Figure
from numpy.typing import NDArray

from foldyn import plots
from foldyn.analyses.provenance import Call, computed, inputs, inputs_table
from foldyn.cases import Force
from foldyn.plots import style
from foldyn.report import Heading, Listing, Section, Table, Text, write_report
from foldyn.report.album import Album
from foldyn.report.sections import cell
from foldyn.structures.beyond_range import BELOW, plate_frequency
from foldyn.studies.herkal import runs, sensitivity_page, stiffnesses_page, variations
from foldyn.studies.herkal.claims import claims, paper_table, table1, tolerance
from foldyn.studies.herkal.metric import FAR, LEAST_MAC, best
from foldyn.studies.herkal.specimen import page as specimen_page
from foldyn.studies.herkal.specimen.page import NO_BREAK
from foldyn.studies.herkal.study import FULL, RESULTS, Study, mean_ranks, second_table
from foldyn.studies.herkal.variations import Variations, likeness, rank_correlation
from foldyn.studies.targets import Verdict
from foldyn.viewer import Stage, stage

TITLE = "Dynamic behavior of origami structures: the case studies of Herkal et al."
CHOSEN_BY = "case1_"  # prefix of the targets that our assumptions were chosen to match
SENSITIVITY = "sensitivity"  # folder of the sensitivity's tables within the study's folder


def write(study: Study, call: Call | None = None) -> Path:
    """Draw the figures of a study into its folder and write report.html; return its path.

    call : the command or call, for the page.
    """
    album = Album(study.folder)
    stages = {case: shown for case in study.plan.cases if (shown := stage_of(study, case))}
    first = next(iter(stages), "")
    varied = variations.read(study.folder / SENSITIVITY) or variations.read(variations.STORED)
    sections: list[Section | Stage] = [stages.pop(first)] if first else []
    sections += [Text(_opening(study)), Heading("What reproduces")]
    sections += [Text(verdict(study, varied)), _table_1(study), rank_table(study), _claims(study)]
    sections += [Heading("Why numbers differ"), Text(_differences()), *_second(study)]
    sections += stiffnesses_page.sections(study)
    if varied is not None:
        sections += sensitivity_page.sections(varied, album, tolerance())
    for case in study.plan.cases:
        sections += _case(study, case, album, stages.get(case))
    if study.data is not None:
        sections += specimen_page.sections(study.folder / RESULTS, study.parts[1], album)
    sections += [Heading("How it was computed"), Text(_how(study)), *inputs_of(study, call)]
    return write_report(sections, study.folder / "report.html", title=TITLE)


def write_sensitivity(varied: Variations, folder: Path) -> Path:
    """Write sensitivity.html, the page of the sensitivity only; return its path."""
    page = folder / "sensitivity.html"
    sections = sensitivity_page.sections(varied, Album(folder), tolerance())
    return write_report(sections, page, title=f"{TITLE}: sensitivity")


def _opening(study: Study) -> str:
    n = study.plan.numerics
    text = (
        "The paper compares ways of sharing a panel's mass among its nodes. The same pulse moves "
        "bars and hinges and a shell, and their displacement spectra are compared. Here the "
        "reference is Foldyn's shell.\n\n"
        "The metric: for each reported node, the norm of the difference of the amplitude spectra "
        "up to 5 Hz over the norm of the shell's, averaged over the nodes. 0 means equal, 1 is the "
        "error of no motion at all."
    )
    if study.data is not None:
        text += "\n\nThe last part calibrates a model of the paper's specimen from a film."
    if n != FULL.numerics:
        text += (
            f"\n\nThis is a coarse run: {n.divisions} divisions of the shell instead of "
            f"{FULL.numerics.divisions}, steps of {n.dt:g} s instead of {FULL.numerics.dt:g} s, "
            f"{n.duration:g} s of motion. It only shows what the study does: the shell is too soft."
        )
    return text


def _papers(study: Study) -> list[str]:
    return [m for m in study.plan.models if runs.model_of(m).paper]


def verdict(study: Study, varied: Variations | None = None) -> str:
    """Say from the numbers what is reproduced and what is not."""
    rows, names, paper = table1(study), _papers(study), paper_table()
    coarse = "" if study.plan.numerics == FULL.numerics else "In this coarse run: "
    if not rows:
        return "None of the paper's numbers could be computed."
    chosen = [v.holds for v in rows if v.target.key.startswith(CHOSEN_BY)]
    others = [v.holds for v in rows if not v.target.key.startswith(CHOSEN_BY)]
    parts = [
        f"{coarse}Of {len(rows)} computed numbers of the paper's Table 1, "
        f"{sum(map(bool, chosen + others))} agree within {tolerance():.0%}: "
        f"{sum(map(bool, chosen))} of {len(chosen)} in case 1, to which we tuned what the paper "
        f"does not state (so they are no evidence), and {sum(map(bool, others))} of {len(others)} "
        f"in the other cases. {_why_so_wide(varied)}"
    ]
    for case, row in study.table(models=names).items():
        known = {m: row[m] for m in names if math.isfinite(row[m])}
        if len(known) < 3:
            continue
        ours, theirs = best(known), best({m: paper[case][m] for m in names})
        same = "as in the paper" if ours == theirs else f"in the paper {runs.label(theirs)}"
        parts.append(
            f"Case {case[-1]}: {runs.label(ours)} has the smallest error, {same}; the rank "
            f"correlation with the paper's order is {rank_correlation(known, paper[case]):+.1f}."
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
    """Explain the tolerance: how far the numbers move with what the paper leaves open."""
    if varied is None:
        return ""
    filed, names = varied.filed(), runs.paper_rules()
    changed = {what: varied.filed(**change) for what, change in WIDER.items()}
    moved = [
        f"{likeness(table, filed, names, tolerance()).median:.0%} with {what}"
        for what, table in changed.items()
        if table
    ]
    if not moved:
        return ""
    return (
        "The bound is ours, and narrow: the paper does not state how long the pulse is and where "
        f"it acts, and half of the numbers change by more than {', '.join(moved)}. Agreement only "
        "means that our reading of the paper is close to what was computed there."
    )


def _differences() -> str:
    return (
        "Known differences. The paper's shell has transverse shear, a mesh of 0.1 m and connectors "
        "at the crease nodes; ours has no shear and exact creases. The table below shows the "
        "effect of another shell. The paper's bars and hinges probably come from MERLIN2, which "
        "orders some bend stiffnesses and bar areas differently (the calibration merlin2); ours "
        "follow the published formulas.\n\n"
        "The paper does not state density, supports, damping, direction and history of the load, "
        "and the length of the motion. We chose them once to match its second peaks and its row of "
        "case 1, which are therefore no evidence. Below, pulse, loaded nodes, law and calibration "
        "of the bends and the heavy corners of equi-inertial masses vary; the rest does not."
    )


def _second(study: Study) -> list[Section]:
    found = second_table(study)
    rows: list[list[Any]] = []
    for case, (divisions, row) in found.items():
        ours = study.table()[case]
        own = study.plan.numerics.divisions
        rows.append([case[-1], f"Foldyn,{NO_BREAK}{own}", *[cell(ours[m]) for m in row]])
        rows.append(["", f"OpenSees,{NO_BREAK}{divisions}", *row.values()])
    table = Table(
        ["case", "shell, divisions", *map(runs.label, study.plan.models)],
        rows,
        "The same errors against a shell of OpenSees: triangles with transverse shear and springs "
        "between crease nodes. Its motions come with the package.",
        digits=3,
    )
    return [table] if found else []


def _table_1(study: Study) -> Table:
    models = study.plan.models
    rows: list[list[Any]] = []
    for case, row in study.table().items():
        paper = paper_table()[case]
        rows.append([case[-1], "paper", *[paper.get(m) for m in models]])
        rows.append(["", "here", *[cell(row[m]) for m in models]])
    return Table(
        [
            "case",
            "",
            *[
                runs.label(m) if runs.model_of(m).paper else f"{runs.label(m)} (ours)"
                for m in models
            ],
        ],
        rows,
        "Table 1 of the paper and ours: mean error of the frequency content against the shell. The "
        "paper lacks the models marked as ours. Plate and n5b8e differ in stiffness, all others "
        "only in the distribution of the mass.",
        digits=3,
    )


def rank_table(study: Study) -> Table:
    """Table of the mean rank of each distribution, in the paper and in ours."""
    names, paper = _papers(study), {c: paper_table()[c] for c in study.plan.cases}
    theirs, five = mean_ranks(paper, names), mean_ranks(study.table(models=names), names)
    every = mean_ranks(study.table(), study.plan.models)
    rows = [
        [runs.label(m), theirs.get(m), cell(five.get(m, math.nan)), cell(every[m]),
         *(cell(100.0 * _frequency_error(study, m, up_to)) for up_to in (BELOW, math.inf))]
        for m in study.plan.models
    ]  # fmt: skip
    return Table(
        ["model", "mean rank, paper", "mean rank, here", "among all here",
         "error of low frequencies (%)", "of all (%)"],
        rows,
        f"Mean rank over {len(study.plan.cases)} cases (1 is best), and a measure without a load: "
        "mean absolute deviation from the shell's first five frequencies, for modes with a "
        f"partner. Low ones lie below {BELOW:g} of a free plate's frequency, above which the "
        "panels themselves vibrate.",
        digits=3,
    )  # fmt: skip


def _frequency_error(study: Study, model: str, up_to: float) -> float:
    """Mean error over the cases, for modes up to a multiple `up_to` of a free plate's frequency."""
    errors = []
    for case in study.plan.cases:
        found, file = study.frequencies(case, model), runs.case_study(case)
        if found is not None:
            low = found.reference < up_to * plate_frequency(file.pattern, file.sheet)
            off = np.abs(found.deviation[low])
            errors.append(float(np.nanmean(off)) if np.isfinite(off).any() else math.nan)
    return float(np.nanmean(errors)) if np.isfinite(errors).any() else math.nan


def _claims(study: Study) -> Table:
    rows = [
        [f"{v.target.what} [{v.target.source}]", v.asked, _computed(v), v.word]
        for v in claims(study)
    ]
    return Table(
        ["claim, what is measured, and source", "paper, or our bound", "here", ""],
        rows,
        "The paper's claims on the case studies, with their place in brackets. Bounds (at least, "
        'at most) are ours: they turn words into numbers. Rows marked "beside" are not judged.',
    )


def _computed(verdict: Verdict) -> str:
    """Computed value of a claim, with its deviation unless it keeps a bound."""
    found = f"{verdict.computed:.3g}"
    if verdict.target.bound is None or not verdict.holds:
        found += f" ({100.0 * verdict.deviation:+.1f} %)"
    return found.replace(" ", NO_BREAK)


def _case(study: Study, case: str, album: Album, shown: Stage | None) -> list[Section | Stage]:
    """Geometry, statics, motion and modes of one case."""
    case_file, (nodes, axis, up_to) = runs.case_study(case), runs.reported(case)
    sections: list[Section | Stage] = [
        Heading(case_file.heading),
        *([shown] if shown else []),
        *album.figure(
            f"{case}-structure",
            "The pattern with its vertices, supports and loads.",
            lambda: plots.draw_structure(case_file.case()),
        ),
    ]
    paths = study.paths(case)
    if paths:
        forces = [load for load in case_file.case().loads if isinstance(load, Force)]
        force = float(np.linalg.norm(forces[0].vector))
        sections += [
            *album.figure(
                f"{case}-statics",
                f"The load applied slowly: force against the {axis} displacement of the reported "
                "nodes.",
                lambda: _plot_statics(paths, nodes, axis, force),
            ),
            _statics(study.displacements(case), nodes, force),
        ]
    motions = {m: study.result(case, m, "motion") for m in (runs.REFERENCE, *study.plan.models)}
    for name, paper, what in (
        ("motion", True, "the paper's distributions"),
        ("motion-beyond", False, "the models beyond the paper"),
    ):
        moved = {
            runs.label(m): motion
            for m, motion in motions.items()
            if motion is not None and (m == runs.REFERENCE or runs.model_of(m).paper == paper)
        }
        if len(moved) > 1:
            sections += album.figure(
                f"{case}-{name}",
                f"Displacement of the reported nodes along {axis} (left) and its frequency "
                f"content (right): shell and {what}.",
                lambda moved=moved: plots.plot_history(
                    moved, nodes, axes=axis, max_frequency=up_to
                ),
            )
    return [*sections, _errors(study, case, nodes), _modes(study, case)]


def _statics(found: Mapping[str, NDArray], nodes: list[int], force: float) -> Table:
    shell = found.get("shell", np.full(len(nodes), math.nan))
    rows = [
        [name, *moved.tolist(), *map(cell, 100.0 * (moved / shell - 1.0)),
         force / float(np.abs(moved).max())]
        for name, moved in found.items()
    ]  # fmt: skip
    return Table(
        ["model", *[f"node {n} (m)" for n in nodes], *[f"node {n} (% off)" for n in nodes],
         "stiffness (N/m)"],
        rows,
        "Displacement at full load, its deviation from the shell's, and the force on a node "
        "divided by the largest displacement.",
        digits=3,
    )  # fmt: skip


def _plot_statics(
    paths: Mapping[str, xarray.Dataset], nodes: Sequence[int], axis: str, force: float
) -> Figure:
    """Draw the force (N at factor 1) on each loaded node against displacement, a frame each."""
    figure = style.new_figure(9.0, 3.4)
    frames = figure.subplots(1, len(nodes), squeeze=False, sharey=True)[0]
    for frame, node in zip(frames, nodes, strict=True):
        force_label = "force on each loaded node (N)" if node == nodes[0] else ""
        style.frame(frame, f"{axis} displacement (m)", force_label, f"node {node}")
        for index, (name, path) in enumerate(paths.items()):
            moved = path["displacement"].sel(node=node, axis=axis).values
            look = style.line_style(index) | {"linewidth": 1.5, "label": name}
            frame.plot(moved, force * path["load_factor"].values, **look)
        frame.locator_params(axis="x", nbins=5)
        style.exponents(frame, ticks=6)
    style.legend_below(figure, frames[0].get_lines(), columns=3)
    return style.finish(figure)


def _errors(study: Study, case: str, nodes: list[int]) -> Table:
    errors = {m: study.node_errors(case, m) for m in study.plan.models}
    return Table(
        ["model", *[f"node {n}" for n in nodes], "mean"],
        [[runs.label(m), *e.tolist(), float(e.mean())] for m, e in errors.items() if e is not None],
        "Error of the frequency content against the shell, per node.",
        digits=3,
    )


def _modes(study: Study, case: str) -> Table:
    found = [(m, study.frequencies(case, m)) for m in study.plan.models]
    known = [(m, partners) for m, partners in found if partners is not None]
    rows: list[list[Any]] = [
        ["shell (Hz)", *[f"{f:.3g}" for f in partners.reference], None] for _, partners in known[:1]
    ]
    for model, partners in known:
        cells = [
            f"{f:.3g} ({100 * d:+.0f} %, {m:.2f})".replace(" ", NO_BREAK)
            if math.isfinite(f)
            else "none"
            for f, d, m in zip(partners.frequency, partners.deviation, partners.mac, strict=True)
        ]
        rows.append([runs.label(model), *cells, cell(100.0 * partners.mean_error)])
    count = len(rows[0]) - 2 if rows else 0
    return Table(
        ["model", *[f"mode {k + 1}" for k in range(count)], "mean error (%)"],
        rows,
        "Frequencies at rest of the shell's first modes and of their partners: Hz, deviation and "
        f"MAC at the vertices. Partners have a MAC of at least {LEAST_MAC:g} and frequencies less "
        f"than {FAR:g} times apart. Superlinear bends have no stiffness at rest: theirs is that of "
        f"turns of {runs.SECANT:g} degree. Plate and n5b8e have linear bends.",
        digits=2,
    )


def _how(study: Study) -> str:
    n = study.plan.numerics
    first = study.result(study.plan.cases[0], runs.REFERENCE, "motion")
    version = "" if first is None else f"Foldyn {first.attrs['foldyn_version']}. "
    return (
        f"{version}Shell: {n.divisions} divisions of every panel edge, lumped mass, Newmark's "
        f"method with steps of {n.dt:g} s, as for n5b8e. Other bars and hinges: N5B8, the settings "
        "of the shipped case files herkal/case1 to case4, RK4. "
        f"Motions of {n.duration:g} s sampled every 0.01 s. "
        "Panels of the paper's models are too stiff in their plane and have no modes of their own: "
        "Foldyn's warnings about this are off. The folder runs has the results at the vertices, a "
        "NetCDF file each. A study that is started again computes what is missing or was computed "
        "with other settings or another version."
    )


def stage_of(study: Study, case: str) -> Stage | None:
    """Stage of a case's motions with the shell and all models in step; None if no motion exists.

    Motions are stored at the pattern's vertices, which are the nodes of the coarsest shell.
    """
    shown = {runs.label(m): found[["displacement"]] for m, found in _motions(study, case).items()}
    if not shown:
        return None
    case_file = runs.case_study(case)
    coarse = runs.case_with(case_file, runs.REFERENCE, runs.AS_FILED, divisions=1)
    return stage(shown, dict.fromkeys(shown, coarse), case_file.heading, runs.reported(case)[0])


def inputs_of(study: Study, call: Call | None) -> list[Section]:
    """Inputs of each case, and the total computing time."""
    sections: list[Section] = []
    every: dict[str, xarray.Dataset] = {}
    for case in study.plan.cases:
        found = _motions(study, case)
        if found:
            case_file = runs.case_study(case)
            table = inputs_table(inputs(case_file, case_file.case(), found))
            sections += [Heading(case_file.heading, level=3), table]
            sections.append(Listing(f"The case file {case_file.path.name}", case_file.text))
        every |= {f"{case}-{m}": motion for m, motion in found.items()}
    return [*sections, inputs_table(computed(every, call or Call()))] if every else []


def _motions(study: Study, case: str) -> dict[str, xarray.Dataset]:
    """The stored motions of a case by model, starting with the shell."""
    motions = {m: study.result(case, m, "motion") for m in (runs.REFERENCE, *study.plan.models)}
    return {m: motion for m, motion in motions.items() if motion is not None}
