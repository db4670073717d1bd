"""Waves in chains of cells: where their spectrum peaks, and how pulses are followed."""

from __future__ import annotations

import numpy as np
import pytest

from foldyn.errors import InputError
from foldyn.signals import pulse, wavenumber_spectrum

CELLS, TIMES, DT = 24, 90, 0.02
CELL, TIME = np.arange(CELLS), np.arange(TIMES)[:, None] * DT


def wave(bin_of_phase: int, bin_of_frequency: int, size: float = 1.0):
    turns = bin_of_frequency * TIME / (TIMES * DT) - bin_of_phase * CELL / CELLS
    return size * np.cos(2.0 * np.pi * turns)


def peak(found):
    k, f = np.unravel_index(found.amplitude.argmax(), found.amplitude.shape)
    return found.phase[k], found.frequency[f], found.amplitude[k, f]


@pytest.mark.parametrize("window", ["hann", None])
@pytest.mark.parametrize("way", [1, -1])
def test_a_wave_peaks_at_its_phase_and_frequency(window, way):
    found = wavenumber_spectrum(wave(5 * way, 11, 0.3), DT, window=window)
    expected = way * 5 * 2.0 * np.pi / CELLS, 11 / (TIMES * DT), 0.3
    np.testing.assert_allclose(peak(found), expected, rtol=1e-12)
    assert found.amplitude.shape == (CELLS, TIMES // 2 + 1)
    assert (np.diff(found.phase) > 0.0).all()


def test_a_standing_wave_is_two_traveling_ones():
    found = wavenumber_spectrum(wave(4, 7) + wave(-4, 7), DT, window=None)
    strong = np.argwhere(found.amplitude > 0.5)
    assert (
        found.phase[strong[:, 0]].round(9).tolist()
        == (np.array([-4, 4]) * 2.0 * np.pi / CELLS).round(9).tolist()
    )
    np.testing.assert_allclose(found.amplitude[tuple(strong.T)], 1.0, rtol=1e-12)


def test_components_add_as_squares():
    field = np.stack([wave(3, 5, 0.3), wave(3, 5, 0.4)], axis=-1)
    np.testing.assert_allclose(peak(wavenumber_spectrum(field, DT))[2], 0.5, rtol=1e-12)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_pulse_has_its_arrival_height_width_and_speed(sign):
    time, cell = np.linspace(0.0, 4.0, 801), np.arange(20)
    center, size = 0.6 + 0.125 * cell, 1.0 / (1.0 + 0.05 * cell)
    first = np.exp(-(((time[:, None] - center) / 0.1) ** 2))
    later = 0.9 * np.exp(-(((time[:, None] - center - 0.8) / 0.1) ** 2))  # as an echo
    found = pulse(time, sign * size * (first + later), sign=sign)
    np.testing.assert_allclose(found.arrival, center, atol=1e-5)
    np.testing.assert_allclose(found.peak, sign * size, rtol=1e-5)
    np.testing.assert_allclose(found.width, 0.2 * np.sqrt(np.log(2.0)), rtol=1e-3)
    assert found.speed == pytest.approx(8.0, rel=1e-4)


def test_cells_that_no_pulse_reaches_have_none():
    time = np.linspace(0.0, 1.0, 101)
    values = np.zeros((101, 4))
    values[:, 0] = np.exp(-(((time - 0.5) / 0.1) ** 2))
    found = pulse(time, values)
    assert np.isnan(found.arrival).tolist() == [False, True, True, True]
    assert np.isnan(found.speed)
    assert np.isnan(pulse(time, values, sign=-1).arrival).all()


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: wavenumber_spectrum(np.zeros(9), 0.1), "times and cells"),
        (lambda: wavenumber_spectrum(np.zeros((9, 3)), 0.1), "at least 4"),
        (lambda: wavenumber_spectrum(np.full((9, 9), np.nan), 0.1), "NaN"),
        (lambda: wavenumber_spectrum(np.zeros((9, 9)), -1.0), "dt"),
        (lambda: wavenumber_spectrum(np.zeros((9, 9)), 0.1, window="square"), "window"),
        (lambda: pulse(np.arange(9.0), np.zeros((8, 2))), "9 times"),
        (lambda: pulse(np.zeros(9), np.zeros((9, 2))), "increase"),
        (lambda: pulse(np.arange(9.0), np.zeros((9, 2)), sign=0), "1 or -1"),
        (lambda: pulse(np.arange(9.0), np.zeros((9, 2)), share=2.0), "share"),
    ],
)
def test_what_is_no_field_is_refused(call, words):
    with pytest.raises(InputError, match=words):
        call()
