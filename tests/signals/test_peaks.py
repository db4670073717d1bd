"""Peaks and half-power damping against the closed forms of a single mode."""

from __future__ import annotations

import numpy as np
import pytest
from known_poles import SPECIMEN, Mode, receptance

from foldyn.errors import FoldynWarning, InputError
from foldyn.signals import find_peaks, half_power, spectrum
from foldyn.signals.peaks import magnitude_curve

F0 = 9.3
ORDERS = {"receptance": 0, "mobility": 1, "accelerance": 2}


def curve(f, quantity, *modes):
    return np.abs((2j * np.pi * f) ** ORDERS[quantity] * receptance(f, *modes))


# ------------------------------------------------------------------------ peaks
@pytest.mark.parametrize("z", [0.001, 0.02, 0.135, 0.3])
@pytest.mark.parametrize("quantity", ORDERS)
def test_the_peak_of_a_mode_is_exact_between_samples(quantity, z):
    f = np.linspace(0.05, 30.0, 173)
    peaks = find_peaks(f, curve(f, quantity, Mode(F0, z)), quantity=quantity)
    dip = np.sqrt(1 - 2 * z**2)
    at = {"receptance": F0 * dip, "mobility": F0, "accelerance": F0 / dip}[quantity]
    assert peaks.frequency == pytest.approx([at], rel=1e-12)
    exact = curve(np.array([at]), quantity, Mode(F0, z))
    assert peaks.height == pytest.approx(exact, rel=1e-8 if z == 0.001 else 1e-12)
    if quantity == "receptance":  # 1 / (2 z sqrt(1 - z^2)) times the static value
        static = receptance(np.zeros(1), Mode(F0, z))[0].real
        assert peaks.height[0] / static == pytest.approx(1 / (2 * z * np.sqrt(1 - z**2)))


@pytest.mark.parametrize("spacing", [0.2, 1e-2, 1e-4, 1e-5])
@pytest.mark.parametrize("quantity", ORDERS)
def test_a_peak_follows_its_mode_however_close_the_samples(quantity, spacing):
    """Its slopes by the samples, with how these change as the mode's numbers do."""
    z, h = 0.03, 1e-4
    dip = np.sqrt(1 - 2 * z**2)
    at = {"receptance": F0 * dip, "mobility": F0, "accelerance": F0 / dip}[quantity]
    f = at + spacing * (np.arange(5) - 1.7)
    one = magnitude_curve(f, curve(f, quantity, Mode(F0, z)), quantity)
    slopes, size = one.peak_slopes(2), one.size[1:4]

    def rate(ahead, behind):
        return (curve(f, quantity, ahead) - curve(f, quantity, behind))[1:4] / (2.0 * h)

    by_frequency = rate(Mode(F0 * (1 + h), z), Mode(F0 * (1 - h), z))
    assert slopes.frequency @ by_frequency == pytest.approx(at, rel=1e-4)
    by_damping = rate(Mode(F0, z * (1 + h)), Mode(F0, z * (1 - h)))
    height = one.peak(2)[1]
    root = {"receptance": 1 - 2 * z**2, "mobility": 1 - z**2, "accelerance": 1 - 2 * z**2}
    falls = root[quantity] / (1 - z**2)  # of 1 / (2 z sqrt(1 - z^2)), or of 1 / (2 z)
    assert slopes.height @ by_damping == pytest.approx(-falls * height, rel=1e-4)
    assert slopes.height @ size == pytest.approx(height, rel=1e-9)  # twice as high
    rounding = 1e-9 * np.abs(slopes.frequency) @ size
    assert slopes.frequency @ size == pytest.approx(0.0, abs=rounding)


def test_a_kink_is_not_shaped_like_a_mode():
    size = np.array([0.1, 0.999, 1.0, 0.01, 0.01])
    one = magnitude_curve(np.arange(1.0, 6.0), size, "receptance")
    assert one.peak_slopes(2) is None
    assert one.peak(2) == (3.0, 1.0)


def test_several_peaks_their_prominence_and_their_number():
    f = np.linspace(0.0, 25.0, 2501)
    size = curve(f, "accelerance", *SPECIMEN)
    peaks = find_peaks(f, size, quantity="accelerance")
    np.testing.assert_allclose(peaks.frequency, [3.8, 9.3, 16.7], rtol=0.1)
    assert (np.abs(f[peaks.index] - peaks.frequency) < 0.01).all()
    assert (peaks.prominence <= peaks.height).all()
    best = find_peaks(f, size, count=1, quantity="accelerance")
    assert best.prominence == peaks.prominence.max()
    assert find_peaks(f, size, prominence=0.99, quantity="accelerance").frequency.size == 0


def test_spacing_may_vary_and_zeros_may_stand_beside():
    f = np.concatenate([np.linspace(1, 8, 9), np.linspace(8.5, 10, 7), np.linspace(11, 30, 5)])
    peaks = find_peaks(f, curve(f, "receptance", Mode(F0, 0.05)))
    assert peaks.frequency == pytest.approx([F0 * np.sqrt(1 - 2 * 0.05**2)], rel=1e-12)
    spike = find_peaks([0.0, 1.0, 2.0, 3.0], [0.0, 0.0, 1.0, 0.0])
    assert spike.frequency == [2.0]
    assert spike.height == [1.0]


def test_a_line_of_a_spectrum():
    """A sine between two lines, Hann window: interpolation to a hundredth of a line."""
    t = np.arange(1000) * 0.01
    f, amplitude = spectrum(np.sin(2 * np.pi * 7.237 * t), 0.01, window="hann", pad=4)
    assert find_peaks(f, amplitude, count=1).frequency == pytest.approx([7.237], abs=1e-3)


# ------------------------------------------------------------------------ half power
@pytest.mark.parametrize("points", [61, 1001])
@pytest.mark.parametrize("z", [0.02, 0.135, 0.25])
@pytest.mark.parametrize("quantity", ORDERS)
def test_half_power_points_of_a_mode_are_exact(quantity, z, points):
    f = np.linspace(0.01, 45.0, points)
    if z == 0.02 and points == 61:
        f = np.linspace(7.0, 12.0, points)
    result = half_power(f, curve(f, quantity, Mode(F0, z)), quantity=quantity)
    # (f / f0)^2 at the points: 1 - 2 z^2 -+ 2 z sqrt(1 - z^2), or the reciprocal
    low, high = 1 - 2 * z**2 + 2 * z * np.sqrt(1 - z**2) * np.array([-1, 1])
    squares = {
        "receptance": (low, high),
        "mobility": (np.sqrt(1 + z**2) + z * np.array([-1, 1])) ** 2,
        "accelerance": (1 / high, 1 / low),
    }[quantity]
    np.testing.assert_allclose([result.lower, result.upper], F0 * np.sqrt(squares), rtol=1e-11)
    assert result.damping_ratio == pytest.approx(z, rel=1e-10)
    assert result.natural_frequency == pytest.approx(F0, rel=1e-11)
    assert result.asymmetry < 1e-10
    textbook = (result.upper - result.lower) / (2 * result.peak)
    assert result.textbook_damping_ratio == pytest.approx(textbook)


def test_bias_of_the_textbook_formula():
    """By the exact half-power points, at the specimen's 13.5 %: 3.9 % too large."""
    f = np.linspace(0.0, 30.0, 301)

    def bias(z, quantity):
        size = curve(f, quantity, Mode(F0, z))
        return half_power(f, size, quantity=quantity).textbook_damping_ratio / z - 1

    def exact(z):
        s, d = 1 - 2 * z**2, 2 * z * np.sqrt(1 - z**2)
        return (np.sqrt(s + d) - np.sqrt(s - d)) / (2 * np.sqrt(s)) / z - 1

    assert bias(0.135, "receptance") == pytest.approx(exact(0.135), rel=1e-10)
    assert bias(0.135, "receptance") == pytest.approx(0.03859, abs=1e-5)
    assert bias(0.135, "accelerance") == pytest.approx(0.08109, abs=1e-5)
    assert abs(bias(0.135, "mobility")) < 1e-11
    # 2 z^2 for small damping
    assert bias(0.04, "receptance") == pytest.approx(2 * 0.04**2, rel=0.02)


def test_the_peak_asked_for():
    f = np.linspace(0.0, 25.0, 1001)
    modes = (Mode(3.8, 0.03, 1.0), Mode(9.3, 0.03, 6.0), Mode(16.7, 0.03, -18.0))
    size = curve(f, "receptance", *modes)
    for mode in modes:
        result = half_power(f, size, near=mode.frequency)
        assert result.peak == pytest.approx(mode.frequency, rel=0.01)
        assert result.damping_ratio == pytest.approx(0.03, rel=0.05)
    heights = [half_power(f, size, near=at).height for at in (4, 9, 17)]
    assert half_power(f, size).height == max(heights)


def test_neighbors_make_the_points_lopsided():
    f = np.linspace(0.0, 25.0, 1001)
    alone = half_power(f, curve(f, "receptance", Mode(F0, 0.03)))
    beside = half_power(f, curve(f, "receptance", Mode(F0, 0.03), Mode(10.4, 0.03, 0.2)))
    assert beside.asymmetry > 100 * alone.asymmetry
    assert beside.asymmetry > 0.01
    merged = curve(f, "receptance", Mode(F0, 0.05), Mode(10.2, 0.05, -1.0))
    with pytest.warns(FoldynWarning, match="lies 14% of its width off the middle"):
        assert half_power(f, merged).damping_ratio > 0.06


WIDE, COARSE = np.linspace(0.0, 25.0, 1001), np.arange(0.5, 20.0)


@pytest.mark.parametrize(
    ("f", "modes", "near", "words"),
    [
        (WIDE[340:], [Mode(F0, 0.135)], None, r"below the peak at .* ends at 8\.5 Hz"),
        (WIDE[:401], [Mode(F0, 0.135)], None, r"above the peak at .* ends at 10 Hz"),
        # a receptance with more damping than sin(pi / 8) does not fall by 3 dB towards 0 Hz
        (WIDE, [Mode(F0, 0.385)], None, "ends at 0 Hz"),
        (WIDE, [Mode(9.3, 0.05), Mode(10.2, 0.05, 1.0)], 9.3, "rises again at .* neighbor overl"),
        (WIDE[:100], [Mode(F0, 0.1)], None, "no peak"),
        (COARSE, [Mode(9.1, 0.01)], None, "no sample lies within the half-power points"),
    ],
)
def test_curves_that_do_not_fall_by_3_db_are_refused(f, modes, near, words):
    with pytest.raises(InputError, match=words):
        half_power(f, curve(f, "receptance", *modes), near=near)
    half_power(WIDE, curve(WIDE, "receptance", Mode(F0, 0.38)))


def test_noise_on_the_curve():
    """1 % of the peak, 100 seeds: bias below 3 %, deviation below 3 % of the damping."""
    rng = np.random.default_rng(11)
    f = np.linspace(4.0, 15.0, 56)
    H = receptance(f, Mode(F0, 0.135))
    noise = 0.01 * np.abs(H).max() / np.sqrt(2)
    found = []
    for _ in range(100):
        noisy = H + noise * (rng.normal(size=f.size) + 1j * rng.normal(size=f.size))
        found.append(half_power(f, noisy, ripple=0.1).damping_ratio / 0.135 - 1)
    assert abs(np.mean(found)) < 0.03
    assert np.std(found) < 0.03


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"frequency": [1.0, 2.0]}, "at least 3 frequencies"),
        ({"frequency": [1.0, 1.0, 2.0, 3.0]}, "must increase"),
        ({"magnitude": [1.0, 2.0, 1.0]}, "give one curve"),
        ({"magnitude": [1.0, np.nan, 1.0, 0.0]}, "first at 1 Hz; cut the curve"),
        ({"magnitude": [0.0, -1.0, 2.0, 1.0]}, "magnitude: below 0"),
        ({"magnitude": ["a"] * 4}, "not an array of numbers"),
        ({"quantity": "compliance"}, 'quantity = "compliance"'),
    ],
)
@pytest.mark.parametrize("function", [find_peaks, half_power])
def test_bad_input(function, arguments, words):
    good = {"frequency": [0.0, 1.0, 2.0, 3.0], "magnitude": [0.0, 2.0, 1.0, 0.0]}
    with pytest.raises(InputError, match=words):
        function(**(good | arguments))


@pytest.mark.parametrize(
    ("function", "option", "words"),
    [
        (find_peaks, {"prominence": 1.5}, r"prominence = 1\.5"),
        (find_peaks, {"count": 0}, "count = 0"),
        (half_power, {"ripple": -0.1}, r"ripple = -0\.1"),
    ],
)
def test_bad_options(function, option, words):
    with pytest.raises(InputError, match=words):
        function([0.0, 1.0, 2.0, 3.0], [0.0, 2.0, 1.0, 0.0], **option)
