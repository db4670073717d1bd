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


@pytest.mark.matrix
def test_the_table_of_frequencies(names):
    rows = re.findall(r"^\| (\d+) \| ([\d., ]+) \| ([\d., ]+) \|$", PAGE, re.M)
    assert [int(row[0]) for row in rows] == [8, 16]
    for divisions, *columns in rows:
        for mass, shown in zip(("lumped", "consistent"), columns, strict=True):
            s = fd.shell(names["pattern"], names["sheet"], divisions=int(divisions), mass=mass)
            found = fd.modes(fd.Case(s, names["held"]), count=3).frequency.values
            assert [float(one) for one in shown.split(",")] == pytest.approx(found, abs=6e-4)


def test_slender_panels_are_too_stiff_in_their_own_plane():
    """A cantilever of 10 x 0.5 m against a slender beam, whose shear changes 0.5 %."""
    told = re.search(r"is (\d+), (\d+) and \d+ % too high.*?divisions it is (\d+) and", PAGE, re.S)
    length, width, sheet = 10.0, 0.5, fd.Sheet(2e11, 0.3, 0.02, density=7850.0)
    beam = 3.516 / (2 * np.pi * length**2) * np.sqrt(2e11 * width**2 / 12 / 7850.0)

    def error(panels, divisions):
        x = np.linspace(0.0, length, panels + 1)
        points = [(s, y) for y in (0.0, width) for s in x]
        faces = [(i, i + 1, panels + 2 + i, panels + 1 + i) for i in range(panels)]
        pattern = fd.welded(fd.Pattern(points, faces), join=False)
        shell = fd.shell(pattern, sheet, divisions=divisions, mass="consistent")
        held = [fd.Fix([0, panels + 1], along=True), fd.Fix(range(len(shell.nodes)), "z")]
        return 100.0 * (fd.modes(fd.Case(shell, held), count=1).frequency.values[0] / beam - 1.0)

    found = error(1, 8), error(1, 16), error(20, 4)
    assert [float(one) for one in told.groups()] == pytest.approx(found, abs=0.6)
