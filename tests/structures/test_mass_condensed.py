"""The mass rule condensed: panels that follow their corners and center as thin plates do."""

from __future__ import annotations

import numpy as np
import pytest
from mass_samples import HEXAGON, PANELS, RHO, T, exact_second_moments, one, second_moments

import foldyn as fd


@pytest.mark.parametrize("name", sorted(PANELS))
@pytest.mark.parametrize("scheme", ["n5b8", "n4b5"])
def test_what_is_linear_over_a_panel_is_exact(name, scheme):
    """Translations, rotations and changes of shape: a plate follows them without bending."""
    s = one(PANELS[name], "condensed", scheme=scheme)
    exact = exact_second_moments(s)
    assert s.total_mass == pytest.approx(RHO * T * s.pattern.face_areas.sum(), rel=1e-9)
    np.testing.assert_allclose(second_moments(s), exact, atol=1e-8 * np.trace(exact))
    assert np.linalg.eigvalsh(s.mass.toarray()).min() > 0.0


@pytest.mark.parametrize("name", ["square", "rectangle"])
def test_twist(name):
    """A rectangle between corners at +w, -w in turn is w xi eta: m w^2/9."""
    twist = np.array([1.0, -1.0, 1.0, -1.0, 0.0])
    s = one(PANELS[name], "condensed")
    assert twist @ (s.mass @ twist) / s.total_mass == pytest.approx(1 / 9, rel=2e-4)


def test_bulge():
    """The center lifted off fixed corners: near the parabola of `bubble`, 22/45; a tent has 1/6."""
    lifted = {
        rule: one(PANELS["square"], rule).mass[4, 4] / (RHO * T)
        for rule in ("condensed", "bubble", "consistent")
    }
    assert lifted["bubble"] == pytest.approx(22 / 45)
    assert lifted["condensed"] == pytest.approx(22 / 45, rel=0.15)
    assert lifted["consistent"] == pytest.approx(1 / 6)


def test_a_hexagon_keeps_its_symmetry():
    mass = one(HEXAGON, "condensed").mass.toarray()
    rolled = np.r_[np.roll(np.arange(6), 1), 6]
    np.testing.assert_allclose(mass[np.ix_(rolled, rolled)], mass, rtol=1e-5)


def test_straight_creases_make_a_difference():
    """A panel between two creases follows its corners along straight edges."""
    strip = fd.Pattern([(0, 0), (1, 0), (2, 0), (3, 0), (0, 1), (1, 1), (2, 1), (3, 1)],
                       [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6)])  # fmt: skip
    sheet = fd.Sheet(1e6, 0.3, T, density=RHO)
    mass = fd.discretize(strip, sheet, mass="condensed").mass.toarray()
    centers = [8, 9, 10]
    own = mass[centers, centers] / (RHO * T)
    assert own[0] == pytest.approx(own[2], rel=1e-6)
    assert own[1] < own[0] * 0.99
