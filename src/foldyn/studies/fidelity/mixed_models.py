"""Models of bars and hinges beside the stored modes of the mixed sets.

    python -m foldyn.studies.fidelity.mixed_models [--out FOLDER]

compares models with what `references` has stored, computes no shell, writes a table for each set
and prints what they say.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from foldyn.structures.plate_frequency import BELOW, plate_frequency
from foldyn.studies.fidelity.compare import FIRST, Row, all_rows
from foldyn.studies.fidelity.mixed import SETS, SUPPORTS, MixedCase, mixed
from foldyn.studies.fidelity.references import CERTAIN, Stored, read_references, stored
from foldyn.studies.fidelity.stored import RESULTS, Modes, columns, summary_of, write

BESIDE = {
    "plate": "plate, consistent",
    "n5b8e": "n5b8e, condensed",
    "bars": "n5b8e, condensed, bars",
}
"""Models that are compared, by their name in the table."""


def references(name: str, folder: Path = RESULTS) -> list[tuple[MixedCase, Stored]]:
    """Cases of a set that are stored, with their modes."""
    lines = read_references(name, folder)
    return [(case, stored(case, lines[case.name])) for case in mixed(name) if case.name in lines]


def compared(case: MixedCase, true: Stored) -> Modes:
    """The first modes of a case by every model."""
    return Modes(case.name, {name: all_rows(case, true, model) for name, model in BESIDE.items()})


def certain(case: MixedCase, true: Stored) -> bool:
    """Whether all modes of a case that count are known to 1.5 %: the first, and low ones."""
    low = true.frequency < BELOW * plate_frequency(case.pattern(), case.sheet)
    counts = low | (np.arange(len(low)) < FIRST)
    return bool((true.doubt[counts] <= CERTAIN).all())  # nan is not


def mixed_table(found: Sequence[tuple[MixedCase, Modes]]) -> str:
    """Errors by support in Markdown, towers apart."""
    lines = [
        "| held | modes | model | median | 90th percentile | within 5 % | MAC above 0.95 | lost |",
        "|---|---|---|---|---|---|---|---|",
    ]
    sheets = [(case, modes) for case, modes in found if case.kind != "kresling"]
    groups = {
        "all, below 0.6": ([modes for _, modes in sheets], True),
        "all, first five": ([modes for _, modes in sheets], False),
        **{name: ([m for case, m in sheets if case.support == name], True) for name in SUPPORTS},
        "towers": ([modes for case, modes in found if case.kind == "kresling"], True),
    }
    for title, (group, low) in groups.items():
        for name in BESIDE:
            rows = [row for modes in group for row in modes.rows[name] if _counts(row, low)]
            if rows:
                lines.append(f"| {title} | {len(rows)} | `{name}` | {columns(summary_of(rows))} |")
    return "\n".join(lines)


def _counts(row: Row, low: bool) -> bool:
    return row.over_plate < BELOW if low else row.mode <= FIRST


def main(arguments: list[str] | None = None) -> int:
    """Run what the command line says."""
    parser = argparse.ArgumentParser(description="Models beside the stored mixed sets.")
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of the files")
    given = parser.parse_args(arguments)
    found, doubtful, missing = [], [], 0
    for name, (_, count) in SETS.items():
        known = references(name, given.out)
        missing += count - len(known)
        own = [(case, true, compared(case, true)) for case, true in known]
        if own:
            write(given.out / f"{name}.csv", [modes for *_, modes in own])
        found += [(case, modes) for case, true, modes in own if certain(case, true)]
        doubtful += [(case, true) for case, true, _ in own if not certain(case, true)]
    print(f"{len(found)} cases, {len(doubtful)} known less well than {CERTAIN:.1%}, "
          f"{missing} not computed\n\n{mixed_table(found)}\n")  # fmt: skip
    for case, true in doubtful:
        modes = ", ".join(f"{100 * doubt:.1f}" for doubt in np.atleast_1d(true.doubt))
        print(f"not counted: {case.name}: {modes} %")
    return 0


if __name__ == "__main__":
    sys.exit(main())
