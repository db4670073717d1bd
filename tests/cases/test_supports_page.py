"""What the pages on supports and on point masses show works, and says what is computed."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
@pytest.mark.parametrize("page", ["supports.md", "mass.md"])
def test_the_code_of_the_page_runs(page, capsys):
    text = (DOCS / page).read_text("utf-8")
    names: dict = {}
    for block in re.findall(r"^```python\n(.*?)^```$", text, re.M | re.S):
        exec(compile(block, page, "exec"), names)
    shown = capsys.readouterr().out
    if page == "supports.md":
        assert float(names["motion"].strain_springs.max()) > 0.0
        found = [float(value) for value in shown.split("[")[-1].strip(" ]\n").split()]
        assert [round(value, 4) for value in found] == [0.0281, 0.0364]
        assert "0.0281, 0.0364" in text
    else:
        assert names["case"].total_mass == pytest.approx(names["structure"].total_mass + 1.5)
