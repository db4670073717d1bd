"""Steps that methods choose: error control, samples, dense output, jumps of loads, statistics."""

from __future__ import annotations

from contextlib import nullcontext

import numpy as np
import pytest
from measured import order
from moving_sheets import IMPLICIT, SHEET, case2, fold, spinning
from oscillators import MASS, after_pulse, place, pulled, released, spring
from scipy.integrate import RK45

import foldyn as fd
from foldyn.dynamics import dormand_prince
from foldyn.errors import FoldynWarning

OMEGA = 4.0
SPRING, START = spring(OMEGA), released(0.1)
STATIC = 1.0 / (MASS * OMEGA**2)  # m/N
DP = "dormand_prince"


def swung(method: str, **options):
    """A motion of two and a half periods, and its error."""
    motion = fd.simulate(SPRING, 4.0, method=method, initial=START, **options)
    return motion, np.abs(place(motion) - 0.1 * np.cos(OMEGA * motion.time.values)).max()


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("method", "tolerance", "power", "near", "error"),
    [
        *((method, [1e-4, 1e-5, 1e-6], 2.0 / 3.0, 0.12, 1e-3) for method in IMPLICIT),
        (DP, [1e-5, 1e-6, 1e-7, 1e-8], 1.0, 0.15, 2e-6),
    ],
)
def test_the_error_follows_the_tolerance(method, tolerance, power, near, error):
    """The step grows with a root of the tolerance by the order: the error with its power."""
    found = [swung(method, tolerance=tol, force=True) for tol in tolerance]
    errors = [each[1] for each in found]
    assert fd.checks.observed_order(tolerance, errors) == pytest.approx(power, abs=near)
    assert errors[1] < error
    if method in IMPLICIT:
        steps = found[1][0].attrs["steps"]
        assert 100 < steps / (4.0 * OMEGA / (2.0 * np.pi)) < 200  # see docs/integrators.md
        default = swung(method)[0]
        assert default.attrs["tolerance"] == 1e-5 and default.attrs["steps"] == steps


@pytest.mark.matrix
@pytest.mark.parametrize("method", IMPLICIT)
def test_steps_grow_where_the_motion_is_smooth(method):
    """A vibration that has died out under a slow load: few steps for a long time."""
    case = pulled(spring(OMEGA, alpha=4.0), 1.0, fd.Ramp(duration=40.0, smooth=True))
    motion = fd.simulate(case, 40.0, method=method, initial=START)
    t = motion.time.values
    assert (t < 4.0).sum() > 2 * (t > 20.0).sum()
    assert len(t) < 0.4 * 40.0 * OMEGA / (2.0 * np.pi) * 130
    assert place(motion)[-1] == pytest.approx(STATIC, rel=1e-4)


@pytest.mark.parametrize(
    ("method", "interval", "options", "near"),
    [
        *((DP, interval, {"tolerance": 1e-8}, 2e-8) for interval in (0.01, 0.037, 0.4)),
        ("newmark", 0.01, {}, 4e-4),
        ("newmark", 0.37, {}, 4e-4),
    ],
)
def test_samples_in_seconds(method, interval, options, near):
    """At the times asked for, as accurate as the steps: by dense output, or steps end there."""
    motion, error = swung(method, interval=interval, **options)
    t = motion.time.values
    np.testing.assert_allclose(t, np.arange(len(t)) * interval, rtol=1e-12)
    assert t[-1] > 4.0 - interval - 1e-9 and motion.attrs["interval"] == interval
    assert error < near
    v = motion.velocity.values[:, 1, 0]
    assert np.abs(v + 0.1 * OMEGA * np.sin(OMEGA * t)).max() < 10 * near
    steps = motion.attrs["steps"]
    if method == DP:
        assert motion.attrs["energy_error"] < 1e-6
        assert steps == swung(method, **options)[0].attrs["steps"]  # samples do not move them
    else:
        assert steps >= len(t) - 1


@pytest.mark.matrix
@pytest.mark.parametrize("options", [{"method": DP}, {"method": "newmark", "tolerance": 1e-7}])
def test_samples_by_steps(options):
    """Each so many accepted steps, the room for them growing as needed."""
    whole, third = (swung(every_steps=steps, **options)[0] for steps in (1, 3))
    assert float(whole.time[-1]) == 4.0
    assert whole.sizes["time"] == whole.attrs["steps"] + 1
    np.testing.assert_array_equal(third.time, whole.time[::3])
    np.testing.assert_array_equal(third.displacement, whole.displacement[::3])
    a = third.attrs
    assert np.diff(third.time).max() <= 3 * a["largest_step"] * (1 + 1e-12)
    assert a["smallest_step"] < a["largest_step"]
    if options["method"] == DP:
        assert a["largest_step"] <= fd.critical_step(SPRING, DP)
        assert a["force_evaluations"] >= 6 * a["steps"]
    bounded = swung("newmark", dt=0.02, tolerance=1e-3)[0]
    assert bounded.attrs["largest_step"] <= 0.02 * (1.0 + 1e-9)


def test_order_of_the_interpolant():
    """Between equal steps the interpolant errs with h^5 a step: order 4 over the motion or more."""
    steps = [20, 40, 80, 160]
    equal = {"tolerance": 1e6, "force": True}
    errors = [swung(DP, dt=4.0 / n, interval=4.0 / n / 3.0, **equal)[1] for n in steps]
    assert order(steps, errors) > 3.9


@pytest.mark.parametrize("method", [*IMPLICIT, DP])
def test_a_load_that_jumps_within_a_step(method):
    """A pulse that ends anywhere: steps end there, and the order stays 2, fixed step or not."""
    case = pulled(SPRING, 1.0, fd.Pulse(duration=0.777))

    def run(duration=2.0, **options):
        motion = fd.simulate(case, duration, method=method, **options)
        return motion, np.abs(place(motion) - after_pulse(motion.time.values, OMEGA, 0.777)).max()

    adaptive, error = run(**({"tolerance": 1e-9} if method == DP else {}))
    assert error < (1e-7 if method == DP else 4e-3) * STATIC
    assert np.abs(adaptive.time - 0.777).min() < 1e-12
    if method == DP:
        assert adaptive.attrs["refused_steps"] <= 2
        return
    steps = [50, 100, 200]
    assert order(steps, [run(dt=2.0 / n)[1] for n in steps]) == pytest.approx(2.0, abs=0.1)
    on_a_step, error = run(0.777, dt=0.777 / 100)
    assert error < 2e-3 * STATIC
    assert on_a_step.attrs["energy_error"] < 1e-4


@pytest.mark.parametrize("method", IMPLICIT)
def test_two_jumps_within_a_nanosecond_are_one(method):
    """Of the step between them rounding leaves what a step of usual length would not have."""
    push, jump = case2(fd.Constant()).loads[0], 0.0817
    one = case2().altered(loads=[push, fd.Force([7], (0.001, 0, 0), fd.Step(jump))])
    halves = [fd.Force([7], (5e-4, 0, 0), fd.Step(jump - late)) for late in (0.0, 4e-11)]
    found = [
        fd.simulate(case, 0.1, method=method, dt=0.01, every_steps=10).displacement.values[-1]
        for case in (one, one.altered(loads=[push, *halves]))
    ]
    np.testing.assert_allclose(*found, rtol=0, atol=1e-7 * np.abs(found[0]).max())


@pytest.mark.matrix
def test_statistics_travel_with_the_result(tmp_path):
    motion = fd.simulate(
        case2(), 0.5, method="generalized_alpha", interval=0.1, spectral_radius=0.5
    )
    fd.save(motion, tmp_path / "run.nc")
    a = fd.load(tmp_path / "run.nc").attrs
    wanted = {"critical_step": np.inf, "spectral_radius": 0.5, "halved_steps": 0}
    assert {name: a[name] for name in wanted} == wanted
    assert a["linear_solver"] == "banded"
    assert 0 < a["factorizations"] <= a["iterations"] >= a["steps"]
    same = {name: a[name] for name in ("method", "spectral_radius", "tolerance")}
    again = fd.simulate(fd.case_of(motion), 0.5, interval=0.1, **same)
    np.testing.assert_allclose(again.displacement, motion.displacement, rtol=0, atol=1e-12)


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:the energy balance")
def test_steps_on_which_newton_fails_are_halved_and_counted():
    """A spinning soft sheet with a tenth of a radian a step: some steps are taken in parts."""
    paper = fd.Sheet(1.219e9, 0.2, 0.24e-3, 667.0, length_scale_ratio=2.7)
    pattern = fd.patterns.miura((2, 1), 0.025, b=0.025, dihedral=90)
    s = fd.discretize(pattern, paper, bend_law="linear", preset="herkal")
    start = spinning(s, (2.0, 80.0, 1.5))
    motion = fd.simulate(fd.Case(s), 0.4, method="energy_momentum", dt=4e-3, initial=start)
    assert 0 < motion.attrs["halved_steps"] <= 100
    np.testing.assert_allclose(motion.time, 4e-3 * np.arange(101), rtol=1e-12)
    assert motion.attrs["energy_error"] < 1e-9


# ------------------------------------------------------------------ Dormand and Prince
def test_coefficients_are_those_of_scipy_and_fulfil_their_conditions():
    """SciPy writes the same pair, with the last row of A apart and the error with its sign."""
    a, c = dormand_prince.A, dormand_prince.C
    np.testing.assert_array_equal(a[:6, :5], RK45.A)
    np.testing.assert_array_equal(a[6], RK45.B)
    np.testing.assert_array_equal(c[:6], RK45.C)
    np.testing.assert_allclose(np.abs(dormand_prince.E), np.abs(RK45.E), rtol=1e-15)
    np.testing.assert_array_equal(dormand_prince.P, RK45.P)
    np.testing.assert_allclose(a.sum(axis=1), c, atol=1e-15)
    np.testing.assert_allclose(dormand_prince.E.sum(), 0.0, atol=1e-15)


@pytest.mark.matrix
@pytest.mark.parametrize("law", ["superlinear", fd.Plastic(2e-3, 0.01)], ids=["", "yields"])
@pytest.mark.parametrize("preset", ["plate", "n5b8e"])
def test_moments_that_jump_do_the_work_that_is_stored_and_lost(preset, law):
    """Also in a sample at the jump, which sets creases of n5b8e swinging, as a warning says."""
    tolerance = 1e-10 if preset == "n5b8e" else 1e-7
    told = pytest.warns(FoldynWarning, match="their turns have an inertia")
    made = fold(120, preset=preset, crease_stiffness=0.2, fold_law=law)
    jump = fd.CreaseMoment("all", 0.05, fd.Pulse(0.1))
    case = fd.Case(made, [fd.Fix([0, 1, 2, 3])], [jump], damping=fd.Rayleigh(0.1))
    with told if preset == "n5b8e" else nullcontext():
        motion = fd.simulate(case, 0.2, method=DP, interval=0.05, tolerance=tolerance)
    assert motion.attrs["energy_error"] < 3e-6


def test_the_work_of_an_angle_that_stops_turning_where_the_motion_ends():
    made = fd.discretize(
        fd.patterns.simple_fold(dihedral=120), SHEET, crease_stiffness=0.2, preset="plate"
    )
    case = fd.Case(made, [fd.Fix([0, 1, 2, 3])], [fd.Actuate("all", 115.0, fd.Ramp(0.1))])
    assert fd.simulate(case, 0.1, method=DP).attrs["energy_error"] < 1e-6
