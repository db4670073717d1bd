"""Models of bars and hinges compared with the stored modes of the mixed sets.

    python -m verification.fidelity.mixed_models [--out FOLDER]

compares models with the results stored by `references`, computes no shell, writes a table for each
set and prints summaries (a few minutes).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np

from foldyn.structures.beyond_range import BELOW
from verification.fidelity import compare
from verification.fidelity.compare import Modes, Row
from verification.fidelity.mixed import SETS, SUPPORTS, MixedCase
from verification.fidelity.references import Stored, case_sets, certain, read_references, stored

# Compared models by name in the table.
BESIDE = {
    "plate": "plate, consistent",
    "n5b8e": "n5b8e, condensed",
    compare.SUPERELEMENTS: compare.SUPERELEMENTS,
    "n5b8e, bars": "n5b8e, condensed, bars",
}


@cache
def references(name: str, folder: Path = compare.RESULTS) -> list[tuple[MixedCase, Stored]]:
    """Stored cases of a set, with their modes."""
    lines, cases = read_references(name, folder), case_sets()[name]
    return [(case, stored(case, lines[case.name])) for case in cases if case.name in lines]


def compared(case: MixedCase, true: Stored) -> Modes:
    """The first modes of a case by every model."""
    rows = {name: compare.all_rows(case, true, model) for name, model in BESIDE.items()}
    return Modes(case.name, rows)


def mixed_table(found: Sequence[tuple[MixedCase, Modes]]) -> str:
    """Errors by support in Markdown, towers apart."""
    lines = []
    sheets = [(case, modes) for case, modes in found if case.kind != "kresling"]
    groups = {
        "all, below 0.6": ([modes for _, modes in sheets], True),
        "all, first five": ([modes for _, modes in sheets], False),
        **{name: ([m for case, m in sheets if case.support == name], True) for name in SUPPORTS},
        "towers": ([modes for case, modes in found if case.kind == "kresling"], True),
    }
    for title, (group, low) in groups.items():
        for name in BESIDE:
            rows = [row for modes in group for row in modes.rows[name] if counts(row, low)]
            if rows:
                lines.append(
                    [title, len(rows), f"`{name}`", compare.columns(compare.summary_of(rows))]
                )
    return compare.markdown(["held", "modes", "model", *compare.ERRORS], lines)


def gap_table(found: Sequence[Modes]) -> str:
    """Errors of each case in Markdown: of low modes, and of the first five."""
    models = list(BESIDE)[:3]
    heads = [*(f"{name}, below 0.6" for name in models[:2]), *(f"{name}, f1-f5" for name in models)]
    rows = []
    for modes in found:
        cells = [_span(modes.rows[name], low=True) for name in models[:2]]
        cells += [_span(modes.rows[name], low=False) for name in models]
        rows.append([modes.case, *cells])
    return compare.markdown(["", *heads], rows)


def _span(rows: Sequence[Row], low: bool) -> str:
    """Least and largest error."""
    error = np.array([row.error for row in rows if counts(row, low)])
    paired = 100.0 * error[~np.isnan(error)]
    lost = f"{len(error) - len(paired)} lost" if len(paired) < len(error) else ""
    span = f"{paired.min():+.1f} to {paired.max():+.1f} %" if len(paired) else ""
    return ", ".join(filter(None, (span, lost))) or "none"


def counts(row: Row, low: bool) -> bool:
    """Whether a mode counts: a low one, or one of the first five."""
    return row.over_plate < BELOW if low else row.mode <= compare.FIRST


def counted(folder: Path = compare.RESULTS) -> list[tuple[MixedCase, Modes]]:
    """Stored results of the mixed sets for cases with reliable references."""
    found = []
    for name in SETS:
        modes = {one.case: one for one in compare.read(folder / f"{name}.csv")}
        known = references(name, folder)
        found += [(case, modes[case.name]) for case, true in known if certain(case, true)]
    return found


def main(arguments: list[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Models beside the stored shells.")
    parser.add_argument("--out", type=Path, default=compare.RESULTS, help="folder of the files")
    given = parser.parse_args(arguments)
    for name, cases in case_sets().items():
        known = references(name, given.out)
        print(f"{name}: {len(known)} of {len(cases)} cases are stored", flush=True)
        compare.write([compared(case, true) for case, true in known], given.out / f"{name}.csv")
        for case, true in known:
            if not certain(case, true):
                print(f"known to {100 * np.max(true.doubt):.1f} % only: {case.name}", flush=True)
    print(
        f"\n{mixed_table(counted(given.out))}\n\n{gap_table(compare.read(given.out / 'gaps.csv'))}"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
