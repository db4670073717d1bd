"""Circle fits: exact for known poles, scattered as little as noise allows."""

from __future__ import annotations

import numpy as np
import pytest
from known_poles import SPECIMEN, Mode, cramer_rao, receptance

from foldyn.errors import ComputationError, InputError
from foldyn.signals import circle_fit, circle_fits, convert_response

BANDS = [(2.5, 5.0), (7.0, 12.0), (14.0, 20.0)]


# reach: half-widths of the band in half-power widths / 2
@pytest.mark.parametrize("reach", [0.5, 2.0, 6.0])
@pytest.mark.parametrize("z", [0.001, 0.02, 0.135, 0.5])
def test_one_mode_is_exact(z, reach):
    mode = Mode(9.3, z, 2.5)
    f = np.linspace(9.3 * max(0.05, 1 - reach * z), 9.3 * (1 + reach * z), 41)
    fit = circle_fit(f, receptance(f, mode))
    assert fit.natural_frequency == pytest.approx(9.3, rel=1e-10)
    assert fit.damping_ratio == pytest.approx(z, rel=1e-9)
    assert fit.modal_constant == pytest.approx(2.5, rel=1e-8)
    assert fit.radius == pytest.approx(2.5 / (4 * z * 2 * np.pi * 9.3), rel=1e-9)
    assert abs(fit.residual) < 1e-8 * fit.radius
    assert fit.misfit < 1e-10
    assert fit.points == 41


def test_all_quantities_tell_the_same():
    f = np.linspace(7.0, 12.0, 30)
    H = receptance(f, Mode(9.3, 0.135, 2.0))
    for quantity in ("receptance", "mobility", "accelerance"):
        response = convert_response(f, H, source="receptance", target=quantity)
        fit = circle_fit(f, response, quantity=quantity)
        assert fit.damping_ratio == pytest.approx(0.135, rel=1e-11)
        assert fit.modal_constant == pytest.approx(2.0, rel=1e-10)


def test_a_constant_residual_and_a_complex_mode_cost_nothing():
    f = np.linspace(7.0, 12.0, 30)
    mobility = 2j * np.pi * f * receptance(f, Mode(9.3, 0.135, 1.0)) * (2.0 + 0.5j)
    fit = circle_fit(f, mobility + (0.01 - 0.03j), quantity="mobility")
    assert fit.natural_frequency == pytest.approx(9.3, rel=1e-11)
    assert fit.damping_ratio == pytest.approx(0.135, rel=1e-11)
    assert fit.modal_constant == pytest.approx(2.0 + 0.5j, rel=1e-10)
    assert fit.residual == pytest.approx(0.01 - 0.03j, rel=1e-9)
    # the circle begins and ends at the residual, opposite the resonance
    assert abs(fit.residual - fit.center) == pytest.approx(fit.radius, rel=1e-12)
    np.testing.assert_allclose(fit.mobility(f) + fit.residual, mobility + (0.01 - 0.03j), rtol=1e-9)
    np.testing.assert_allclose(np.abs(mobility + 0.01 - 0.03j - fit.center), fit.radius, rtol=1e-9)


def hold(fits, modes, frequency, damping):
    for fit, mode in zip(fits, modes, strict=True):
        assert fit.natural_frequency == pytest.approx(mode.frequency, rel=frequency)
        assert fit.damping_ratio == pytest.approx(mode.damping, rel=damping)


def test_known_poles_of_several_modes():
    """The specimen's three modes with damping of 5, 13.5 and 9 %: to 1e-6 and far better."""
    f = np.linspace(0.0, 30.0, 601)
    H = receptance(f, *SPECIMEN)
    fits = circle_fits(f, H, bands=BANDS)
    hold(fits, SPECIMEN, 1e-10, 1e-9)
    assert [fit.modal_constant for fit in fits] == pytest.approx([1.0, 2.0, -1.5], rel=1e-9)
    # one at a time, the neighbors' slope within the band is an error that the misfit shows
    alone = circle_fit(f, H, band=BANDS[1])
    assert 1e-4 < abs(alone.damping_ratio / 0.135 - 1) < 0.1
    assert alone.misfit > 1e-3
    # a mode out of the bands is a residual, and the constant is not all of it
    f = np.linspace(0.5, 14.0, 400)
    fits = circle_fits(f, receptance(f, *SPECIMEN), bands=BANDS[:2])
    hold(fits, SPECIMEN[:2], 1e-2, 0.1)
    assert fits[1].misfit > 1e-3


def test_modes_as_close_as_their_width():
    pair = (Mode(9.3, 0.05), Mode(9.3 * (1 + 2 * 0.05), 0.05))
    f = np.linspace(3.0, 20.0, 600)
    hold(circle_fits(f, receptance(f, *pair), bands=[(8.6, 9.75), (9.8, 10.9)]), pair, 1e-8, 1e-7)


@pytest.mark.matrix
def test_scatter_over_seeds_is_stated_and_the_least_possible():
    """Noise of 2 % of the circle's diameter, 200 seeds, band of twice the half-power width.

    Bounds: no bias beyond a quarter of a deviation; the deviation is the Cramer-Rao bound and the
    mean of the stated standard errors, within 15 %.
    """
    rng = np.random.default_rng(12)
    f = np.linspace(9.3 * (1 - 2 * 0.135), 9.3 * (1 + 2 * 0.135), 50)
    mobility = 2j * np.pi * f * receptance(f, Mode(9.3, 0.135, 2.0))
    diameter = 2.0 / (2 * 0.135 * 2 * np.pi * 9.3)
    noise = 0.02 * diameter
    found, stated = [], []
    for _ in range(200):
        points = mobility + noise * (rng.normal(size=50) + 1j * rng.normal(size=50))
        fit = circle_fit(f, points, quantity="mobility")
        found.append((fit.natural_frequency, fit.damping_ratio))
        stated.append((fit.frequency_error, fit.damping_error))

    def model(p):
        x = (f / p[0] - p[0] / f) / (2 * p[1])
        Y = (p[2] + 1j * p[3]) / (1 + 1j * x) + p[4] + 1j * p[5]
        return np.concatenate([Y.real, Y.imag])

    bound = cramer_rao(model, np.array([9.3, 0.135, diameter, 0.0, 0.0, 0.0]), noise)[:2]
    scatter = np.std(found, axis=0)
    np.testing.assert_allclose(scatter, bound, rtol=0.15)
    np.testing.assert_allclose(np.mean(stated, axis=0), scatter, rtol=0.15)
    assert (np.abs(np.mean(found, axis=0) - [9.3, 0.135]) < 0.25 * scatter).all()
    assert bound[1] / 0.135 == pytest.approx(0.0117, rel=0.1)  # 1.2 % of the damping ratio


@pytest.mark.matrix
def test_mere_noise_is_refused():
    rng = np.random.default_rng(13)
    f = np.linspace(5.0, 15.0, 40)
    for _ in range(50):
        with pytest.raises(ComputationError, match="circle fit: "):
            circle_fit(f, rng.normal(size=40) + 1j * rng.normal(size=40))


F = np.linspace(0.0, 20.0, 81)
H = receptance(F, Mode(9.3, 0.1))
HOLE = np.where(F == 9.0, np.nan, H)
WIDE, FAR = np.linspace(3.0, 20.0, 600), np.linspace(20.0, 30.0, 50)
PAIR = receptance(WIDE, Mode(9.3, 0.1), Mode(9.765, 0.1))  # too close for their bands


@pytest.mark.parametrize(
    ("function", "arguments", "words"),
    [
        (circle_fit, (F, np.abs(H)), "response: real"),
        (circle_fit, (F, H[:-1]), "response: shape"),
        (circle_fit, (F[::-1], H), "must increase"),
        (circle_fit, (F, H, {"band": (9.0, 9.5)}), "band: 3 points between 9 and 9.5 Hz"),
        (
            circle_fit,
            (F, H, {"band": (9.0, 12.0), "quantity": "velocity"}),
            'quantity = "velocity"',
        ),
        (circle_fit, (F, HOLE, {"band": (7.0, 12.0)}), "first at 9 Hz"),
        (
            circle_fit,
            (F, np.ones(81) + 0j, {"band": (7.0, 12.0), "quantity": "mobility"}),
            "constant in the band",
        ),
        (circle_fits, (F, H, {"bands": []}), "bands: empty"),
        (circle_fit, (FAR, receptance(FAR, Mode(9.3, 0.05))), "no resonance found between 20 and"),
        (
            circle_fits,
            (WIDE, PAIR, {"bands": [(7.9, 9.5), (9.5, 11.2)]}),
            "still change after 200 sweeps",
        ),
    ],
)
def test_what_cannot_be_fitted(function, arguments, words):
    error = ComputationError if words.startswith(("no res", "still")) else InputError
    first, second, *named = arguments
    with pytest.raises(error, match=words):
        function(first, second, **(named[0] if named else {}))


def test_holes_outside_the_band_do_not_matter():
    assert circle_fit(F, HOLE, band=(9.1, 12.0)).damping_ratio == pytest.approx(0.1, rel=1e-9)
