"""Logarithmic decrement of known decays."""

from __future__ import annotations

import numpy as np
import pytest
from known_poles import free_vibration

from foldyn.errors import InputError
from foldyn.signals import log_decrement


def decrement(z):
    return 2 * np.pi * z / np.sqrt(1 - z**2)


def decay(z, per_cycle, cycles, phase=0.0):
    """exp(-z w t) cos(w_d t + phase) with `per_cycle` samples in each damped period of 1 s."""
    t = np.arange(int(cycles * per_cycle)) / per_cycle
    return free_vibration(t, (1 / np.sqrt(1 - z**2), z, 1.0, phase)), 1 / per_cycle


@pytest.mark.parametrize("z", [0.002, 0.0255, 0.135])  # 0.0255: the specimen's 16 %
@pytest.mark.parametrize("rest", [0.0, None])
def test_exact_where_each_cycle_is_sampled_alike(z, rest):
    x, dt = decay(z, 40, 7)
    result = log_decrement(x, dt, rest=rest, floor=1e-3)
    assert result.decrement == pytest.approx(decrement(z), rel=1e-10)
    assert result.damping_ratio == pytest.approx(z, rel=1e-10)
    assert result.damped_frequency == pytest.approx(1.0, rel=1e-10)
    assert result.natural_frequency == pytest.approx(1 / np.sqrt(1 - z**2), rel=1e-10)
    np.testing.assert_allclose(result.successive, decrement(z), rtol=1e-9)
    assert result.standard_error < 1e-10


@pytest.mark.parametrize(("per_cycle", "accuracy"), [(8.37, 3e-4), (12.37, 5e-5), (100.37, 5e-5)])
@pytest.mark.parametrize("z", [0.0255, 0.135])
def test_accuracy_between_samples(per_cycle, accuracy, z):
    x, dt = decay(z, per_cycle, 7)
    result = log_decrement(x, dt, rest=0.0, floor=1e-3)
    assert result.decrement == pytest.approx(decrement(z), rel=accuracy)
    assert result.damped_frequency == pytest.approx(1.0, rel=accuracy)


def test_heights_and_times():
    """Maxima of exp(-a t) cos(w t): tan(w t) = -a / w."""
    z = 0.1
    x, dt = decay(z, 50, 6)
    result = log_decrement(x, dt, rest=0.0, floor=0.01)
    w, a = 2 * np.pi, 2 * np.pi * z / np.sqrt(1 - z**2)
    times = 1 + np.arange(result.time.size) - np.arctan(a / w) / w
    np.testing.assert_allclose(result.time, times, atol=2e-4)
    np.testing.assert_allclose(result.height, np.exp(-a * times) * np.cos(w * times), rtol=2e-4)


def test_an_offset_and_a_drift_drop_out():
    x, dt = decay(0.0255, 40, 12)
    t = np.arange(x.size) * dt
    offset = log_decrement(x + 3.0, dt)
    assert offset.decrement == pytest.approx(decrement(0.0255), rel=1e-10)
    drifting = log_decrement(x + 3.0 + 0.02 * t, dt)
    assert drifting.decrement == pytest.approx(decrement(0.0255), rel=1e-3)
    assert log_decrement(x + 0.1, dt, rest=0.1).decrement == pytest.approx(offset.decrement)
    # an offset that is taken for none is no small matter
    assert log_decrement(x + 0.1, dt, rest=0.0).decrement < 0.9 * decrement(0.0255)


def test_the_count_starts_at_the_highest_maximum_and_ends_at_the_floor():
    x, dt = decay(0.0255, 40, 30)
    growing = np.linspace(0, 1, 120)
    x = np.concatenate([growing * np.sin(2 * np.pi * np.arange(120) / 40), x[30:]])
    result = log_decrement(x, dt, rest=0.0, floor=0.1)
    assert result.height[0] == result.height.max()
    assert result.height[-1] > 0.1 * result.height[0]
    assert result.height[-1] * np.exp(-decrement(0.0255)) < 0.1 * result.height[0]
    assert result.decrement == pytest.approx(decrement(0.0255), rel=1e-3)


def test_damping_that_depends_on_amplitude_shows_in_the_pairs():
    """Coulomb friction: maxima fall by equal steps, so the successive decrements grow."""
    heights = 1 - 0.15 * np.arange(5)
    t = np.arange(400) / 80
    x = (1 - 0.15 * t) * np.cos(2 * np.pi * t)
    result = log_decrement(x, 1 / 80, rest=0.0)
    assert (np.diff(result.successive) > 0).all()
    np.testing.assert_allclose(result.successive, -np.diff(np.log(heights))[1:], rtol=0.02)


@pytest.mark.matrix
@pytest.mark.parametrize(("z", "bias", "deviation"), [(0.0255, 0.004, 0.01), (0.135, 0.03, 0.035)])
def test_scatter_over_seeds(z, bias, deviation):
    """Noise of 1 % of the amplitude at 25 samples per cycle, 100 seeds, rest position known.

    Bounds: deviation 1 % of the decrement at z = 0.0255 and 3.5 % at 0.135, bias 0.4 and 3 %; the
    stated error is the deviation to a factor of 1.5.
    """
    x, dt = decay(z, 25.3, 24)
    rng = np.random.default_rng(5)
    results = [log_decrement(x + 0.01 * rng.normal(size=x.size), dt, rest=0.0) for _ in range(100)]
    found = np.array([result.decrement for result in results]) / decrement(z)
    assert np.std(found) < deviation
    assert abs(found.mean() - 1) < bias
    stated = np.sqrt(np.mean([result.standard_error**2 for result in results])) / decrement(z)
    assert 1 / 1.5 < stated / np.std(found) < 1.5


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"x": np.ones((40, 2))}, "give one record"),
        ({"x": np.ones(10)}, "10 samples; at least 16"),
        ({"x": np.exp(-np.arange(80) / 10)}, "0 maxima above"),
        ({"floor": 0.9}, "1 maxima above 0.9 of the highest"),
        ({"floor": 1.0}, "floor = 1.0"),
        ({"dt": -0.1}, "dt = -0.1"),
        ({"rest": np.nan}, "rest = nan"),
        ({"frequency": 10.0}, "4 samples per cycle of 10 Hz"),
        ({"rest": 5.0}, "0 maxima"),
    ],
)
def test_bad_input(arguments, words):
    x, dt = decay(0.05, 40, 4)
    with pytest.raises(InputError, match=words):
        log_decrement(**({"x": x, "dt": dt} | arguments))
