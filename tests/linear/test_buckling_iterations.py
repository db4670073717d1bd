"""Buckling about states of the path closer and closer to the first factor."""

from __future__ import annotations

import numpy as np
import pytest
from test_buckling import Truss, pressed, strip

import foldyn as fd
from foldyn.errors import FoldynWarning
from foldyn.linear.buckling import buckling


@pytest.mark.parametrize("b", [0.2, 1.0])
@pytest.mark.parametrize("h", [0.1, 2.0])
def test_iterations_reach_the_path(b, h):
    """The limit point, or the point where the high truss gives way sideways (`VonMises`)."""
    truss = Truss(b, h)
    exact = 0.5 * truss.stiffness * 2.0 * h**3 / (3.0 * np.sqrt(3.0))
    if h > np.sqrt(3.0) * b:
        exact = truss.stiffness * b**2 * np.sqrt(h**2 - 2.0 * b**2)
    found = buckling(truss.case(), 1, iterations=20)  # warns of nothing: it holds there
    assert float(found.load_factor[0]) == pytest.approx(exact, rel=1e-4)
    assert found.attrs["iterations"] < 10
    assert found.attrs["base_factor"] == pytest.approx(exact, rel=2e-4)
    assert found["shape"][0, 2, 0 if h > np.sqrt(3.0) * b else 2] == pytest.approx(1.0)
    v = -float(found["displacement"][2, 2])
    carried = 0.5 * truss.stiffness * (h - v) * (2.0 * h - v) * v
    assert carried == pytest.approx(found.attrs["base_factor"], rel=1e-8)


def test_iterations_change_nothing_where_the_path_is_straight():
    case = strip()
    once, more = buckling(case, 2), buckling(case, 2, iterations=9)
    assert more.attrs["iterations"] <= 5
    np.testing.assert_allclose(more.load_factor, once.load_factor, rtol=1e-4)
    assert float(more.attrs["departure"]) == pytest.approx(0.0, abs=1e-6)
    assert buckling(case, 1, iterations=0).attrs["base_factor"] == 0.0
    one = buckling(case, 1, iterations=1)
    assert one.attrs["base_factor"] == pytest.approx(0.9 * float(once.load_factor[0]), rel=1e-9)
    pull = buckling(strip(loads=pressed(strip().structure, way=1.0)), 1, iterations=5)
    assert (pull.attrs["positive"], pull.attrs["iterations"]) == (0, 0)


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
@pytest.mark.parametrize("rise", [0.02, 0.1])
def test_iterations_find_where_a_roof_sways(rise):
    """Four boards in an arch, pressed at the middle: the path's first bifurcation."""
    along = np.linspace(-1.0, 1.0, 5)
    vertices = [(0.5 * x, y, rise * (1.0 - x * x)) for y in (0.0, 0.2) for x in along]
    roof = fd.Pattern(vertices, [(k, k + 1, k + 6, k + 5) for k in range(4)])
    structure = fd.discretize(
        roof, fd.Sheet(3e9, 0.3, 2e-3), preset="n5b8e", crease_stiffness=50.0, fold_law="linear"
    )
    case = fd.Case(structure, [fd.Fix([0, 4, 5, 9])], [fd.Force([2, 7], (0.0, 0.0, -1.0))])
    once, found = (float(buckling(case, 1, iterations=n).load_factor[0]) for n in (0, 30))
    assert found > 2.0 * once
    path = fd.trace(case, "arc_length", load_factors=[0.0, 1.5 * found], first_step=found / 8.0)
    sways = path.load_factor.values[path.point.values == "bifurcation"][0]
    assert found == pytest.approx(float(sways), rel=1e-4)


@pytest.mark.matrix
def test_iterations_find_where_the_tube_buckles():
    """The tangent of the path loses its sign there; the linear factor is half of it."""
    pattern = fd.patterns.kresling(sides=6, radius=0.05, height=0.04, twist=30, storeys=2)
    structure = fd.discretize(pattern, fd.Sheet(2e9, 0.3, 0.25e-3, 900.0), preset="n5b8e")
    load = fd.Force("zmax", (0.0, 0.0, -1.0 / 6.0))
    case = fd.Case(structure, [fd.Fix("zmin")], [load])
    found = buckling(case, 1, iterations=20)
    factor = float(found.load_factor[0])
    assert (factor, found.attrs["iterations"]) == (pytest.approx(30.4586, rel=1e-4), 13)
    with pytest.warns(FoldynWarning, match="stability"):
        path = fd.trace(case, load_factors=[0, 10, 20, 28, 30, 0.999 * factor, 1.001 * factor])
    assert path.negative_eigenvalues.values.tolist()[:-1] == 6 * [0]
    assert path.negative_eigenvalues.values[-1] > 0
