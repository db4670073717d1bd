"""Panels that would stretch and curl if they were free: what they add is exact when they may."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.structures.swelling import chord_turns, place_of

STRIP = fd.Pattern(
    [[0, 0, 0], [0, 1, 0], [1.3, 0, 0], [1, 1, 0], [2, 0, 0], [2.2, 1.1, 0]],
    [[0, 2, 3, 1], [2, 4, 5, 3]],
)
SHEET = fd.Sheet(1e6, 0.3, 0.01, 1000.0)


@pytest.mark.parametrize("scheme", ["n5b8", "n4b5"])
def test_hinges_turn_as_on_a_paraboloid(scheme: str) -> None:
    """Nodes on w = kappa r^2 / 2 have these dihedrals, to the second order in the slope."""
    s = fd.discretize(STRIP, SHEET, scheme=scheme)

    def error(curvature: float) -> float:
        u = np.zeros_like(s.nodes)
        u[:, 2] = 0.5 * curvature * (s.nodes[:, :2] ** 2).sum(axis=1)
        angles = np.concatenate(s.dihedrals(u))
        turned = angles - s.body.sheet.rest_angles[: len(angles)]
        swelling = s.swollen(np.zeros((2, 3, 3)), np.full(2, curvature))
        assert (swelling.turns[: len(s.folds)] < 0.0).all()  # as at a valley
        assert not swelling.forces.tension.any()
        return float(np.abs(swelling.turns - turned).max() / np.abs(turned).max())

    coarse, fine = error(1e-2), error(1e-3)
    assert fine < 1e-5
    assert np.log10(coarse / fine) == pytest.approx(2.0, abs=0.05)


def test_bars_between_panels_take_the_mean() -> None:
    s = fd.discretize(STRIP, SHEET, bar_law="linear", membrane="bars", preset="plate")
    both = s.swollen(np.multiply.outer([1e-3, 3e-3], np.eye(3)), np.zeros(2))
    for ends, tension, area, length in zip(
        both.forces.bars.tolist(), both.forces.tension, s.bar_area, s.bar_length, strict=True
    ):
        panels = [p for p, t in zip(s.triangle_panel, s.triangles, strict=True) if {*ends} <= {*t}]
        strain = np.mean([1e-3 + 2e-3 * p for p in panels])
        stress = 0.5 * ((1.0 + strain) ** 2 - 1.0)  # Green strain, linear law
        assert tension == pytest.approx(-1e6 * area / length * stress, rel=1e-12)


def test_a_wing_over_the_middle_of_an_axis() -> None:
    """h = 3, s = 2, L = 4: (3 - 2 * 2 / 3) / 2."""
    corners = np.array([[[0, 0, 0], [4, 0, 0], [2, 0, 3.0]]])
    assert chord_turns(corners) == pytest.approx([(3.0 - 4.0 / 3.0) / 2.0])


def test_panels_of_triangles_in_any_order() -> None:
    triangles, panel = np.array([[0, 1, 2], [5, 2, 1], [3, 5, 2]]), np.array([4, 7, 9])
    wanted = np.array([[2, 3, 5], [1, 2, 0], [2, 1, 5], [5, 2, 3]])
    assert panel[place_of(triangles, wanted)].tolist() == [9, 4, 7, 9]
    assert place_of(triangles, wanted[:0]).tolist() == []
    with pytest.raises(KeyError):
        place_of(triangles, np.array([[0, 1, 5]]))
