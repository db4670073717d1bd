"""Amplitude spectra against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from foldyn.errors import InputError
from foldyn.signals import is_uniform, sampling_interval, spectrum

RNG = np.random.default_rng(7)


def _sine(n, dt, cycles, amplitude, phase=0.3):
    t = np.arange(n) * dt
    return amplitude * np.sin(2 * np.pi * cycles / (n * dt) * t + phase)


@pytest.mark.parametrize("n", [64, 65, 1000])
def test_sine_on_a_bin_peaks_at_its_amplitude(n):
    dt = 0.01
    frequencies, amplitude = spectrum(_sine(n, dt, cycles=9, amplitude=2.5), dt)
    assert frequencies[9] == pytest.approx(9 / (n * dt), rel=1e-14)
    assert amplitude[9] == pytest.approx(2.5, rel=1e-12)
    assert np.delete(amplitude, 9).max() < 1e-12


@pytest.mark.parametrize("n", [128, 129])
def test_parseval(n):
    x = RNG.normal(size=n)
    frequencies, a = spectrum(x, 0.1)
    weight = np.full(a.size, 0.5)
    weight[0] = 1.0
    if n % 2 == 0:
        weight[-1] = 1.0
        assert frequencies[-1] == pytest.approx(5.0)
    assert np.sum(weight * a**2) == pytest.approx(np.mean(x**2), rel=1e-13)


# Coherent gain divided out: the peak stays; leakage into the neighbors is a closed form
# (Hann: half the peak; Hamming 0.54/0.46: 0.46/1.08; Blackman 0.42/0.5/0.08: 0.5/0.84).
@pytest.mark.parametrize(
    ("window", "neighbor"), [("hann", 0.5), ("hamming", 0.23 / 0.54), ("blackman", 0.25 / 0.42)]
)
def test_windows_keep_the_amplitude(window, neighbor):
    n, dt = 256, 0.02
    _, a = spectrum(_sine(n, dt, cycles=40, amplitude=1.5), dt, window=window)
    assert a[40] == pytest.approx(1.5, rel=1e-10)
    assert a[39] / a[40] == pytest.approx(neighbor, rel=1e-10)
    assert a[41] / a[40] == pytest.approx(neighbor, rel=1e-10)
    assert a[45:].max() < 1e-10


def test_window_samples_equal_the_named_window():
    n = 90
    x = RNG.normal(size=n)
    hann = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(n) / n)
    named, given = (spectrum(x, 1.0, window=window)[1] for window in ("hann", hann))
    np.testing.assert_allclose(given, named, atol=1e-14)


def test_detrend():
    n, dt = 240, 0.1
    wave = np.cos(2 * np.pi * 20 * np.arange(n) / n)
    _, a = spectrum(wave + 4.0, dt, detrend="constant")
    assert a[0] < 1e-13
    assert a[20] == pytest.approx(1.0, rel=1e-12)
    line = 2.0 - 0.3 * np.arange(n)
    assert spectrum(line, dt, detrend="linear")[1].max() < 1e-11
    assert spectrum(line, dt, detrend="constant")[1].max() > 1.0


def test_padding_only_refines_the_grid():
    n, dt = 100, 0.01
    x = RNG.normal(size=n)
    f1, a1 = spectrum(x, dt)
    f4, a4 = spectrum(x, dt, pad=4)
    assert f4.size == 4 * n // 2 + 1
    np.testing.assert_allclose(f4[::4], f1, atol=1e-12)
    # The Nyquist bin is the last of both; all others are shared too.
    np.testing.assert_allclose(a4[::4], a1, atol=1e-13)


def test_exponential_decay_against_the_geometric_series():
    n, dt, decay = 512, 0.01, 1.7
    x = np.exp(-decay * dt * np.arange(n))
    f, a = spectrum(x, dt)
    q = np.exp(-(decay + 2j * np.pi * f) * dt)
    exact = np.abs((1 - np.exp(-decay * dt * n)) / (1 - q)) / n  # q**n: whole cycles drop out
    exact[1:-1] *= 2
    np.testing.assert_allclose(a, exact, rtol=1e-11)


@pytest.mark.parametrize("axis", [0, 1, -1])
def test_axis(axis):
    x = RNG.normal(size=(3, 50, 2))
    moved = np.moveaxis(x, 1, axis)
    f, a = spectrum(moved, 0.1, axis=axis)
    assert a.shape[axis] == f.size == 26
    np.testing.assert_allclose(np.moveaxis(a, axis, 1)[2, :, 1], spectrum(x[2, :, 1], 0.1)[1])


def test_input_is_left_alone():
    x = RNG.normal(size=40)
    kept = x.copy()
    spectrum(x, 0.1, window="hann", detrend="linear")
    np.testing.assert_array_equal(x, kept)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"x": [1.0, np.nan, 2.0, 3.0, 4.0]}, "index 1"),
        ({"x": [1.0, 2.0, 3.0]}, "at least 4"),
        ({"x": np.ones(8) * 1j}, "complex"),
        ({"x": ["a"] * 8}, "numbers"),
        ({"dt": 0.0}, "dt"),
        ({"dt": np.nan}, "dt"),
        ({"dt": [0.0, 0.1]}, "sampling_interval"),
        ({"axis": 1}, "axis"),
        ({"window": "no_such_window"}, "window"),
        ({"window": np.ones(5)}, "window"),
        ({"detrend": "mean"}, "detrend"),
        ({"pad": 0}, "pad"),
        ({"pad": 1.5}, "pad"),
    ],
)
def test_bad_input(arguments, words):
    with pytest.raises(InputError, match=words):
        spectrum(**({"x": np.arange(8.0), "dt": 0.1} | arguments))


def test_uniform_times():
    uneven = np.arange(100) * 0.01
    uneven[40] += 1e-4
    for times, uniform in (
        (np.arange(100_001) * 1e-4, True),
        (np.cumsum(np.full(10_000, 1e-3)), True),  # rounding of a running sum
        (1e6 + np.arange(50) * 1e-3, True),
        (uneven, False),
        (np.geomspace(1, 2, 20), False),
        (np.arange(10)[::-1], False),
        ([0.0], False),
        ([0.0, np.nan, 2.0], False),
        (np.zeros(5), False),
    ):
        assert is_uniform(times) == uniform


def test_sampling_interval():
    assert sampling_interval(2.0 + np.arange(11) * 0.1) == pytest.approx(0.1, rel=1e-12)
    for times, words in (
        ([0.0, 0.1, 0.3], "not evenly spaced"),
        ([0.0, np.nan, 0.3], "sample 1 is nan"),
        ([0.0], "at least two"),
    ):
        with pytest.raises(InputError, match=words):
            sampling_interval(times)
