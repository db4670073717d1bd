"""Shock response spectra beside closed forms and simulated oscillators."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from foldyn.errors import InputError
from foldyn.signals import shock_spectrum

LENGTH, DT = 0.011, 2e-6
TIME = np.arange(round(LENGTH / DT) + 1) * DT


@pytest.mark.parametrize("ratio", [0.2, 0.7, 1.6, 3.1, 8.3])
def test_a_half_sine_without_damping(ratio):
    """Its response in closed form, for natural frequencies over that of the sine."""
    forced, natural = np.pi / LENGTH, ratio * np.pi / LENGTH
    pulse = np.sin(forced * TIME)
    moved = (np.sin(forced * TIME) - np.sin(natural * TIME) / ratio) / (1.0 - ratio**-2)
    left = 2.0 / ratio / abs(1.0 - ratio**-2) * abs(np.cos(0.5 * np.pi * ratio))
    found = shock_spectrum(pulse, DT, frequency=[natural / (2.0 * np.pi)], damping_ratio=0.0)
    assert found.residual[0] == pytest.approx(left, rel=1e-3, abs=1e-3)
    assert found.maximax[0] == pytest.approx(max(np.abs(moved).max(), left), rel=1e-3)


def test_a_rough_record_with_damping():
    """Straight lines between samples that are few for the frequency are followed exactly."""
    record, dt, f, zeta = np.random.default_rng(1).standard_normal(12), 0.01, 60.0, 0.1
    w, end = 2.0 * np.pi * f, 11 * dt

    def rate(t, state):
        base = np.interp(t, np.arange(12) * dt, record) if t <= end else 0.0
        return state[1], -2.0 * zeta * w * state[1] - w**2 * state[0] - base

    # the filter lets the base come from zero in a step, as short as its own
    h = dt / np.ceil(100 * f * dt)
    at = np.arange(0.0, end, 0.05 * h)
    start = [0.0, -0.5 * h * record[0]]
    moved = solve_ivp(rate, (0.0, end), start, t_eval=at, max_step=h, rtol=1e-10, atol=1e-12).y
    absolute = -2.0 * zeta * w * moved[1] - w**2 * moved[0]
    found = shock_spectrum(record, dt, frequency=f, damping_ratio=zeta)
    assert found.positive[0] == pytest.approx(absolute.max(), rel=2e-3)
    assert found.negative[0] == pytest.approx(-absolute.min(), rel=2e-3)


def test_a_stiff_oscillator_follows_the_base_and_a_soft_one_hardly_moves():
    pulse = np.sin(np.pi * TIME / LENGTH)
    found = shock_spectrum(pulse, DT, frequency=[0.5, 2e4])
    impulse = 2.0 * LENGTH / np.pi * 2.0 * np.pi * 0.5  # velocity change times angular frequency
    assert found.maximax == pytest.approx([impulse, 1.0], rel=0.08)
    assert found.residual[1] < 0.05


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"acceleration": [1.0, np.nan]}, "acceleration"),
        ({"dt": 0.0}, "dt"),
        ({"frequency": [0.0, 1.0]}, "frequency: give a list"),
        ({"damping_ratio": 1.0}, "damping_ratio = 1: must be below 1"),
        ({"damping_ratio": -0.1}, "damping_ratio"),
    ],
)
def test_refused(change, told):
    given = {"acceleration": [0.0, 1.0, 0.0], "dt": 0.01, "frequency": [10.0], **change}
    with pytest.raises(InputError, match=told):
        shock_spectrum(given.pop("acceleration"), given.pop("dt"), **given)
