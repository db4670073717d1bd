"""From a measured history to a free vibration, step by step."""

from __future__ import annotations

import numpy as np
import pytest

from foldyn import signals
from foldyn.errors import InputError

T = np.arange(480) / 240.0
X = np.exp(-3.0 * T) * np.cos(60.0 * T)


def test_gaps_are_filled_between_what_is_known():
    holes = X.copy()
    holes[[5, 100, 101, 102]] = np.nan
    filled = signals.fill_gaps(holes)
    known = np.isfinite(holes)
    np.testing.assert_array_equal(filled[known], X[known])
    assert np.abs(filled - X).max() < 0.002
    np.testing.assert_array_equal(signals.fill_gaps(X), X)


@pytest.mark.parametrize("where", [slice(10, 17), slice(0, 2), slice(478, 480)])
def test_what_was_not_measured_is_not_invented(where):
    holes = X.copy()
    holes[where] = np.nan
    with pytest.raises(InputError, match="gap"):
        signals.fill_gaps(holes, longest=5)


def test_a_window_has_both_its_ends():
    time, x = signals.choose_window(T, X, start=0.5, stop=1.0)
    assert time[0] == 0.5 and time[-1] == 1.0
    np.testing.assert_array_equal(x, X[120:241])
    with pytest.raises(InputError, match="holds 0 samples"):
        signals.choose_window(T, X, start=3.0, stop=4.0)


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_the_first_turn_is_the_first_maximum_or_minimum(noise):
    pressed = np.concatenate([np.ones(50), X])  # held, then released
    rough = pressed + noise * np.random.default_rng(0).standard_normal(530)
    # x' = 0 at tan(60 t) = -3/60, first at t = (pi - atan(1/20))/60
    expected = 50 + 240.0 * (np.pi - np.arctan(1.0 / 20.0)) / 60.0
    assert abs(signals.first_turning_point(rough) - expected) <= 1.0 + 100 * noise


def test_a_record_that_does_not_turn_is_refused():
    with pytest.raises(InputError, match="does not turn"):
        signals.first_turning_point(T)
    with pytest.raises(InputError, match="constant"):
        signals.first_turning_point(np.ones(10))


def test_final_position_and_trend():
    assert signals.subtract_final(X + 7.0)[-48:].mean() == pytest.approx(0.0, abs=1e-12)
    for change, added in ((signals.subtract_final, 7.0), (signals.remove_trend, 2.0 + 3.0 * T)):
        np.testing.assert_allclose(change(X + added), change(X), atol=1e-12)
    assert signals.remove_trend(X + 5.0, "constant").mean() == pytest.approx(0.0, abs=1e-12)
