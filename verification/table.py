"""The verification table: benchmarks that engineers know, beside our numbers.

    python -m verification.table [--write]

computes and prints all rows (a minute); with --write it stores the numbers and renews the table of
docs/verification.md, which a test compares with them.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from verification.benchmarks import large, noise, plates, sheets, shells
from verification.benchmarks.benchmark import Benchmark
from verification.fidelity.compare import markdown

BENCHMARKS: list[Benchmark] = [
    row for family in (plates, shells, large, sheets, noise) for row in family.BENCHMARKS
]
RESULTS = Path(__file__).parent / "benchmarks" / "results.csv"
PAGE = Path(__file__).parents[1] / "docs" / "verification.md"
BEGIN, END = "<!-- table: begin -->", "<!-- table: end -->"
COLUMNS = ["benchmark; source", "Foldyn", "quantity", "reference", "ours", "difference", "allowed"]


def key(row: Benchmark) -> str:
    """A name that no other row has."""
    return f"{row.name}; {row.model}; {row.source}"


def numbers(values: ArrayLike, digits: int) -> str:
    """Values with so many digits."""
    return ", ".join(f"{value:.{digits}g}" for value in np.atleast_1d(values))


def percent(part: float) -> str:
    """A difference; a very small one with a power of ten."""
    return f"{100.0 * part:+.1f} %" if abs(part) > 5e-4 else f"{part:+.0e}"


def read(path: Path = RESULTS) -> dict[str, tuple[float, ...]]:
    """Stored numbers by the key of their row."""
    with path.open(encoding="utf-8", newline="") as file:
        return {name: tuple(map(float, values.split())) for name, values in csv.reader(file)}


def write(ours: Mapping[str, Sequence[float]], path: Path = RESULTS) -> None:
    """Store numbers."""
    with path.open("w", encoding="utf-8", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerows([name, " ".join(f"{v:.10g}" for v in found)] for name, found in ours.items())


def table(ours: Mapping[str, Sequence[float]]) -> str:
    """The table, and the reasons of large differences below it."""
    rows, reasons = [], []
    for row in BENCHMARKS:
        found = ours[key(row)]
        rows.append([
            f"{row.name}; {row.source}", ", ".join(filter(None, (row.model, row.mesh))),
            ", ".join(filter(None, (row.quantity, row.unit))), numbers(row.reference, 5),
            numbers(found, 4), percent(row.difference(found)), percent(row.error).lstrip("+"),
        ])  # fmt: skip
        if row.why:
            reasons.append(f"- **{row.name}**: {row.why}")
    return "\n".join([markdown(COLUMNS, rows), "", *reasons])


def with_table(text: str, ours: Mapping[str, Sequence[float]]) -> str:
    """The page's text with the table between its marks."""
    before, rest = text.split(BEGIN)
    return f"{before}{BEGIN}\n{table(ours)}\n{END}{rest.split(END)[1]}"


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; it fails if a difference is larger than its row allows."""
    parser = argparse.ArgumentParser(description="Benchmarks beside our numbers.")
    parser.add_argument("--write", action="store_true", help="renew the stored table and the page")
    given = parser.parse_args(arguments)
    ours = {key(row): row.ours().tolist() for row in BENCHMARKS}
    print(table(ours))
    if given.write:
        write(ours)
        PAGE.write_text(with_table(PAGE.read_text("utf-8"), read()), "utf-8")
    return int(any(abs(row.difference(ours[key(row)])) > row.error for row in BENCHMARKS))


if __name__ == "__main__":
    sys.exit(main())
