"""The tables of errors in fidelity.md, from the stored results.

`python docs/fidelity_tables.py` writes them anew; a test compares them with what the page shows.
"""

from __future__ import annotations

from pathlib import Path

from foldyn.studies.fidelity import motion_results as motions
from foldyn.studies.fidelity.internal import first_table
from foldyn.studies.fidelity.stored import RESULTS, read, table

PAGE = Path(__file__).with_name("fidelity.md")
TABLES = {
    "documented": lambda: table(read(RESULTS / "documented.csv")),
    "drawn": lambda: table(read(RESULTS / "drawn.csv")),
    "sheets": lambda: table(read(RESULTS / "sheets.csv")),
    "documented internal": lambda: first_table(read(RESULTS / "documented_internal.csv")),
    "drawn internal": lambda: first_table(read(RESULTS / "drawn_internal.csv")),
    "motions": lambda: motions.summaries(motions.read()),
    "motion cases": lambda: motions.by_case(motions.read()),
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
