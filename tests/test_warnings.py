"""Every warning is a line that names the page that explains it, at the line of who asks."""

from __future__ import annotations

import ast
import re
import warnings
from functools import cache
from pathlib import Path

import foldyn as fd
from foldyn.errors import ALSO, FoldynWarning, warn

ROOT = Path(__file__).resolve().parents[1]


@cache
def anchors(page: str) -> set[str]:
    """Anchors of a page's headings, as its links have them."""
    titles = re.findall(r"^#{1,3} (.+)$", (ROOT / "docs" / page).read_text("utf-8"), re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def calls(name: str):
    """Calls in the package whose function has a name, each with where it is."""
    for file in sorted((ROOT / "src").rglob("*.py")):
        text = file.read_text("utf-8")
        for node in ast.walk(ast.parse(text)) if "warn(" in text else ():
            if isinstance(node, ast.Call) and ast.unparse(node.func) == name:
                yield f"{file.relative_to(ROOT)}:{node.lineno}", node


def test_every_warning_names_a_page_that_is_there():
    assert [place for place, _ in calls("warnings.warn")] == []
    found = list(calls("warn"))
    assert len(found) > 70
    for place, call in found:
        page, _, anchor = ast.literal_eval(call.args[1]).partition("#")
        assert anchor in anchors(page), place


def test_a_warning_is_one_line_at_the_line_of_the_user():
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        list(map(lambda text: warn(text, "modes.md#modes"), [f"one{ALSO}two"]))
        fd.patterns.miura(cells=(1, 1), panel_angle=1.0472)
    assert [one.filename for one in caught] == [__file__] * 2
    assert str(caught[0].message) == "one; also two (docs/modes.md#modes)"
    assert str(caught[1].message).endswith("in radians (docs/sheets.md#units)")
    assert len(str(FoldynWarning("x" * 9000, "modes.md#modes"))) < 900
