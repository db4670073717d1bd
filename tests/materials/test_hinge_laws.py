"""Moment laws: published formulas, consistency of energy, moment and slope, behavior at rest."""

from __future__ import annotations

import math

import numpy as np
import pytest

from foldyn.errors import InputError
from foldyn.materials import HINGE_LAWS, EnhancedLinear, hinge_law

TWO_PI = 2 * math.pi
RESTS = np.radians([39.2, 60.0, 120.0, 180.0, 215.0, 300.0, 325.0])


def published(theta, rest, theta1, theta2):
    """Energy and moment per k as in section 5 of the design, angles in radians."""
    if theta < theta1:
        p = math.pi / theta1
        moment = (theta1 - rest) + math.tan(p * (theta - theta1) / 2) / (p / 2)
        energy = (rest - theta1) ** 2 / 2 + (rest - theta1) * (theta1 - theta)
        return energy - 4 / p**2 * math.log(math.cos(p * (theta1 - theta) / 2)), moment
    if theta > theta2:  # mirrored: angles counted from the other side
        energy, moment = published(TWO_PI - theta, TWO_PI - rest, TWO_PI - theta2, TWO_PI - theta1)
        return energy, -moment
    return (theta - rest) ** 2 / 2, theta - rest


@pytest.mark.parametrize("limits", [(45, 315), (75, 285), (20, 200), (100, 350)])
@pytest.mark.parametrize("rest", RESTS)
def test_enhanced_as_published(limits, rest):
    law, step = EnhancedLinear(*limits, rest="as_published"), 1e-9
    for theta in np.linspace(0.05, TWO_PI - 0.05, 41):
        energy, moment = published(theta, rest, *np.radians(limits))
        assert law.energy(theta, rest) == pytest.approx(energy, rel=1e-12, abs=1e-14)
        assert law.moment(theta, rest) == pytest.approx(moment, rel=1e-12, abs=1e-14)
    for limit in np.radians(limits):  # the slope is continuous there, and rises beyond
        below, above = law.slope(limit - step, rest), law.slope(limit + step, rest)
        assert [below, above] == pytest.approx([1.0, 1.0], abs=1e-8)


def test_published_constants_for_the_specimen():
    """Rest 39.2 degrees, theta1 = 75: at rest neither moment nor energy is zero.

    By hand: a = 35.8 degrees = 0.624828 rad below theta1, p = 2.4, p a/2 = 42.96 degrees:
    M = 0.624828 - tan(42.96 deg)/1.2; W = -0.624828^2/2 - ln cos(42.96 deg)/1.44.
    """
    law, rest = EnhancedLinear(75, 285, rest="as_published"), math.radians(39.2)
    assert law.moment(rest, rest) == pytest.approx(-0.1512, abs=1e-4)
    energy = -(0.624828**2) / 2 - math.log(math.cos(math.radians(42.96))) / 1.44
    assert law.energy(rest, rest) == pytest.approx(energy, rel=1e-5)


@pytest.mark.parametrize("limits", [(45, 315), (75, 285)])
@pytest.mark.parametrize("rest", RESTS)
def test_stress_free_subtracts_the_state_at_rest(limits, rest):
    free, plain = EnhancedLinear(*limits), EnhancedLinear(*limits, rest="as_published")
    assert free.moment(rest, rest) == free.energy(rest, rest) == 0.0
    theta = np.linspace(0.1, TWO_PI - 0.1, 31)
    moment0, found = plain.moment(rest, rest), free.moment(theta, rest)
    np.testing.assert_allclose(found, plain.moment(theta, rest) - moment0, rtol=1e-13, atol=1e-14)
    wanted = plain.energy(theta, rest) - plain.energy(rest, rest) - moment0 * (theta - rest)
    np.testing.assert_allclose(free.energy(theta, rest), wanted, rtol=1e-12, atol=1e-13)
    np.testing.assert_array_equal(free.slope(theta, rest), plain.slope(theta, rest))
    assert (free.energy(theta, rest) > -1e-15).all()  # rest is the minimum
    if math.radians(limits[0]) <= rest <= math.radians(limits[1]):
        np.testing.assert_array_equal(found, plain.moment(theta, rest))


@pytest.mark.parametrize("limits", [(45, 315), (63.20266358990684, 296.8), (75, 285), (5, 355)])
def test_enhanced_locks_near_closure(limits):
    """The moment goes to infinity as -(2/p)^2 / theta towards 0, mirrored towards 2 pi."""
    law = EnhancedLinear(*limits, rest="as_published")
    theta1, upper, rest = math.radians(limits[0]), math.radians(360 - limits[1]), 1.0
    for theta in (1e-3, 1e-6, 1e-9):
        # tan(pi/2 - x) = 1/x (1 + O(x^2)); theta itself is known to 4e-16 near 2 pi
        tolerance = max((math.pi / 2 * theta / min(theta1, upper)) ** 2, 1e-6)
        expected = theta1 - rest - (2 * theta1 / math.pi) ** 2 / theta
        assert law.moment(theta, rest) == pytest.approx(expected, rel=tolerance)
        expected = math.radians(limits[1]) - rest + (2 * upper / math.pi) ** 2 / theta
        assert law.moment(TWO_PI - theta, rest) == pytest.approx(expected, rel=tolerance)


def test_enhanced_never_turns_its_sign_at_closure():
    """At exactly 0 and 2 pi rounding must not carry the tangent over its pole."""
    for theta1 in np.linspace(5.0, 170.0, 331):
        law = EnhancedLinear(theta1, 360.0 - theta1)
        energy, moment = (of([0.0, TWO_PI], 1.2) for of in (law.energy, law.moment))
        assert np.isfinite(energy).all() and (energy > 0).all()
        assert moment[0] < -1e10 and moment[1] > 1e10


@pytest.mark.parametrize("name", sorted(set(HINGE_LAWS) - {"prony", "plastic", "eyring"}))
def test_every_law_is_free_and_stable_at_rest(name):
    law = hinge_law(name)
    np.testing.assert_array_equal(law.moment(RESTS, RESTS), 0.0)
    np.testing.assert_array_equal(law.energy(RESTS, RESTS), 0.0)
    for rest in RESTS:
        theta = np.linspace(0.05, TWO_PI - 0.05, 101)
        moment = law.moment(theta, rest)
        assert (np.diff(moment) > 0).all()
        assert (np.sign(moment) == np.sign(theta - rest)).all()
        assert (law.slope(theta, rest) >= 0).all()


@pytest.mark.parametrize(
    ("name", "values"),
    [("theta1", (0, -5, math.nan, "45", True)), ("theta2", (360, None)), ("rest", ("free", None))],
)
def test_wrong_enhanced_arguments(name, values):
    for value in values:
        with pytest.raises(InputError, match="EnhancedLinear"):
            EnhancedLinear(**{name: value})
    with pytest.raises(InputError, match="EnhancedLinear"):
        EnhancedLinear(theta1=200, theta2=100)


def test_broadcasting():
    law, theta = EnhancedLinear(), np.linspace(0.2, 6, 5)
    table = law.moment(theta[:, None], RESTS[None, :])
    np.testing.assert_array_equal(table, [[law.moment(t, r) for r in RESTS] for t in theta])
    assert np.shape(law.energy(1.0, 2.0)) == ()


def test_superlinear_moment_over_all_magnitudes():
    """|d|^(4/3) without branches: 4 ulp from 1e-100 to pi, zero at zero, odd, NaN stays NaN."""
    d = np.concatenate([[0.0], np.geomspace(1e-100, np.pi, 4001)])
    law = hinge_law("superlinear")
    found = law.moment(d, 0.0)
    exact = np.abs(d.astype(np.longdouble)) ** (np.longdouble(4) / 3)
    assert found[0] == 0.0
    assert float(np.abs(found[1:] / exact[1:] - 1).max()) < 4 * np.finfo(float).eps
    np.testing.assert_array_equal(law.moment(-d, 0.0), -found)
    assert np.isnan(law.moment(np.nan, 0.0))
