"""Laminates: curvature and stiffness of bonded layers."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError


@pytest.mark.parametrize(("m", "n"), [(1.0, 1.0), (0.2, 3.0), (4.0, 0.1)])
def test_two_layers_curl_as_timoshenko_says(m: float, n: float) -> None:
    """Timoshenko, J. Opt. Soc. Am. 11, 1925, equation 4: m = t1/t2, n = E1/E2, h = t1 + t2."""
    t2, e2, a1, a2 = 1e-3, 2e9, 3e-6, 17e-6
    h = t2 * (1.0 + m)
    expected = 6.0 * (a2 - a1) * (1.0 + m) ** 2
    expected /= h * (3.0 * (1.0 + m) ** 2 + (1.0 + m * n) * (m**2 + 1.0 / (m * n)))
    bimetal = fd.Laminate([(m * t2, n * e2, a1), (t2, e2, a2)])
    # the layer in front grows more: the sheet bends away from its front
    assert bimetal.curvature == pytest.approx(-expected, rel=1e-12)
    assert fd.Laminate(bimetal.layers[::-1]).curvature == pytest.approx(expected, rel=1e-12)


def test_layers_of_one_material_are_that_material() -> None:
    layers = [(t, 3e9, 2e-5) for t in (1e-3, 2e-3, 0.5e-3)]
    one = fd.Laminate(layers)
    assert one.expansion == pytest.approx(2e-5, rel=1e-14)
    assert abs(one.curvature) < 1e-16
    sheet = one.sheet(0.3, areal_density=7.0, length_scale_ratio=2.0)
    assert sheet.thickness == pytest.approx(3.5e-3, rel=1e-12)
    assert sheet.youngs_modulus == pytest.approx(3e9, rel=1e-12)
    assert sheet.density == pytest.approx(2000.0, rel=1e-12)
    assert (sheet.poissons_ratio, sheet.length_scale_ratio) == (0.3, 2.0)


def test_sheet_has_the_stiffness_of_a_sandwich() -> None:
    """Faces of t at the distance d/2 from the middle: E t^3 / 6 + E t d^2 / 2 for both."""
    t, core, e = 1e-3, 8e-3, 70e9
    sandwich = fd.Laminate([(t, e, 0.0), (core, 1e3, 0.0), (t, e, 0.0)])
    sheet = sandwich.sheet(0.0)
    expected = e * t**3 / 6.0 + e * t * (core + t) ** 2 / 2.0
    assert sheet.bending_modulus == pytest.approx(expected, rel=1e-6)
    assert sheet.youngs_modulus * sheet.thickness == pytest.approx(2.0 * e * t, rel=1e-6)


def test_a_moment_free_sheet_has_no_force_in_it() -> None:
    """The resultants of E (strain - free strain) over the thickness vanish, by quadrature."""
    layers = [(2e-3, 1e9, 5e-5), (1e-3, 4e9, 1e-5), (3e-3, 0.5e9, 9e-5)]
    laminate = fd.Laminate(layers)
    t, e, a = np.array(layers).T
    neutral = (e * t) @ (np.cumsum(t) - 0.5 * t) / (e * t).sum()
    z = (np.arange(60_000) + 0.5) * t.sum() / 60_000
    layer = np.searchsorted(np.cumsum(t), z)
    stress = e[layer] * (laminate.expansion - laminate.curvature * (z - neutral) - a[layer])
    assert abs(stress.sum()) < 1e-6 * np.abs(stress).sum()
    assert abs(stress @ z) < 1e-6 * np.abs(stress * z).sum()


@pytest.mark.parametrize(
    ("layers", "message"),
    [
        ([], r"layers = \[\]: give a row \[thickness"),
        (3.0, r"layers = 3.0: give a row"),
        ([(1e-3, 1e9)], r"layers\[0\] = .*: must be \[thickness"),
        ([(1e-3, 1e9, 0.0), (-1e-3, 1e9, 0.0)], r"layers\[1\]\[0\]"),
        ([(1e-3, 0.0, 0.0)], r"layers\[0\]\[1\]"),
        ([(1e-3, 1e9, "hot")], r"layers\[0\]\[2\]"),
    ],
)
def test_wrong_layers_are_named(layers, message) -> None:
    with pytest.raises(InputError, match=message):
        fd.Laminate(layers)
