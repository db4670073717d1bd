"""Superlinear bends have no stiffness at rest: the tangent says so, the floor repairs it."""

from __future__ import annotations

import numpy as np
import pytest
from samples import SHEET

import foldyn as fd

SQUARE = fd.Pattern([[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1, 2, 3]])


def null_modes(k):
    values = np.linalg.eigvalsh(k.toarray())
    return int((np.abs(values) < 1e-10 * values.max()).sum())


def panel(bend_law, scheme="n5b8"):
    return fd.discretize(SQUARE, SHEET, bend_law=bend_law, scheme=scheme, preset="herkal")


@pytest.mark.parametrize(
    ("bend_law", "scheme", "floor", "count"),
    [
        # N5B8, 15 dof: in the plane 3 rigid motions; across it 5 dof, 3 of them rigid
        ("linear", "n5b8", None, 6),
        ("superlinear", "n5b8", None, 8),
        ("superlinear", "n5b8", 1e-3, 6),
        ("superlinear", "n5b8", 1.0, 6),
        # N4B5, 12 dof: one bend
        ("linear", "n4b5", None, 6),
        ("superlinear", "n4b5", None, 7),
        ("superlinear", "n4b5", 1e-3, 6),
    ],
)
def test_null_modes_of_a_flat_panel(bend_law, scheme, floor, count):
    s = panel(bend_law, scheme)
    arguments = () if floor is None else (floor,)
    assert null_modes(s.tangent(np.zeros_like(s.nodes), *arguments)) == count


def test_floor_of_one_is_the_linear_bend_at_rest():
    zero = np.zeros((5, 3))
    floored = panel("superlinear").tangent(zero, floor=1.0).toarray()
    linear = panel("linear").tangent(zero).toarray()
    np.testing.assert_allclose(floored, linear, rtol=1e-14, atol=1e-9)


def test_floor_raises_only_what_lies_below_it():
    s = fd.discretize(fd.patterns.miura(), SHEET, preset="herkal")
    u = 0.02 * np.random.default_rng(0).standard_normal(s.nodes.shape)
    exact = s.tangent(u).toarray()
    np.testing.assert_array_equal(s.tangent(u, floor=1e-9).toarray(), exact)
    low = np.linalg.eigvalsh(s.tangent(u, floor=0.5).toarray() - exact)
    assert low.max() > 1e-3  # some bends are below a half at this state
    assert low.min() > -1e-10 * np.abs(exact).max()


def test_residual_has_no_floor():
    """A bend angle d gives the moment k d^(4/3), however small."""
    s = panel("superlinear", "n4b5")
    k, (j, axis_end, i, _) = s.bend_stiffness[0], s.bends[0]
    assert {j, axis_end} == {0, 2}
    arm = np.sqrt(0.5)
    for lift in (1e-5, 1e-7, 1e-9):  # so small that the bars, as lift^3, do not matter
        u = np.zeros_like(s.nodes)
        u[i, 2] = lift
        d = np.arctan2(lift, arm)
        theta = s.dihedrals(u)[1][0]
        assert theta == pytest.approx(np.pi - d, abs=1e-14)
        expected = k * (np.pi - theta) ** (4 / 3) / arm
        assert s.internal_force(u)[i, 2] == pytest.approx(expected, rel=1e-4)
