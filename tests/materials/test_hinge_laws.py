"""Moment laws: published formulas, consistency of energy, moment and slope, behavior at rest."""

from __future__ import annotations

import math

import numpy as np
import pytest

from foldyn.errors import InputError
from foldyn.materials import HINGE_LAWS, EnhancedLinear, LinearHinge, Superlinear, hinge_law

TWO_PI = 2 * math.pi
LAWS = [
    LinearHinge(),
    Superlinear(),
    EnhancedLinear(),
    EnhancedLinear(45, 315, "as_published"),
    EnhancedLinear(75, 285, "stress_free"),
    EnhancedLinear(75, 285, "as_published"),
    EnhancedLinear(100, 200, "stress_free"),
]
RESTS = np.radians([39.2, 60.0, 120.0, 180.0, 215.0, 300.0, 325.0])


def name_of(law):
    return "-".join(
        str(v) for v in (law.name, *(getattr(law, k, "") for k in ("theta1", "theta2", "rest")))
    )


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
    law = EnhancedLinear(*limits, rest="as_published")
    for theta in np.linspace(0.05, TWO_PI - 0.05, 41):
        energy, moment = published(theta, rest, *np.radians(limits))
        assert law.energy(theta, rest) == pytest.approx(energy, rel=1e-12, abs=1e-14)
        assert law.moment(theta, rest) == pytest.approx(moment, rel=1e-12, abs=1e-14)


def test_published_constants_for_the_specimen():
    """Rest 39.2 degrees, theta1 = 75: at rest neither moment nor energy is zero.

    By hand: a = 35.8 degrees = 0.624828 rad below theta1, p = 2.4, p a/2 = 42.96 degrees:
    M = 0.624828 - tan(42.96 deg)/1.2; W = -0.624828^2/2 - ln cos(42.96 deg)/1.44.
    """
    law = EnhancedLinear(75, 285, rest="as_published")
    rest = math.radians(39.2)
    a = math.radians(35.8)
    moment = a - math.tan(math.radians(42.96)) / 1.2
    energy = -a * a / 2 - math.log(math.cos(math.radians(42.96))) / 1.44
    assert moment == pytest.approx(-0.1512, abs=1e-4)
    assert law.moment(rest, rest) == pytest.approx(moment, rel=1e-12)
    assert law.energy(rest, rest) == pytest.approx(energy, rel=1e-12)


@pytest.mark.parametrize("limits", [(45, 315), (75, 285)])
@pytest.mark.parametrize("rest", RESTS)
def test_stress_free_subtracts_the_state_at_rest(limits, rest):
    free, plain = EnhancedLinear(*limits), EnhancedLinear(*limits, rest="as_published")
    assert free.moment(rest, rest) == 0.0
    assert free.energy(rest, rest) == 0.0
    theta = np.linspace(0.1, TWO_PI - 0.1, 31)
    moment0, energy0 = plain.moment(rest, rest), plain.energy(rest, rest)
    np.testing.assert_allclose(
        free.moment(theta, rest), plain.moment(theta, rest) - moment0, rtol=1e-13, atol=1e-14
    )
    np.testing.assert_allclose(
        free.energy(theta, rest),
        plain.energy(theta, rest) - energy0 - moment0 * (theta - rest),
        rtol=1e-12,
        atol=1e-13,
    )
    np.testing.assert_array_equal(free.slope(theta, rest), plain.slope(theta, rest))
    assert (free.energy(theta, rest) > -1e-15).all()  # rest is the minimum
    if math.radians(limits[0]) <= rest <= math.radians(limits[1]):
        np.testing.assert_array_equal(free.moment(theta, rest), plain.moment(theta, rest))


@pytest.mark.parametrize("law", LAWS, ids=name_of)
@pytest.mark.parametrize("rest", RESTS)
def test_moment_is_derivative_of_energy_and_slope_of_moment(law, rest):
    """Central differences with the expected order, away from where the law is not smooth."""
    theta = np.linspace(0.5, TWO_PI - 0.5, 57)
    kinks = [rest] if isinstance(law, Superlinear) else []
    if isinstance(law, EnhancedLinear):
        kinks = np.radians([law.theta1, law.theta2])
    for kink in kinks:
        theta = theta[np.abs(theta - kink) > 0.1]

    def errors(h):
        moment = (law.energy(theta + h, rest) - law.energy(theta - h, rest)) / (2 * h)
        slope = (law.moment(theta + h, rest) - law.moment(theta - h, rest)) / (2 * h)
        return np.array(
            [
                np.abs(moment - law.moment(theta, rest)).max(),
                np.abs(slope - law.slope(theta, rest)).max(),
            ]
        )

    coarse, fine = errors(8e-3), errors(4e-3)
    if isinstance(law, LinearHinge):
        assert coarse.max() < 1e-11
        return
    np.testing.assert_allclose(np.log2(coarse / fine), 2.0, atol=0.1)


@pytest.mark.parametrize("rest", RESTS)
def test_enhanced_is_smooth_at_the_limits(rest):
    """Energy, moment and slope are continuous at theta1 and theta2."""
    law = EnhancedLinear(70, 290)
    for limit in np.radians([70.0, 290.0]):
        for f in (law.energy, law.moment, law.slope):
            assert f(limit - 1e-9, rest) == pytest.approx(float(f(limit + 1e-9, rest)), abs=1e-8)
    inside = np.radians([70.0, 100.0, 290.0])
    np.testing.assert_allclose(law.slope(inside, rest), 1.0, rtol=1e-15)
    assert law.slope(math.radians(60), rest) > 1.0
    assert law.slope(math.radians(300), rest) > 1.0


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
        energy = law.energy([0.0, TWO_PI], 1.2)
        moment = law.moment([0.0, TWO_PI], 1.2)
        assert np.isfinite(energy).all()
        assert (energy > 0).all()
        assert moment[0] < -1e10
        assert moment[1] > 1e10


def test_superlinear_values():
    law = Superlinear()
    d = np.array([-1.0, -0.125, 0.0, 0.008, 1.0])
    np.testing.assert_allclose(
        law.moment(1.5 + d, 1.5), [-1, -0.0625, 0, 0.0016, 1], rtol=1e-12, atol=0
    )
    np.testing.assert_allclose(law.slope(1.5 + d, 1.5), 4 / 3 * np.cbrt(abs(d)), rtol=1e-12, atol=0)
    np.testing.assert_allclose(
        law.energy(1.5 + d, 1.5), 3 / 7 * np.abs(d) ** (7 / 3), rtol=1e-12, atol=0
    )


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
    "arguments",
    [
        {"theta1": 0},
        {"theta1": -5},
        {"theta2": 360},
        {"theta1": 200, "theta2": 100},
        {"theta1": math.nan},
        {"theta1": "45"},
        {"theta2": None},
        {"theta1": True},
        {"rest": "free"},
        {"rest": None},
    ],
)
def test_wrong_enhanced_arguments(arguments):
    with pytest.raises(InputError, match="EnhancedLinear"):
        EnhancedLinear(**arguments)


def test_broadcasting():
    law = EnhancedLinear()
    theta, rest = np.linspace(0.2, 6, 5)[:, None], RESTS[None, :]
    table = law.moment(theta, rest)
    assert table.shape == (5, len(RESTS))
    for i in range(5):
        for j, r in enumerate(RESTS):
            assert table[i, j] == law.moment(theta[i, 0], r)
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
