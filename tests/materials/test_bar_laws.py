"""Bar laws against their formulas in exact arithmetic (fractions)."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from foldyn.errors import InputError
from foldyn.materials import BAR_LAWS, BarLaw, Ogden, bar_law, hinge_law, ogden


def exact_ogden(e: float) -> tuple[float, float, float]:
    """W, S, dS/dE per unit modulus from the plain formulas in lambda, without rounding."""
    lam = 1 + Fraction(e)
    energy = ((lam**5 - 1) / 5 - (lam - 1)) / 4
    stress = (lam**3 - 1 / lam) / 4
    slope = (3 * lam**2 + 1 / lam**2) / 4 / lam  # dS/dlambda, E = (lambda^2 - 1) / 2
    return float(energy), float(stress), float(slope)


@pytest.mark.parametrize("size", [1e-14, 1e-11, 1e-8, 1e-5, 1e-3, 0.1, 0.5])
def test_ogden_does_not_cancel(size):
    for e in (size, -size):
        found = [of(e) for of in (ogden.energy, ogden.stress, ogden.slope)]
        assert found == pytest.approx(exact_ogden(e), rel=1e-15, abs=0)


@pytest.mark.parametrize("name", sorted(BAR_LAWS))
def test_bar_law_at_rest(name):
    law = bar_law(name)
    assert (law.energy(1.0), law.stress(1.0), law.slope(1.0), law.name) == (0.0, 0.0, 1.0, name)
    assert isinstance(law, BAR_LAWS[name]) and bar_law(law) is law


def test_shapes_follow_the_argument():
    law = Ogden()
    assert np.shape(law.stress(1.1)) == ()
    assert law.stress([1.0, 1.1]).shape == (2,)
    assert law.energy(np.ones((2, 3))).shape == (2, 3)
    transposed = np.arange(1.0, 2.0, 0.1)[:6].reshape(2, 3).T
    np.testing.assert_array_equal(law.energy(transposed), law.energy(transposed.copy()))


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
    e = np.concatenate([-np.geomspace(0.9, 1e-12, 60), np.geomspace(1e-12, 2.0, 60)])
    found = [ogden.stress_of_excess(x) for x in e * (2.0 + e)]
    np.testing.assert_allclose(found, [ogden.stress(v) for v in e], rtol=1e-14)
