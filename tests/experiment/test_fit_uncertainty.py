"""Intervals, correlation and what the data cannot tell, on linear models with known answers."""

from __future__ import annotations

import numpy as np
import pytest

from foldyn.experiment.calibration.fitted import Uncertainty

ONE = np.ones(2)
FREE = np.zeros(2, dtype=bool)


def line(n: int = 12) -> np.ndarray:
    """Jacobian of a straight line."""
    return np.stack([np.ones(n), np.linspace(0.0, 1.0, n)], axis=1)


def test_standard_errors_are_those_of_linear_regression() -> None:
    jacobian = line()
    residual = np.random.default_rng(0).standard_normal(12)
    found = Uncertainty.of(jacobian, residual, np.array([1.0, 10.0]), FREE, 0.95)
    cov = np.linalg.inv(jacobian.T @ jacobian) * (residual @ residual) / 10
    np.testing.assert_allclose(found.standard_error, np.sqrt(np.diag(cov)) * [1, 10], rtol=1e-12)
    assert found.correlation[0, 1] == pytest.approx(cov[0, 1] / np.sqrt(cov[0, 0] * cov[1, 1]))
    # Student's t, 97.5 %, 10 degrees of freedom: 2.228 in any table
    np.testing.assert_allclose(found.half_width / found.standard_error, 2.228, rtol=1e-4)
    assert found.freedom == 10


@pytest.mark.matrix
@pytest.mark.parametrize("confidence", [0.5, 0.95])
def test_intervals_contain_the_truth_as_often_as_they_say(confidence) -> None:
    jacobian, draw = 100.0 * line(6), np.random.default_rng(5)
    inside, draws = 0, 2000
    for _ in range(draws):
        noise = draw.standard_normal(6)
        error = np.linalg.lstsq(jacobian, noise, rcond=None)[0]
        found = Uncertainty.of(jacobian, jacobian @ error - noise, ONE, FREE, confidence)
        inside += int(abs(error[1]) < found.half_width[1])
    spread = 3.0 * np.sqrt(draws * confidence * (1.0 - confidence))
    assert abs(inside - confidence * draws) < spread


def test_a_direction_that_is_not_seen_takes_its_parameters_with_it() -> None:
    seen = 100.0 * line()
    jacobian = np.column_stack([seen[:, 0], seen[:, 1], 2.0 * seen[:, 1]])  # only their sum counts
    residual = np.random.default_rng(1).standard_normal(12)
    found = Uncertainty.of(jacobian, residual, np.ones(3), np.zeros(3, dtype=bool), 0.95)
    assert found.determined.tolist() == [True, False, False]
    assert np.isfinite(found.standard_error[0])
    assert np.isinf(found.standard_error[1:]).all()
    assert np.isnan(found.correlation[0, 1])
    assert found.singular_values[2] < 1e-9 * found.singular_values[0]
    np.testing.assert_allclose(np.abs(found.directions[2]), [0, 2 / 5**0.5, 1 / 5**0.5], atol=1e-9)


def test_what_the_noise_hides_is_not_determined() -> None:
    jacobian = line() * [100.0, 0.1]
    residual = np.random.default_rng(1).standard_normal(12)
    assert Uncertainty.of(jacobian, residual, ONE, FREE, 0.95).determined.tolist() == [True, False]
    assert Uncertainty.of(jacobian, 1e-3 * residual, ONE, FREE, 0.95).determined.all()


def test_nothing_seen_at_all() -> None:
    found = Uncertainty.of(np.zeros((5, 2)), np.ones(5), ONE, FREE, 0.95)
    assert not found.determined.any()


def test_a_parameter_at_its_bound_counts_as_known() -> None:
    residual = np.random.default_rng(2).standard_normal(12)
    found = Uncertainty.of(100.0 * line(), residual, ONE, np.array([False, True]), 0.95)
    assert np.isnan(found.standard_error[1])
    assert found.freedom == 11
    expected = np.sqrt(residual @ residual / 11 / 12) / 100.0
    assert found.standard_error[0] == pytest.approx(expected)


def test_as_many_values_as_parameters_leave_no_intervals() -> None:
    found = Uncertainty.of(100.0 * line(2), np.zeros(2), ONE, FREE, 0.95)
    assert found.freedom == 0
    assert np.isnan(found.half_width).all()
