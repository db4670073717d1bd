"""Frequency responses from records: exact without noise, biased and scattered as theory says."""

from __future__ import annotations

import numpy as np
import pytest
from known_poles import SPECIMEN, Mode, burst_random, receptance, response, sampled_receptance
from scipy import signal

from foldyn.errors import InputError
from foldyn.signals import circle_fit, exponential_window, frequency_response, without_window

DT = 1 / 240
N = 2400  # 10 s: the slowest mode, exp(-0.05 * 23.9 * 5 s), has fallen to 0.3 % of a burst's end


def half_sine(n: int, dt: float, duration: float) -> np.ndarray:
    t = np.arange(n) * dt
    return np.where(t < duration, np.sin(np.pi * t / duration), 0.0)


def sweep(n: int, dt: float, start: float, end: float, duration: float) -> np.ndarray:
    t = np.arange(n) * dt
    phase = 2 * np.pi * (start * t + (end - start) * t**2 / (2 * duration))
    return np.where(t < duration, np.sin(phase), 0.0)


# ------------------------------------------------------------------------ without noise
LONG = 9600  # 40 s: what is left at the end is below rounding
EXCITATIONS = {
    "burst random": burst_random(np.random.default_rng(3), 4, LONG, 0.25),
    "impulse": half_sine(LONG, DT, 0.02)[np.newaxis],
    "sweep": sweep(LONG, DT, 0.0, 30.0, 12.0)[np.newaxis],
}


@pytest.mark.parametrize("estimator", ["h1", "h2"])
@pytest.mark.parametrize("kind", EXCITATIONS)
def test_exact_without_noise(kind, estimator):
    force = EXCITATIONS[kind]
    estimate = frequency_response(force, response(force, DT, *SPECIMEN), dt=DT, estimator=estimator)
    exact = sampled_receptance(estimate.frequency, DT, *SPECIMEN)
    band = estimate.frequency < 25.0
    error = np.abs(estimate.response - exact)[band].max() / np.abs(exact).max()
    assert error < 1e-12
    assert estimate.segments == len(force)
    if len(force) > 1:
        assert estimate.coherence[band].min() > 1 - 1e-10


def test_records_tell_the_poles():
    """At 2000 samples per second the record's own error, (pi f dt)^2 / 3, is small enough."""
    dt, mode = 1 / 2000, Mode(9.3, 0.135, 2.0)
    force = half_sine(8000, dt, 0.03)
    estimate = frequency_response(force, response(force, dt, mode), dt=dt)
    f = estimate.frequency
    held = sampled_receptance(f, dt, mode) / receptance(f, mode)  # with that error taken off
    for taken, near, damping in ((1.0, 1e-7, 2e-5), (held, 1e-10, 1e-9)):
        fit = circle_fit(f, estimate.response / taken, band=(7.0, 12.0))
        assert fit.natural_frequency == pytest.approx(9.3, rel=near)
        assert fit.damping_ratio == pytest.approx(0.135, rel=damping)


def test_an_exponential_window_serves_records_that_have_not_died_away():
    mode, rate, n, dt = Mode(9.3, 0.01, 2.0), 24.0, 2000, 1 / 2000
    force = half_sine(n, dt, 0.03)
    x = response(force, dt, mode)
    assert np.abs(x[-200:]).max() > 0.5 * np.abs(x).max()
    plain = frequency_response(force, x, dt=dt)
    damped = frequency_response(force, x, dt=dt, window=exponential_window(n, dt, rate=rate))
    f = damped.frequency
    w = 2j * np.pi * f + rate
    exact = 2.0 / ((w - mode.pole) * (w - np.conj(mode.pole)))
    band, size = (f > 3) & (f < 25), np.abs(exact).max()
    assert np.abs(damped.response - exact)[band].max() < 2e-3 * size
    assert np.abs(plain.response - receptance(f, mode))[band].max() > 0.1 * size
    assert without_window(9.3, 0.01, rate=rate)[1] < 0  # what a window takes off, it adds before
    fit = circle_fit(f, damped.response, band=(5.0, 15.0))
    frequency, damping = without_window(fit.natural_frequency, fit.damping_ratio, rate=rate)
    assert frequency == pytest.approx(9.3, rel=1e-4)
    assert damping == pytest.approx(0.01, abs=2e-4)


def test_a_window_and_its_correction_cancel():
    """exp(-rate t) moves the pole by -rate, exactly."""
    pole = Mode(9.3, 0.05).pole - 2.5
    frequency, damping = without_window(abs(pole) / (2 * np.pi), -pole.real / abs(pole), rate=2.5)
    assert frequency == pytest.approx(9.3, rel=1e-14)
    assert damping == pytest.approx(0.05, rel=1e-13)


def test_welch_averages_are_those_of_scipy():
    rng = np.random.default_rng(5)
    force = rng.normal(size=5000)
    x = signal.lfilter([0.3, 0.2], [1, -0.7], force) + 0.1 * rng.normal(size=5000)
    settings = {"fs": 50.0, "window": "hann", "nperseg": 256, "noverlap": 128}
    given = {"segment": 256, "overlap": 0.5, "window": "hann", "detrend": "constant"}
    estimate = frequency_response(force, x, dt=1 / 50, **given)
    f, ff = signal.welch(force, **settings)
    fx = signal.csd(force, x, **settings)[1]
    assert estimate.segments == 38
    np.testing.assert_allclose(estimate.frequency, f)
    np.testing.assert_allclose(estimate.force_density, ff, rtol=1e-12)
    np.testing.assert_allclose(estimate.response[1:], (fx / ff)[1:], rtol=1e-10)
    coherence = signal.coherence(force, x, **settings)[1]
    np.testing.assert_allclose(estimate.coherence[1:], coherence[1:], rtol=1e-10)


@pytest.mark.parametrize("n", [400, 401])
def test_the_density_of_the_force_holds_its_mean_square(n):
    force = np.random.default_rng(2).normal(size=n)
    estimate = frequency_response(force, force, dt=0.01)
    width = estimate.frequency[1]
    assert estimate.force_density.sum() * width == pytest.approx(np.mean(force**2), rel=1e-12)


# ------------------------------------------------------------------------ with noise
def noisy(seed: int, records: int, in_force: float, in_response: float):
    """Burst random on the middle mode; noise of the given power, relative to each line's mean."""
    rng = np.random.default_rng(seed)
    mode = Mode(9.3, 0.135, 2.0)
    force = burst_random(rng, records, N)
    x = response(force, DT, mode)
    measured = force + np.sqrt(in_force) * np.std(force) * rng.normal(size=force.shape)
    x = x + np.sqrt(in_response) * np.std(x) * rng.normal(size=x.shape)
    return measured, x, sampled_receptance(np.fft.rfftfreq(N, DT), DT, mode)


def mean_ratio(estimator: str, in_force: float, in_response: float) -> float:
    """Mean of estimate over truth in the lines around the resonance."""
    force, x, exact = noisy(1, 400, in_force, in_response)
    estimate = frequency_response(force, x, dt=DT, estimator=estimator)
    band = (estimate.frequency > 8.5) & (estimate.frequency < 10.0)
    return float(np.mean((estimate.response / exact)[band]).real)


@pytest.mark.matrix
def test_noise_in_the_response_leaves_h1_and_inflates_h2():
    force, _, exact = noisy(1, 400, 0.0, 0.0)
    power = np.abs(exact[86:100]) ** 2 * np.mean(np.sum(force**2, axis=1))  # 8.6 ... 9.9 Hz
    noise = 10.0 * np.var(response(force, DT, Mode(9.3, 0.135, 2.0))) * N
    assert mean_ratio("h1", 0.0, 10.0) == pytest.approx(1.0, abs=0.02)
    assert mean_ratio("h2", 0.0, 10.0) == pytest.approx(np.mean(1 + noise / power), rel=0.02)
    assert np.min(noise / power) > 0.2


@pytest.mark.matrix
def test_noise_in_the_force_leaves_h2_deflates_h1_and_lowers_the_coherence_by_its_share():
    # the burst fills half of the record, the noise all of it: one power in every line
    assert mean_ratio("h2", 0.5, 0.0) == pytest.approx(1.0, abs=0.02)
    assert mean_ratio("h1", 0.5, 0.0) == pytest.approx(1 / 1.5, rel=0.02)
    force, x, _ = noisy(4, 400, 0.5, 0.0)
    h1, h2 = (frequency_response(force, x, dt=DT, estimator=kind) for kind in ("h1", "h2"))
    assert h1.coherence[50:150].mean() == pytest.approx(1 / 1.5, rel=0.02)
    assert h1.coherence[50:150].max() < 0.8
    np.testing.assert_allclose((h1.response / h2.response)[1:], h1.coherence[1:], rtol=1e-10)


def test_coherence_of_unrelated_records_is_one_over_their_number():
    rng = np.random.default_rng(6)
    estimate = frequency_response(rng.normal(size=(20, 512)), rng.normal(size=(20, 512)), dt=DT)
    assert estimate.coherence.mean() == pytest.approx(1 / 20, rel=0.15)
    one = frequency_response(*rng.normal(size=(2, 100)), dt=DT)  # tells none
    assert one.segments == 1 and np.isnan(one.coherence).all()


@pytest.mark.matrix
def test_scatter_over_seeds_is_the_stated_random_error():
    """Magnitude and phase (rad) deviate by sqrt((1 - c) / (2 n c)): 16 records, 200 seeds."""
    lines = slice(60, 140)
    ratios, stated = [], []
    for seed in range(200):
        force, x, exact = noisy(seed, 16, 0.0, 0.05)
        estimate = frequency_response(force, x, dt=DT)
        ratios.append((estimate.response / exact)[lines])
        stated.append(estimate.random_error[lines])
    ratios = np.array(ratios)
    expected = np.sqrt(np.mean(np.square(stated)))
    assert np.sqrt(np.mean(np.var(np.abs(ratios), axis=0))) == pytest.approx(expected, rel=0.1)
    assert np.sqrt(np.mean(np.var(np.angle(ratios), axis=0))) == pytest.approx(expected, rel=0.1)
    assert 0.01 < expected < 0.1


@pytest.mark.matrix
def test_noisy_records_tell_frequency_and_damping_within_their_errors():
    """20 bursts of 10 s, noise of 10 % of the response's deviation, 60 seeds.

    Bounds: natural frequency within 0.1 %, damping ratio within 0.7 % (3.5 deviations or more); the
    stated standard errors are the scatter to a third.
    """
    found, stated = [], []
    for seed in range(60):
        force, x, _ = noisy(seed, 20, 0.0, 0.01)
        estimate = frequency_response(force, x, dt=DT)
        fit = circle_fit(estimate.frequency, estimate.response, band=(7.0, 12.0))
        found.append((fit.natural_frequency / 9.3 - 1, fit.damping_ratio / 0.135 - 1))
        stated.append((fit.frequency_error / 9.3, fit.damping_error / 0.135))
    scatter = np.std(found, axis=0)
    assert (np.abs(found).max(axis=0) < [1e-3, 7e-3]).all()
    np.testing.assert_allclose(np.mean(stated, axis=0), scatter, rtol=0.35)


# ------------------------------------------------------------------------ shapes and refusals
def test_channels_and_records_keep_their_places():
    rng = np.random.default_rng(8)
    force = rng.normal(size=(3, 64))
    gains = np.array([[1.0, -2.0], [3.0, 0.5], [0.0, 4.0]])
    x = force[:, :, np.newaxis, np.newaxis] * gains
    estimate = frequency_response(force, x, dt=0.1)
    assert estimate.response.shape == estimate.coherence.shape == (33, 3, 2)
    np.testing.assert_allclose(estimate.response, np.broadcast_to(gains, (33, 3, 2)), atol=1e-13)
    one = frequency_response(force[1], x[1], dt=0.1)
    np.testing.assert_allclose(one.response, estimate.response, atol=1e-12)


def test_lines_without_force_are_nan():
    t = np.arange(200) / 200
    force = np.sin(2 * np.pi * 10 * t)
    estimate = frequency_response(force, 2 * force, dt=1 / 200)
    assert estimate.response[10] == pytest.approx(2.0)
    assert np.isnan(np.delete(estimate.response, 10)).all()


def test_what_is_left_at_the_end_is_unused():
    force = np.random.default_rng(8).normal(size=130)
    kept, whole, more = (
        frequency_response(each, each, dt=0.1, segment=32, overlap=overlap)
        for each, overlap in ((force[:128], 0.0), (force, 0.0), (force, 0.75))
    )
    np.testing.assert_array_equal(whole.force_density, kept.force_density)
    assert (kept.segments, more.segments) == (4, 13)


GOOD = {"force": np.ones(100), "response": np.ones(100), "dt": 0.1}


@pytest.mark.parametrize(
    ("function", "arguments", "words"),
    [
        *(
            (frequency_response, GOOD | arguments, words)
            for arguments, words in (
                ({"response": np.ones(99)}, r"response: shape \(99,\)"),
                ({"force": np.ones((2, 100))}, "response: shape"),
                ({"force": np.ones((1, 2, 50))}, "force: shape"),
                ({"force": np.zeros(100)}, "force: zero throughout"),
                ({"response": np.full(100, np.nan)}, "response: 100 samples are NaN"),
                ({"dt": 0.0}, "dt"),
                ({"dt": np.arange(100) * 0.1}, "sampling_interval"),
                ({"estimator": "h3"}, 'estimator = "h3"'),
                ({"segment": 101}, "segment: 101"),
                ({"segment": 2}, "segment = 2"),
                ({"overlap": 1.0}, "overlap = 1.0"),
                ({"overlap": -0.1}, "overlap = -0.1"),
                ({"window": np.ones(5)}, "window"),
                ({"detrend": "mean"}, "detrend"),
            )
        ),
        (exponential_window, {"n": 100, "dt": 0.1, "rate": -1.0}, "rate = -1.0: must be greater"),
        (exponential_window, {"n": 0, "dt": 0.1, "rate": 1.0}, "n = 0"),
        (without_window, {"frequency": 9.0, "damping_ratio": 1.2, "rate": 1.0}, "damping_ratio"),
        (without_window, {"frequency": 9.0, "damping_ratio": 0.1, "rate": "x"}, 'rate = "x": must'),
    ],
)
def test_bad_input(function, arguments, words):
    with pytest.raises(InputError, match=words):
        function(**arguments)
