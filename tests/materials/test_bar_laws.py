"""Bar laws against their formulas in exact arithmetic (fractions)."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from foldyn.errors import InputError
from foldyn.materials import BAR_LAWS, HINGE_LAWS, BarLaw, LinearBar, Ogden, bar_law, hinge_law
from foldyn.materials import ogden as ogden_module

STRETCHES = np.linspace(0.3, 2.5, 23)


def exact_ogden(e: float) -> tuple[float, float, float]:
    """W, S, dS/dE per unit modulus from the plain formulas in lambda, without rounding."""
    lam = 1 + Fraction(e)
    energy = ((lam**5 - 1) / 5 - (lam - 1)) / 4
    stress = (lam**3 - 1 / lam) / 4
    slope = (3 * lam**2 + 1 / lam**2) / 4 / lam  # dS/dlambda, E = (lambda^2 - 1) / 2
    return float(energy), float(stress), float(slope)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("size", [1e-14, 1e-11, 1e-8, 1e-5, 1e-3, 0.1, 0.5])
def test_ogden_does_not_cancel(size, sign):
    e = sign * size
    energy, stress, slope = exact_ogden(e)
    assert ogden_module.energy(e) == pytest.approx(energy, rel=1e-15, abs=0)
    assert ogden_module.stress(e) == pytest.approx(stress, rel=1e-15, abs=0)
    assert ogden_module.slope(e) == pytest.approx(slope, rel=1e-15, abs=0)


def test_ogden_python_level_values():
    law = Ogden()
    for lam in STRETCHES:
        energy, stress, slope = exact_ogden(lam - 1.0)
        assert law.energy(lam) == pytest.approx(energy, rel=1e-14)
        assert law.stress(lam) == pytest.approx(stress, rel=1e-14)
        assert law.slope(lam) == pytest.approx(slope, rel=1e-14)


def test_linear_bar_is_linear_in_green_strain():
    law = LinearBar()
    green = (STRETCHES**2 - 1) / 2
    np.testing.assert_allclose(law.stress(STRETCHES), green, rtol=1e-14, atol=1e-16)
    np.testing.assert_allclose(law.energy(STRETCHES), green**2 / 2, rtol=1e-13, atol=1e-16)
    np.testing.assert_array_equal(law.slope(STRETCHES), 1.0)


@pytest.mark.parametrize("name", sorted(BAR_LAWS))
def test_stress_is_derivative_of_energy_and_slope_of_stress(name):
    """Central differences in the Green strain, whose error falls with the square of the step."""
    law = bar_law(name)
    green = (STRETCHES**2 - 1) / 2

    def errors(h):
        up, down = np.sqrt(1 + 2 * (green + h)), np.sqrt(1 + 2 * (green - h))
        stress = (law.energy(up) - law.energy(down)) / (2 * h)
        slope = (law.stress(up) - law.stress(down)) / (2 * h)
        return np.array(
            [
                np.abs(stress - law.stress(STRETCHES)).max(),
                np.abs(slope - law.slope(STRETCHES)).max(),
            ]
        )

    coarse, fine = errors(4e-3), errors(2e-3)
    if name == "linear":  # quadratic energy: no error but rounding
        assert coarse.max() < 1e-12
        return
    np.testing.assert_allclose(np.log2(coarse / fine), 2.0, atol=0.05)
    assert fine.max() < 2e-2


@pytest.mark.parametrize("name", sorted(BAR_LAWS))
def test_bar_law_at_rest(name):
    law = bar_law(name)
    assert law.energy(1.0) == 0.0
    assert law.stress(1.0) == 0.0
    assert law.slope(1.0) == 1.0
    assert law.name == name


def test_shapes_follow_the_argument():
    law = Ogden()
    assert np.shape(law.stress(1.1)) == ()
    assert law.stress([1.0, 1.1]).shape == (2,)
    assert law.energy(np.ones((2, 3))).shape == (2, 3)
    transposed = np.arange(1.0, 2.0, 0.1)[:6].reshape(2, 3).T
    np.testing.assert_array_equal(law.energy(transposed), law.energy(transposed.copy()))


def test_registries():
    assert set(BAR_LAWS) == {"ogden", "linear"}
    elastic = {"linear", "superlinear", "enhanced", "plate_superlinear"}
    assert set(HINGE_LAWS) == elastic | {"prony", "plastic", "eyring"}
    for name, kind in BAR_LAWS.items():
        assert isinstance(bar_law(name), kind)
    for name in elastic:
        assert isinstance(hinge_law(name), HINGE_LAWS[name])
        assert hinge_law(name).name == name
    law = Ogden()
    assert bar_law(law) is law


@pytest.mark.parametrize("spec", ["Ogden", "", None, 3, ["ogden"], Ogden, hinge_law("linear")])
def test_wrong_bar_law(spec):
    with pytest.raises(InputError, match=r"bar_law.*ogden, linear"):
        bar_law(spec)


@pytest.mark.parametrize("spec", ["ogden", "Linear", None, 3, {"kind": "linear"}, BarLaw])
def test_wrong_hinge_law_names_the_field(spec):
    with pytest.raises(InputError, match=r"fold_law.*superlinear"):
        hinge_law(spec, "fold_law")


def test_ogden_in_terms_of_the_excess_is_the_same_law():
    """The kernels' form, of x = lambda^2 - 1, gives the stress of lambda - 1."""
    from foldyn.materials import ogden

    e = np.concatenate([-np.geomspace(0.9, 1e-12, 60), np.geomspace(1e-12, 2.0, 60)])
    found = [ogden.stress_of_excess(x) for x in e * (2.0 + e)]
    np.testing.assert_allclose(found, [ogden.stress(v) for v in e], rtol=1e-14)
