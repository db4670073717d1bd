"""What the page of a path finds out about the case and the path."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from case_texts import HELD_FOLD_TEXT as FOLD
from foldyn.analyses import read_case
from foldyn.analyses.path import PathAnalysis
from foldyn.plots import moved_supports
from foldyn.report.album import Album
from foldyn.report.sections import Charts


@pytest.fixture
def cell():
    pattern = fd.patterns.miura(cells=(1, 1))
    return fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01), preset="plate")


@pytest.mark.parametrize(
    ("moves", "expected"),
    [
        ([([6, 8], "x", 0.1)], ([6, 8], "x")),
        ([([6, 8], "z", -0.1)], ([6, 8], "-z")),
        # pulled at both ends: what one end takes, not the sum, which is nothing
        ([([0, 2], "x", -0.05), ([6, 8], "x", 0.05)], ([0, 2], "-x")),
        ([([0], "y", 0.01), ([6, 7, 8], "x", 0.02)], ([6, 7, 8], "x")),
        ([([6, 7, 8], "x", [0.1, 0.2, 0.1])], ([7], "x")),
        ([([6, 8], "x", 0.0)], None),
        ([], None),
    ],
)
def test_the_supports_that_move_farthest(cell, moves, expected):
    case = fd.Case(cell, [fd.Impose(*move) for move in moves])
    assert moved_supports(case) == expected


def write(tmp_path, text):
    file = tmp_path / "case.toml"
    file.write_text(FOLD + text, "utf-8")
    case_file = read_case(file)
    path = case_file.run()
    page = case_file.analysis.page(case_file, {case_file.masses[0]: path}, tmp_path, figures="png")
    return path, page.read_text("utf-8")


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:the path loses stability")
def test_loads_that_are_constant_are_named(tmp_path):
    loads = "[[loads]]\nnodes = [0, 1]\nforce = [-1e-3, 0, 0]\n[[loads]]\ngravity = [0, 0, -9.81]\n"
    text = loads + '[analysis]\nkind = "statics"\nconstant = "gravity"\nsteps = 2\n'
    path, page = write(tmp_path, text)
    assert path.attrs["constant"].tolist() == [1]
    assert "all loads and imposed displacements, except load 1 (in full throughout)." in page


@pytest.mark.matrix
def test_there_and_back(tmp_path):
    """Energies over a displacement that returns are drawn over the way."""
    moved = '[[supports]]\nnodes = [0, 1]\naxis = "x"\ndisplacement = -0.1\n'
    text = moved + '[analysis]\nkind = "statics"\nload_factors = [0, 0.5, 1, 0.5, 0]\n'
    path, page = write(tmp_path, text)
    assert (tmp_path / "energies.png").exists()
    force = fd.plots.total_reaction(path, [0, 1], direction="-x")
    np.testing.assert_allclose(force[3:], force[1::-1], atol=1e-9 * force.max())
    assert "moved along -x (m)" in page
    assert not (tmp_path / "landscape.png").exists()  # the force falls on the way back alone


@pytest.mark.matrix
def test_a_path_through_two_states_shows_its_landscape(tmp_path):
    case_file = read_case(fd.studies.find_case("gallery/kresling"))
    path = case_file.run()
    found, results = fd.landscape(path), {case_file.masses[0]: path}
    drawn = list(PathAnalysis.sections(case_file, results, Album(tmp_path, "svg")))
    assert (tmp_path / "landscape.svg").exists()
    (table,) = [one for one in drawn if getattr(one, "caption", "").startswith("States without")]
    assert [row[:3] for row in table.rows] == [
        [one.stroke, pytest.approx(one.energy), "stable" if one.stable else "unstable"]
        for one in found.states
    ]
    assert [row[3:] for row in table.rows] == [
        [found.barrier(0, 1), None], [None, None], [None, found.barrier(1, 0)],
    ]  # fmt: skip
    (chart,) = [
        one.charts[0] for one in PathAnalysis.sections(case_file, results, Album(tmp_path, None))
        if isinstance(one, Charts) and one.charts[0].xlabel == "stroke (m)"
    ]  # fmt: skip
    assert chart.curves[1].x.tolist() == [one.stroke for one in found.states]
