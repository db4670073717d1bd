"""What the page says of the sensitivity: how far the ranking of the distributions reaches."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from foldyn.report import Heading, Section, Table, Text
from foldyn.report.album import Album
from foldyn.report.sections import cell
from foldyn.studies.herkal import variations
from foldyn.studies.herkal.claims import paper_table
from foldyn.studies.herkal.figures import plot_sensitivity
from foldyn.studies.herkal.metric import best
from foldyn.studies.herkal.sensitivity import BEND_LAWS, CALIBRATIONS, PULSES
from foldyn.studies.herkal.sheet_models import OTHERS, label, paper_rules, rules

LOADED = {"file": "as filed", "edge": "whole edge"}
TURNED = next(iter(OTHERS))
CHANGES: Mapping[str, Mapping[str, Any]] = {
    "nothing": {},
    "pulse of 0.1 s instead of 0.5 s": {"pulse": 0.1},
    "pulse of 0.25 s": {"pulse": 0.25},
    "pulse of 1 s": {"pulse": 1.0},
    "load on every node of the edge": {"loads": "edge"},
    "linear bends": {"bend_law": "linear"},
    "calibration merlin2": {"calibration": "merlin2"},
}
"""One thing at a time."""


def sections(found: variations.Variations, album: Album, tolerance: float) -> list[Section]:
    """Text, tables and a figure; nothing where no case was computed as filed."""
    if not found.filed():
        return []
    return [
        Heading("How far this reaches"),
        Text(
            "The paper does not say for how long the load acts, on which nodes, or with which law "
            "and calibration bends resist. Here all combinations of these are tried, with every "
            "distribution, against a shell under the same load. The density is not among them: it "
            "only rescales time, that of the pulse, the damping and the record together.\n\n"
            f"{opinion(found)}\n\nComputed with: {found.about}. What a coarser shell than that of "
            "the study changes by itself is in the first row of the first table."
        ),
        album.figure(
            "sensitivity",
            "Errors of the distributions under every combination, a dot each: above each line with "
            "superlinear bends, below it with linear ones. Rings: the case files as they are. "
            "Crosses: the paper's Table 1.",
            lambda: plot_sensitivity(found, (*rules(), TURNED), paper_table()),
        ),
        one_at_a_time(found, tolerance),
        by_load(found),
        by_stiffness(found),
        *(over_all(found, law) for law in BEND_LAWS),
        orientations(found),
        frequencies(found),
    ]


def opinion(found: variations.Variations) -> str:
    """Say from the numbers how far a ranking reaches."""
    parts = []
    paper, names = paper_table(), paper_rules()
    for law in BEND_LAWS:
        rows = found.chosen(bend_law=law)
        if not rows:
            continue
        hits = sum(best({m: r[m] for m in names}) == best(paper[r["case"]]) for r in rows)
        told = variations.standings(rows, names)
        first = min(told, key=lambda m: told[m].mean_rank)
        worst = max(one.worst_rank for one in told.values())
        spared = [label(m) for m, one in told.items() if one.worst_rank < worst]
        parts.append(
            f"With {law} bends the distribution that the paper finds best for a case is the best "
            f"of the five in {hits} of {len(rows)} combinations. The best mean rank is that of "
            f"{label(first)} ({told[first].mean_rank:.1f} of 5, between 1 and "
            f"{told[first].worst_rank}). "
            + (
                f"Never the last: {' and '.join(spared)}."
                if spared
                else "Each of the five comes last in some combination."
            )
        )
    return " ".join(parts)


def one_at_a_time(found: variations.Variations, tolerance: float) -> Table:
    """How near the table comes to the paper's, and how far it moves, with one thing changed."""
    names = paper_rules()
    filed = found.filed()
    rows: list[list[Any]] = []
    for what, change in CHANGES.items():
        table = found.filed(**change)
        if not table:
            continue
        paper = variations.likeness(table, paper_table(), names, tolerance)
        moved = variations.likeness(table, filed, names, tolerance)
        rows.append([what, *_beside_paper(paper), *(_moved(moved) if change else [None, None])])
    return Table(
        ["what is changed", f"numbers within {tolerance:.0%} of the paper's",
         "cases with its best", "rank correlation with it", "median change (%)",
         "largest change (%)"],
        rows,
        "One thing changed at a time: how near the five distributions come to the paper's Table 1 "
        "(mean of the cases' rank correlations: 1 is its order, -1 the reverse), and by how much "
        "the numbers change from those of the case files as they are.",
        digits=2,
    )  # fmt: skip


def _beside_paper(one: variations.Likeness) -> list[Any]:
    cases = one.of // len(paper_rules())
    return [f"{one.within} of {one.of}", f"{one.same_best} of {cases}", f"{one.correlation:+.2f}"]


def _moved(one: variations.Likeness) -> list[Any]:
    return [round(100.0 * one.median), round(100.0 * one.largest)]


def _first(row: variations.Row | None) -> str | None:
    if row is None:
        return None
    name = best({m: row[m] for m in paper_rules()})
    return f"{label(name)} ({row[name]:.2g})"


def _cases(found: variations.Variations) -> list[str]:
    return list(found.filed())


def by_load(found: variations.Variations) -> Table:
    """Which of the five is best under which load, bars and hinges as filed."""
    rows = []
    for loads, told in LOADED.items():
        for pulse in PULSES:
            tables = {
                row["case"]: row
                for row in found.chosen(
                    pulse=pulse,
                    loads=loads,
                    **{k: variations.FILED[k] for k in ("bend_law", "calibration")},
                )
            }
            rows.append([told, pulse, *[_first(tables.get(case)) for case in _cases(found)]])
    paper = paper_table()
    rows.append(["paper", None, *[_first(paper[case]) for case in _cases(found)]])
    return Table(
        ["loaded nodes", "pulse (s)", *[f"case {case[-1]}" for case in _cases(found)]],
        rows,
        "Which of the paper's five has the smallest error (and the error), by load; superlinear "
        "bends, standard calibration. In case 1 the file loads the whole edge.",
    )


def by_stiffness(found: variations.Variations) -> Table:
    """Which of the five is best with which bends, load as filed."""
    rows = []
    for law in BEND_LAWS:
        for calibration in CALIBRATIONS:
            table = found.filed(bend_law=law, calibration=calibration)
            firsts = [_first(table.get(case)) for case in _cases(found)]
            rows.append([law, calibration, *firsts])
    return Table(
        ["bends", "calibration", *[f"case {case[-1]}" for case in _cases(found)]],
        rows,
        "The same by law and calibration of the bends; load as filed. Where all errors are large, "
        "the stiffness decides and not the mass.",
    )


def over_all(found: variations.Variations, law: str) -> Table:
    """Standing of each distribution over all combinations with one law of the bends."""
    chosen = found.chosen(bend_law=law)
    five, every = variations.standings(chosen, paper_rules()), variations.standings(chosen, rules())
    rows: list[list[Any]] = []
    for model in rules():
        own, among = five.get(model), every[model]
        ranked = [None] * 3 if own is None else [own.mean_rank, own.worst_rank, own.best]
        rows.append([label(model), *ranked, among.mean_rank, among.median, among.largest])
    return Table(
        ["distribution", "mean rank of the five", "worst", f"best of {len(chosen)}",
         "mean rank of all", "median error", "largest"],
        rows,
        f"All combinations with {law} bends: ranks among the paper's five and among all (mean over "
        "the cases of the mean over the combinations of each), how often a distribution is the "
        "best of the five, and its errors.",
        digits=2,
    )  # fmt: skip


def orientations(found: variations.Variations) -> Table:
    """Equi-inertial both ways."""
    rows = []
    for case in _cases(found):
        filed = found.filed()[case]
        every = found.chosen(case=case)
        fewer = sum(row[TURNED] < row["equi_inertial"] for row in every)
        cells = [filed["equi_inertial"], filed[TURNED], paper_table()[case]["equi_inertial"]]
        rows.append([case[-1], *cells, f"{fewer} of {len(every)}"])
    return Table(
        ["case", "obtuse", "acute", "paper", "acute is nearer in"],
        rows,
        "Equi-inertial masses with the larger share at the obtuse or the acute corners: errors "
        "with the case files as they are, and in how many combinations the second is nearer to "
        "the shell.",
        digits=3,
    )  # fmt: skip


def frequencies(found: variations.Variations) -> Table:
    """Errors of the first frequencies, which no load has a part in."""
    names = (*rules(), TURNED)
    columns: list[tuple[str, dict[str, float], int]] = []
    for law in BEND_LAWS:
        for calibration in CALIBRATIONS:
            chosen = [
                row
                for row in found.frequencies
                if row["bend_law"] == law and row["calibration"] == calibration
            ]
            means, count = variations.frequency_errors(chosen, names)
            columns.append((f"{law}, {calibration}", means, count))
    rows = [[label(m), *[cell(100.0 * means[m]) for _, means, _ in columns]] for m in names]
    return Table(
        ["distribution", *[title for title, _, _ in columns]],
        rows,
        "A measure without a load: mean deviation (%) of the frequencies at rest from the shell's, "
        "by law and calibration of the bends, over those of its first five modes that have a "
        "partner of like shape (MAC) with every distribution: "
        f"{', '.join(str(count) for _, _, count in columns)} of 20. Superlinear bends, which have "
        "no stiffness at rest, are taken for turns of 1 degree.",
        digits=2,
    )
