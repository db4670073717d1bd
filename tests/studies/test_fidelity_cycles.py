"""Periods of vibrations whose periods are known: pendulum, Duffing's oscillator, sums of tones."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

from verification.fidelity.cycles import NoCyclesError, cycles, demodulated, fundamental

DT = 0.01


def pendulum(amplitude, duration=8.0, dt=DT):
    """A pendulum of small period 1 s let go at an angle: its motion and period, in closed form."""
    k = np.sin(amplitude / 2.0) ** 2
    sn, *_ = ellipj(ellipk(k) - 2.0 * np.pi * np.arange(0.0, duration, dt), k)
    return 2.0 * np.arcsin(np.sqrt(k) * sn), 2.0 * ellipk(k) / np.pi


def duffing(amplitude, duration=8.0, dt=DT):
    """x'' + w^2 (x + x^3) = 0, w = 2 pi, let go at an amplitude: x = A cn(W t, m)."""
    fast = 2.0 * np.pi * np.sqrt(1.0 + amplitude**2)
    m = amplitude**2 / (2.0 * (1.0 + amplitude**2))
    _, cn, *_ = ellipj(fast * np.arange(0.0, duration, dt), m)
    return amplitude * cn, 4.0 * ellipk(m) / fast


@pytest.mark.parametrize("released", [True, False])
@pytest.mark.parametrize("amplitude", [0.1, 1.0, 2.5])
@pytest.mark.parametrize("motion", [pendulum, duffing])
def test_a_periodic_motion_has_its_period_in_every_cycle(motion, amplitude, released):
    """Whatever its harmonics and its mean."""
    x, period = motion(amplitude)
    found = cycles(x + 3.0, DT, 0.3, 4.0, released)
    assert len(found.period) >= 8.0 / period - 3.0
    np.testing.assert_allclose(found.period, period, rtol=1e-9)
    assert 0.99 < found.share <= 1.0


def test_a_released_motion_starts_a_cycle():
    """Its extremes are every half period from t = 0 on."""
    x, period = pendulum(2.0)
    found = cycles(x, DT, 0.3, 2.0, released=True)
    np.testing.assert_allclose(found.extreme, period / 2 * np.arange(len(found.extreme)), atol=1e-9)
    lifted = np.interp(found.extreme, DT * np.arange(len(x)), x)
    np.testing.assert_allclose(lifted, 2.0 * (-1.0) ** np.arange(len(lifted)), atol=1e-3)


def test_cycles_of_a_sweep():
    """Its phase is known: extremes are in place to 0.5 % of half a period, with any step."""
    extremes = []
    for dt in (0.04, 0.01):
        t = np.arange(0.0, 12.0, dt)
        found = cycles(np.cos(2.0 * np.pi * (t + 0.03 * t**2)), dt, 0.5, 2.0).extreme
        halves = 2.0 * (found + 0.03 * found**2)
        np.testing.assert_allclose(halves, np.round(halves), atol=5e-3)
        extremes.append(found)
    np.testing.assert_allclose(*extremes, atol=1e-4)


def test_other_tones_do_not_move_the_mean_period():
    """Half as much at 2.7 times the frequency, a third at 9 times: 0.1 % in every cycle."""
    t = np.arange(0.0, 12.0, DT)
    x = 5.0 + np.cos(2 * np.pi * t) + 0.5 * np.cos(2 * np.pi * 2.7 * t)
    found = cycles(x + 0.3 * np.cos(2 * np.pi * 9 * t), DT, 0.3, 3.0, released=True)
    np.testing.assert_allclose(found.period, 1.0, rtol=1.2e-3)
    assert found.period.mean() == pytest.approx(1.0, rel=2e-4)
    assert found.share == pytest.approx(1.0 / 1.34, abs=0.01)


def test_the_highest_peak_in_a_band():
    t = np.arange(0.0, 12.0, DT)
    x = np.cos(2.0 * np.pi * t) + 2.0 * np.cos(2.0 * np.pi * 3.0 * t)
    assert fundamental(x, DT, 0.3, 5.0) == pytest.approx(3.0, rel=1e-2)
    assert fundamental(x, DT, 0.3, 2.0) == pytest.approx(1.0, rel=1e-2)


def test_a_tone_is_demodulated_whole():
    t = np.arange(0.0, 8.0, DT)
    tone, mean = demodulated(2.0 + 3.0 * np.cos(2.0 * np.pi * t + 0.4), DT, 1.0)
    inside = t[100:-100]
    np.testing.assert_allclose(tone, 3.0 * np.exp(1j * (2.0 * np.pi * inside + 0.4)), atol=1e-6)
    np.testing.assert_allclose(mean, 2.0, atol=1e-6)


@pytest.mark.parametrize(
    "x",
    [
        np.cos(2.0 * np.pi * np.arange(0.0, 1.9, DT)),  # two periods are not there
        np.cos(2.0 * np.pi * np.arange(0.0, 2.4, DT)),  # not one whole cycle between the windows
        np.random.default_rng(2).standard_normal(4000).cumsum(),
    ],
)
def test_no_cycles(x):
    with pytest.raises(NoCyclesError):
        cycles(x, DT, 0.5, 2.0)
    with pytest.raises(NoCyclesError):
        cycles(x, DT, 0.001, 0.002)
