"""Page of the sensitivity: robustness of the ranking of the distributions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from foldyn.plots import style
from foldyn.report import Heading, Section, Table, Text, write_report
from foldyn.report.album import Album
from foldyn.report.sections import cell
from foldyn.studies.herkal.claims import paper_table, tolerance
from foldyn.studies.herkal.metric import best
from foldyn.studies.herkal.runs import RULES
from verification.herkal import variations
from verification.herkal.models import DISTRIBUTIONS, LABELS, OTHERS
from verification.herkal.sensitivity import BEND_LAWS, CALIBRATIONS, PULSES
from verification.herkal.variations import Variations

LOADED = {"file": "as filed", "edge": "whole edge"}
SIDES = {"superlinear": (-0.3, style.BLUE), "linear": (0.08, style.ORANGE)}
TURNED = next(iter(OTHERS))
STIFFNESSES = tuple(product(BEND_LAWS, CALIBRATIONS))
# Settings that are changed one at a time.
CHANGES: Mapping[str, Mapping[str, Any]] = {
    "nothing": {},
    "pulse of 0.1 s instead of 0.5 s": {"pulse": 0.1},
    "pulse of 0.25 s": {"pulse": 0.25},
    "pulse of 1 s": {"pulse": 1.0},
    "load on every node of the edge": {"loads": "edge"},
    "linear bends": {"bend_law": "linear"},
    "calibration merlin2": {"calibration": "merlin2"},
}


def write(found: Variations, folder: Path) -> Path:
    """Write sensitivity.html into a folder; return its path."""
    title = "The case studies of Herkal et al.: sensitivity"
    return write_report(sections(found, Album(folder)), folder / "sensitivity.html", title=title)


def sections(found: Variations, album: Album) -> list[Section]:
    """Text, tables and a figure; empty if no case was computed with its own settings."""
    if not found.filed():
        return []
    return [
        Heading("How far this reaches"),
        Text(
            "The paper does not state how long the load acts, on which nodes, and with which law "
            "and calibration bends resist. Here are all combinations of these, with every "
            "distribution, against a shell under the same load. The density does not matter: it "
            "rescales the time of pulse, damping and record together.\n\n"
            f"{opinion(found)}\n\nComputed with: {found.about}. The first row of the first table "
            "shows the effect of the coarser shell."
        ),
        *album.figure(
            "sensitivity",
            "Errors of the distributions, a dot for each combination: superlinear bends above the "
            "line, linear ones below. Rings: the case files as they are. Crosses: the paper.",
            lambda: plot_sensitivity(found, (*DISTRIBUTIONS, TURNED), paper_table()),
        ),
        one_at_a_time(found),
        by_load(found),
        by_stiffness(found),
        *(over_all(found, law) for law in BEND_LAWS),
        orientations(found),
        frequencies(found),
    ]


def plot_sensitivity(
    found: Variations, models: Sequence[str], paper: Mapping[str, Mapping[str, float]]
) -> Figure:
    """Draw the errors in all combinations, a frame for each case, a row for each model.

    Parameters
    ----------
    found : Variations
    models : sequence of str
    paper : mapping
        The paper's errors by case and model.
    """
    cases = list(found.filed())
    figure = style.new_figure(9.0, 1.0 + 0.42 * len(models) * -(-len(cases) // 2))
    frames = figure.subplots(-(-len(cases) // 2), 2, squeeze=False, sharey=True, sharex=True)
    for frame, case in zip(frames.flat, cases, strict=False):
        style.frame(frame, "error", "", f"case {case[-1]}")
        filed = found.filed()[case]
        for place, model in enumerate(models):
            for law, (start, color) in SIDES.items():
                errors = [row[model] for row in found.chosen(case=case, bend_law=law)]
                heights = place + start + np.linspace(0.0, 0.22, len(errors))
                frame.plot(errors, heights, ".", color=color, markersize=3.5, label=f"{law} bends")
            ring = frame.plot(filed[model], place, "o", markersize=8, mfc="none", mec=style.BLACK)
            cross = frame.plot([], [], "x", color=style.VERMILLION, markersize=7, mew=1.8)
            if model in paper.get(case, {}):
                cross[0].set_data([paper[case][model]], [place])
            frame.axhline(place, color=style.LIGHT, linewidth=0.6, zorder=0)
        frame.set_yticks(range(len(models)), [LABELS[m] for m in models], fontsize=style.TICK)
        frame.set_ylim(len(models) - 0.4, -0.6)
        frame.grid(False, axis="y")
    largest = max(row[model] for row in found.motions for model in models)
    frames.flat[0].set_xlim(0.0, 1.03 * largest)
    for spare in frames.flat[len(cases) :]:
        spare.set_visible(False)
    handles = [line for line in frames.flat[0].get_lines() if "bends" in str(line.get_label())][:2]
    ring[0].set_label("case files as they are")
    cross[0].set_label("paper")
    style.legend_below(figure, [*handles, ring[0], cross[0]], columns=4)
    return style.finish(figure)


def opinion(found: Variations) -> str:
    """Text on how robust a ranking is, from the numbers."""
    parts = []
    paper, names = paper_table(), tuple(RULES)
    for law in BEND_LAWS:
        rows = found.chosen(bend_law=law)
        if not rows:
            continue
        hits = sum(best({m: r[m] for m in names}) == best(paper[r["case"]]) for r in rows)
        ranked = variations.standings(rows, names)
        first = min(ranked, key=lambda m: ranked[m].mean_rank)
        worst = max(one.worst_rank for one in ranked.values())
        spared = [LABELS[m] for m, one in ranked.items() if one.worst_rank < worst]
        last = (
            f"Never the last: {' and '.join(spared)}."
            if spared
            else "Each of the five comes last in some combination."
        )
        parts.append(
            f"With {law} bends the paper's best distribution of a case is also the best of the "
            f"five in {hits} of {len(rows)} combinations. {LABELS[first]} has the best mean "
            f"rank: {ranked[first].mean_rank:.1f}, between 1 and {ranked[first].worst_rank}. {last}"
        )
    return " ".join(parts)


def one_at_a_time(found: Variations) -> Table:
    """Table of agreement with the paper, and of changes of errors, for one change at a time."""
    names, filed = tuple(RULES), found.filed()
    rows: list[list[Any]] = []
    for what, change in CHANGES.items():
        table = found.filed(**change)
        if not table:
            continue
        near = variations.likeness(table, paper_table(), names, tolerance())
        moved = variations.likeness(table, filed, names, tolerance())
        sizes = [round(100.0 * size) if change else None for size in (moved.median, moved.largest)]
        cases = near.of // len(names)
        rows.append([what, f"{near.within} of {near.of}", f"{near.same_best} of {cases}",
                     f"{near.correlation:+.2f}", *sizes])  # fmt: skip
    return Table(
        ["what is changed", f"numbers within {tolerance():.0%} of the paper's",
         "cases with its best", "rank correlation with it", "median change (%)",
         "largest change (%)"],
        rows,
        "One change at a time: agreement of the five distributions with the paper's Table 1 "
        "(rank correlation: 1 for the same order, -1 for the reverse, averaged over the cases), "
        "and the change from the case files as they are.",
        digits=2,
    )  # fmt: skip


def _best_table(
    found: Variations,
    titles: list[str],
    tables: Iterable[tuple[Any, Any, variations.Errors]],
    caption: str,
) -> Table:
    """Best of the five distributions and its error by case, for pairs of settings."""
    cases, rows = list(found.filed()), []
    for first, second, table in tables:
        row: list[Any] = [first, second]
        for case in cases:
            errors = {m: table[case][m] for m in RULES} if case in table else {}
            name = best(errors)
            row.append(f"{LABELS[name]} ({errors[name]:.2g})" if name else None)
        rows.append(row)
    return Table([*titles, *[f"case {case[-1]}" for case in cases]], rows, caption)


def by_load(found: Variations) -> Table:
    """Table of the best of the five by load, with the files' bars and hinges."""
    tables: list[tuple[Any, Any, variations.Errors]] = []
    for loads, pulse in product(LOADED, PULSES):
        rows = found.chosen(**{**variations.FILED, "loads": loads, "pulse": pulse})
        tables.append((LOADED[loads], pulse, {row["case"]: row for row in rows}))
    return _best_table(
        found,
        ["loaded nodes", "pulse (s)"],
        [*tables, ("paper", None, paper_table())],
        "The best of the paper's five, with its error, by load; superlinear bends, standard "
        "calibration. In case 1 the file loads the whole edge.",
    )


def by_stiffness(found: Variations) -> Table:
    """Table of the best of the five by law and calibration of bends, with the files' load."""
    return _best_table(
        found,
        ["bends", "calibration"],
        [(law, one, found.filed(bend_law=law, calibration=one)) for law, one in STIFFNESSES],
        "The same by law and calibration of the bends; load as filed. Where all errors are large, "
        "the stiffness decides and not the mass.",
    )


def over_all(found: Variations, law: str) -> Table:
    """Table of ranks of each distribution in all combinations with one law of the bends."""
    chosen = found.chosen(bend_law=law)
    five, every = (variations.standings(chosen, tuple(names)) for names in (RULES, DISTRIBUTIONS))
    rows: list[list[Any]] = []
    for model, among in every.items():
        own = five.get(model)
        ranked = [None] * 3 if own is None else [own.mean_rank, own.worst_rank, own.best]
        rows.append([LABELS[model], *ranked, among.mean_rank, among.median, among.largest])
    return Table(
        ["distribution", "mean rank of the five", "worst", f"best of {len(chosen)}",
         "mean rank of all", "median error", "largest"],
        rows,
        f"All combinations with {law} bends: mean rank (all cases count equally) among the paper's "
        "five and among all, how often a distribution is the best of the five, and its errors.",
        digits=2,
    )  # fmt: skip


def orientations(found: Variations) -> Table:
    """Table of errors of equi-inertial masses in both orientations."""
    rows = []
    for case, filed in found.filed().items():
        every = found.chosen(case=case)
        fewer = sum(row[TURNED] < row["equi_inertial"] for row in every)
        cells = [filed["equi_inertial"], filed[TURNED], paper_table()[case]["equi_inertial"]]
        rows.append([case[-1], *cells, f"{fewer} of {len(every)}"])
    return Table(
        ["case", "obtuse", "acute", "paper", "acute is nearer in"],
        rows,
        "Equi-inertial masses with the larger share at the obtuse or at the acute corners: errors "
        "of the case files as they are, and how often acute is nearer to the shell.",
        digits=3,
    )


def frequencies(found: Variations) -> Table:
    """Table of errors of the first frequencies, which do not depend on the load."""
    names = (*DISTRIBUTIONS, TURNED)
    columns = [
        variations.frequency_errors(
            [r for r in found.frequencies if (r["bend_law"], r["calibration"]) == one], names
        )
        for one in STIFFNESSES
    ]
    return Table(
        ["distribution", *map(", ".join, STIFFNESSES)],
        [[LABELS[m], *[cell(100.0 * means[m]) for means, _ in columns]] for m in names],
        "A measure without a load: mean deviation (%) of the frequencies at rest from the shell's, "
        "by law and calibration of the bends, for modes with a partner in every distribution: "
        f"{', '.join(str(count) for _, count in columns)} of the first five of each case, 20 in "
        "all. Superlinear bends have the stiffness of turns of 1 degree.",
        digits=2,
    )
