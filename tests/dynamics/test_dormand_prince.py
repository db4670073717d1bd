"""Error control and dense output of Dormand and Prince's method."""

from __future__ import annotations

import numpy as np
import pytest
from oscillators import MASS, linear_law, oscillator, released
from scipy.integrate import RK45

import foldyn as fd
from foldyn.checks import observed_order
from foldyn.dynamics import dormand_prince

OMEGA = 4.0


@pytest.fixture
def spring() -> fd.Case:
    return oscillator(linear_law(), MASS * OMEGA**2)


def test_coefficients_are_those_of_scipy():
    """SciPy writes the same pair, with the last row of A apart and the error with its sign."""
    np.testing.assert_array_equal(dormand_prince.A[:6, :5], RK45.A)
    np.testing.assert_array_equal(dormand_prince.A[6], RK45.B)
    np.testing.assert_array_equal(dormand_prince.C[:6], RK45.C)
    np.testing.assert_allclose(np.abs(dormand_prince.E), np.abs(RK45.E), rtol=1e-15)
    np.testing.assert_array_equal(dormand_prince.P, RK45.P)


def test_coefficients_fulfil_their_conditions():
    """Rows of A sum to C; the interpolant is consistent and ends in the weights of the step."""
    a, c = dormand_prince.A, dormand_prince.C
    np.testing.assert_allclose(a.sum(axis=1), c, atol=1e-15)
    np.testing.assert_allclose(dormand_prince.E.sum(), 0.0, atol=1e-15)
    np.testing.assert_allclose(dormand_prince.P.sum(axis=0), [1.0, 0.0, 0.0, 0.0], atol=2e-14)
    np.testing.assert_allclose(dormand_prince.P.sum(axis=1)[:6], a[6], atol=1e-14)
    # quadrature conditions of the weights up to order 5: sum b c^(k-1) = 1/k
    for k in range(1, 6):
        assert a[6] @ c[:6] ** (k - 1) == pytest.approx(1.0 / k, abs=1e-15)


def error_at_samples(case: fd.Case, tolerance: float, **options) -> float:
    motion = fd.simulate(
        case, 4.0, "dormand_prince", initial=released(0.1), tolerance=tolerance, **options
    )
    exact = 0.1 * np.cos(OMEGA * motion.time.to_numpy())
    return float(np.abs(motion.displacement[:, 1, 0].to_numpy() - exact).max())


def test_the_error_follows_the_tolerance(spring):
    """The step grows with the fifth root of the tolerance, so the error falls in proportion."""
    tolerance = np.array([1e-5, 1e-6, 1e-7, 1e-8])
    errors = [error_at_samples(spring, tol, force=True) for tol in tolerance]
    assert observed_order(tolerance, errors) == pytest.approx(1.0, abs=0.15)
    assert errors[1] < 20 * 1e-6 * 0.1


@pytest.mark.parametrize("every", [0.01, 0.037, 0.4])
def test_samples_between_steps(spring, every):
    """Dense output: at the times asked for, as accurate as the steps."""
    motion = fd.simulate(
        spring, 4.0, "dormand_prince", initial=released(0.1), every=every, tolerance=1e-8
    )
    t = motion.time.to_numpy()
    np.testing.assert_allclose(t, np.arange(len(t)) * every, rtol=0, atol=1e-15)
    assert t[-1] > 4.0 - every
    np.testing.assert_allclose(motion.displacement[:, 1, 0], 0.1 * np.cos(OMEGA * t), atol=2e-8)
    np.testing.assert_allclose(
        motion.velocity[:, 1, 0], -0.1 * OMEGA * np.sin(OMEGA * t), atol=2e-7
    )
    assert motion.attrs["energy_error"] < 1e-6
    last = fd.simulate(spring, 4.0, "dormand_prince", initial=released(0.1), tolerance=1e-8)
    assert last.attrs["steps"] == motion.attrs["steps"]  # sampling does not move the steps


def test_order_of_the_interpolant(spring):
    """Between equal steps the interpolant errs with h^5 a step: order 4 over the motion or more."""
    steps = np.array([20, 40, 80, 160])
    errors = [
        error_at_samples(spring, 1e6, dt=4.0 / n, every=4.0 / n / 3.0, force=True) for n in steps
    ]
    assert observed_order(4.0 / steps, errors) > 3.9


def test_steps_are_counted_and_stored(spring):
    motion = fd.simulate(spring, 4.0, "dormand_prince", initial=released(0.1), every=3)
    t, a = motion.time.to_numpy(), motion.attrs
    assert len(t) == a["steps"] // 3 + 1
    assert np.diff(t).max() <= 3 * a["largest_step"] * (1 + 1e-12)
    assert a["smallest_step"] < a["largest_step"] <= fd.critical_step(spring, "dormand_prince")
    assert a["force_evaluations"] >= 6 * a["steps"]
    whole = fd.simulate(spring, 4.0, "dormand_prince", initial=released(0.1))
    assert float(whole.time[-1]) == 4.0
    np.testing.assert_array_equal(whole.time[::3], t)


def test_a_step_ends_where_a_pulse_ends():
    """The load jumps between two steps: the motion after it is right, and no step is wasted."""
    case = oscillator(linear_law(), MASS * OMEGA**2)
    load = fd.Force([1], (1.0, 0.0, 0.0), fd.Pulse(duration=0.777))
    case = fd.Case(case.structure, case.supports, [load])
    motion = fd.simulate(case, 2.0, "dormand_prince", tolerance=1e-9)
    t, x = motion.time.to_numpy(), motion.displacement[:, 1, 0].to_numpy()
    static = 1.0 / (MASS * OMEGA**2)
    exact = static * (1.0 - np.cos(OMEGA * t))
    exact -= np.where(t > 0.777, static * (1.0 - np.cos(OMEGA * (t - 0.777))), 0.0)
    np.testing.assert_allclose(x, exact, atol=1e-7 * static)
    assert np.abs(t - 0.777).min() == 0.0
    assert motion.attrs["refused_steps"] <= 2


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "rk4", "tolerance": 1e-6}, "rk4 has fixed steps"),
        ({"method": "dormand_prince", "tolerance": 0.0}, "tolerance = 0.0"),
        ({"method": "dormand_prince", "tolerance": "fine"}, "tolerance"),
        ({"method": "dormand_prince", "dt": 10.0}, "longer than the duration"),
        ({"method": "dormand_prince", "every": 9.0}, "longer than the duration"),
        ({"method": "dormand_prince", "every": 0}, "at least 1"),
        ({"method": "rk4", "start": float("nan")}, "start = nan"),
    ],
)
def test_bad_arguments(spring, options, message):
    with pytest.raises(fd.errors.InputError, match=message):
        fd.simulate(spring, 2.0, **options)


@pytest.mark.parametrize("law", ["superlinear", fd.Plastic(2e-3, 0.01)], ids=["", "yields"])
@pytest.mark.parametrize("preset", ["plate", "n5b8e"])
def test_moments_that_jump_do_the_work_that_is_stored_and_lost(preset, law):
    """Also in a sample at the jump."""
    sheet = fd.Sheet(1e6, 0.25, 0.01, 1.0)
    fold = fd.patterns.simple_fold(1, 1, dihedral=120)
    made = fd.discretize(fold, sheet, preset=preset, crease_stiffness=0.2, fold_law=law)
    jump = fd.CreaseMoment("all", 0.05, fd.Pulse(0.1))
    case = fd.Case(made, [fd.Fix([0, 1, 2, 3])], [jump], damping=fd.Rayleigh(0.1))
    motion = fd.simulate(case, 0.2, "dormand_prince", every=0.05, tolerance=1e-7)
    assert motion.attrs["energy_error"] < 3e-6


def test_the_work_of_an_angle_that_stops_turning_where_the_motion_ends():
    sheet = fd.Sheet(1e6, 0.25, 0.01, 1.0)
    made = fd.discretize(fd.patterns.simple_fold(1, 1, dihedral=120), sheet, crease_stiffness=0.2)
    turn = fd.Actuate("all", 115.0, fd.Ramp(0.1))
    case = fd.Case(made, [fd.Fix([0, 1, 2, 3])], [turn])
    motion = fd.simulate(case, 0.1, "dormand_prince")
    assert motion.attrs["energy_error"] < 1e-6
