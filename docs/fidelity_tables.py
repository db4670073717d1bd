"""The tables of errors in fidelity.md, from the stored results.

`python docs/fidelity_tables.py` writes them anew; a test compares them with what the page shows.
"""

from __future__ import annotations

import re
from pathlib import Path

from foldyn.studies.fidelity.stored import RESULTS, read, table

PAGE = Path(__file__).with_name("fidelity.md")


def with_tables(text: str) -> str:
    """The page's text with the tables between their marks."""
    for name in ("documented", "drawn"):
        begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
        found = table(read(RESULTS / f"{name}.csv"))
        text = re.sub(f"{begin}.*?{end}", f"{begin}\n{found}\n{end}", text, flags=re.S)
    return text


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text("utf-8")), "utf-8")
