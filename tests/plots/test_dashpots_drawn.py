"""Dashpots in the picture of a structure: where their lines end, and their legend."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.plots import draw_structure
from foldyn.plots.dashpots import REACH, dashpot_lines
from foldyn.plots.scene import View

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)
DASHPOTS = [
    fd.Dashpot(0.1, nodes=[8]),
    fd.Dashpot(0.2, nodes=[7], direction="x"),
    fd.Dashpot(0.05, between=[(1, 7), (0, 6)]),
]


@pytest.mark.parametrize("model", ["bars", "shell"])
def test_lines_and_legend(model):
    pattern = fd.patterns.miura()
    s = fd.discretize(pattern, SHEET) if model == "bars" else fd.shell(pattern, SHEET, divisions=2)
    case = fd.Case(s, [fd.Fix("xmin"), *DASHPOTS])
    lines = dashpot_lines(case, s.nodes, 0.1, View(28.0, -60.0))
    ends = {tuple(np.round(point, 9)) for point in lines.reshape(-1, 3)}
    wanted = [s.nodes[8], s.nodes[8] - [0, 0, 0.1 * REACH], s.nodes[7] + [0.1 * REACH, 0, 0]]
    for point in [*wanted, *s.nodes[[0, 1, 6, 7]]]:
        assert tuple(np.round(point, 9)) in ends
    figure = draw_structure(case)
    texts = {text.get_text() for legend in figure.legends for text in legend.get_texts()}
    assert "dashpot 0.1 N s/m to the ground" in texts
    assert "dashpot 0.05 N s/m between nodes" in texts


def test_none_without_dashpots():
    case = fd.Case(fd.discretize(fd.patterns.miura(), SHEET), [fd.Fix("xmin")])
    assert not len(dashpot_lines(case, case.structure.nodes, 0.1, View(28.0, -60.0)))
