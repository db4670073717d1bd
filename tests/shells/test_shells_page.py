"""What the page on shells shows works, and its numbers are those computed."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "shells.md").read_text("utf-8")


@pytest.fixture(scope="module")
def names():
    found: dict = {}
    for block in re.findall(r"^```python\n(.*?)^```$", PAGE, re.M | re.S):
        exec(compile(block, "shells.md", "exec"), found)
    return found


@pytest.mark.matrix
def test_shell_and_reduced_model_side_by_side(names):
    shell, reduced = names["displacement"]["shell"], names["displacement"]["bars and hinges"]
    assert shell == pytest.approx([0.0271, 0.0225, 0.0103], rel=0.04)
    assert np.abs(reduced / shell - 1.0).max() < 0.5
    shell, reduced = names["frequency"]["shell"], names["frequency"]["bars and hinges"]
    assert np.abs(reduced / shell - 1.0).max() < 0.5


def test_the_table_of_frequencies(names):
    rows = re.findall(r"^\| (\d+) \| ([\d., ]+) \| ([\d., ]+) \|$", PAGE, re.M)
    assert [int(row[0]) for row in rows] == [8, 16]
    for divisions, *columns in rows:
        for mass, shown in zip(("lumped", "consistent"), columns, strict=True):
            s = fd.shell(names["pattern"], names["sheet"], divisions=int(divisions), mass=mass)
            found = fd.modes(fd.Case(s, names["held"]), count=3).frequency.values
            assert [float(one) for one in shown.split(",")] == pytest.approx(found, abs=6e-4)
