"""Sines of known frequency: exact without noise, scattered as least squares must with it."""

from __future__ import annotations

import numpy as np
import pytest
from known_poles import Mode, response, sampled_receptance

from foldyn.errors import InputError
from foldyn.signals import fit_sine, stepped_sine

TIME = np.arange(333) * 0.01


def cosine(t, frequency, amplitude=1.0, phase=0.0):
    return amplitude * np.cos(2 * np.pi * frequency * t + phase)


def test_exact_with_offset_trend_and_a_broken_cycle():
    t = 17.3 + TIME
    fit = fit_sine(t, 5.0 - 0.7 * t + cosine(t, 1.37, 2.0, -0.8), frequency=1.37)
    assert fit.amplitude[0] == pytest.approx(2.0 * np.exp(-0.8j), rel=1e-11)
    assert fit.offset == pytest.approx(5.0 - 0.7 * 0.5 * (t[0] + t[-1]), rel=1e-12)
    assert fit.slope == pytest.approx(-0.7, rel=1e-11)
    assert fit.rest < 1e-13
    assert fit.unsteadiness < 1e-11
    assert fit.samples == 333


def test_times_need_not_be_even():
    t = np.sort(np.random.default_rng(1).uniform(0.0, 5.0, 400))
    fit = fit_sine(t, cosine(t, 2.2, 0.5, 1.0), frequency=2.2)
    assert fit.amplitude[0] == pytest.approx(0.5 * np.exp(1.0j), rel=1e-11)


def test_harmonics_and_channels():
    first = cosine(TIME, 2.0, 1.0, 0.1) + cosine(TIME, 6.0, 0.2, 0.5)
    x = np.stack([first, cosine(TIME, 4.0, 0.3)], axis=1)
    fit = fit_sine(TIME, x, frequency=2.0, harmonics=3)
    expected = [[np.exp(0.1j), 0.0], [0.0, 0.3], [0.2 * np.exp(0.5j), 0.0]]
    np.testing.assert_allclose(fit.amplitude, expected, atol=1e-13)
    assert fit.rest.shape == fit.offset.shape == fit.slope.shape == (2,)
    # left out, they are in the rest
    assert fit_sine(TIME, x, frequency=2.0).rest[0] == pytest.approx(0.2 / np.sqrt(2), rel=0.02)


def test_the_last_cycles_leave_the_transient_out():
    x = np.exp(-8.0 * TIME) + cosine(TIME, 4.0)
    whole, last = fit_sine(TIME, x, frequency=4.0), fit_sine(TIME, x, frequency=4.0, cycles=5)
    assert last.samples == 125
    assert abs(last.amplitude[0] - 1) < 1e-6 < abs(whole.amplitude[0] - 1)
    assert last.unsteadiness < 1e-5 < whole.unsteadiness


def test_a_beat_is_unsteady():
    x = cosine(TIME, 4.0) * (1 + 0.2 * TIME)
    # the amplitude of one half less that of the other, over their mean
    expected = 0.2 * TIME[-1] / 2 / (1 + 0.2 * TIME[-1] / 2)
    assert fit_sine(TIME, x, frequency=4.0).unsteadiness == pytest.approx(expected, rel=0.05)


def test_scatter_over_seeds():
    """White noise s: deviation s sqrt(2 / n) of the real and of the imaginary part."""
    rng = np.random.default_rng(4)
    t = np.arange(400) * 0.01
    records = cosine(t, 5.0) + 0.1 * rng.normal(size=(300, 400))
    found = np.array([fit_sine(t, x, frequency=5.0).amplitude[0] for x in records])
    expected = 0.1 * np.sqrt(2 / 400)
    assert np.std(found.real) == pytest.approx(expected, rel=0.15)
    assert np.std(found.imag) == pytest.approx(expected, rel=0.15)
    assert abs(found.mean() - 1) < 4 * expected / np.sqrt(300)


def test_a_linear_oscillator():
    """From rest to the steady state; the force is straight between its samples."""
    mode, dt = Mode(9.3, 0.135, 2.0), 1 / 240
    t = np.arange(2400) * dt
    for frequency in (3.0, 9.0, 11.7):
        force = 0.2 * np.sin(2 * np.pi * frequency * t)
        found = stepped_sine(
            t, force, response=response(force, dt, mode), frequency=frequency, cycles=10
        )
        assert found == pytest.approx(sampled_receptance(frequency, dt, mode), rel=1e-9)


def test_a_cubic_spring_shows_its_describing_function():
    """x = F + c F^3, F = a cos: the first harmonic is (1 + 3/4 c a^2) a, the third c a^3 / 4."""
    c = 0.4
    for a in (0.1, 1.0, 2.0):
        force = cosine(TIME, 3.0, a, 0.6)
        x = force + c * force**3
        first = stepped_sine(TIME, force, response=x, frequency=3.0, harmonics=3)
        assert first == pytest.approx(1 + 0.75 * c * a**2, rel=1e-11)
        third = fit_sine(TIME, x, frequency=3.0, harmonics=3).amplitude[2]
        assert third == pytest.approx(0.25 * c * a**3 * np.exp(1.8j), rel=1e-9)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"frequency": 0.0}, "frequency = 0.0"),
        ({"frequency": 0.3}, "0.999 cycles of 0.3 Hz, and 2 are needed"),
        ({"cycles": 100}, "100 are needed; record longer, or fit fewer cycles"),
        ({"cycles": 1}, "cycles = 1"),
        ({"frequency": 20.0, "harmonics": 3}, "harmonics: 3 times 20 Hz"),
        ({"harmonics": 0}, "harmonics = 0"),
        ({"time": TIME[::-1]}, "time: give one row"),
        ({"x": TIME[:-1]}, "but there are 333 times"),
        ({"x": np.full(333, np.inf)}, "x: 333 samples are NaN"),
    ],
)
def test_bad_input(arguments, words):
    good = {"time": TIME, "x": cosine(TIME, 4.0), "frequency": 4.0}
    with pytest.raises(InputError, match=words):
        fit_sine(**(good | arguments))


def test_a_force_without_content_is_refused():
    with pytest.raises(InputError, match="no content at 4 Hz"):
        stepped_sine(TIME, np.ones(333), response=TIME, frequency=4.0)
    with pytest.raises(InputError, match="force: shape"):
        stepped_sine(TIME, np.ones((333, 2)), response=TIME, frequency=4.0)
