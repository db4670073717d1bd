"""The tables of errors in fidelity.md, from the stored results.

`python -m docs.fidelity_tables` writes them anew; a test compares them with what the page shows.
"""

from __future__ import annotations

from pathlib import Path

from verification.fidelity import fresh
from verification.fidelity import motion_results as motions
from verification.fidelity.compare import RESULTS, columns, read, summary
from verification.fidelity.mixed_models import counted, gap_table, mixed_table

PAGE = Path(__file__).with_name("fidelity.md")
SHOWN = ("plate, consistent", "n5b8e, condensed", "standard, mixed_voronoi")


def of(name: str):
    """Stored results of a set."""
    return read(RESULTS / f"{name}.csv")


def sets() -> str:
    """The usual models on the sets that were computed with even meshes."""
    lines = [
        "| set | model, mass | median | 90th percentile | within 5 % | MAC above 0.95 | lost |",
        "|---|---|---|---|---|---|---|",
    ]
    for name in ("documented", "drawn", "sheets"):
        for model in SHOWN:
            lines.append(f"| {name} | {model} | {columns(summary(of(name), model))} |")
    return "\n".join(lines)


def without(table: str, *left_out: str) -> str:
    """A table less the rows that have one of some texts."""
    return "\n".join(line for line in table.splitlines() if not any(t in line for t in left_out))


TABLES = {
    "sets": sets,
    "mixed": lambda: without(
        mixed_table(counted()),
        "`n5b8e, bars`",
        "| free |",
        "| one edge |",
        "| two edges |",
        "| corners |",
    ),
    "gaps": lambda: gap_table(of("gaps")),
    "fresh": lambda: fresh.table(fresh.read()),
    "fresh bars": lambda: fresh.bars_table(fresh.read()),
    "motions": lambda: without(
        motions.summaries(motions.read()),
        "| n5b8e, linear |",
        "| plate, plate_superlinear |",
        "degrees | standard",
        "degrees | plate",
        "pulses | standard",
        "pulses | plate",
    ),
}


def with_tables(text: str) -> str:
    """The page's text with the tables between their marks."""
    for name, make in TABLES.items():
        begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
        before, rest = text.split(begin)
        text = f"{before}{begin}\n{make()}\n{end}{rest.split(end)[1]}"
    return text


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text("utf-8")), "utf-8")
