"""Steps of implicit methods: error control, samples, jumps of loads, failures, continuation."""

from __future__ import annotations

import numpy as np
import pytest
from oscillators import MASS, duffing_law, linear_law, oscillator, released

import foldyn as fd
from foldyn.checks import observed_order
from foldyn.dynamics import METHODS
from foldyn.errors import (
    InputError,
    InstabilityError,
    MotionInterrupted,
    PenetrationError,
)

IMPLICIT = [name for name, method in METHODS.items() if method.implicit]
OMEGA = 4.0
SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)
SUPPORTS = (fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y"))


@pytest.fixture(scope="module")
def spring() -> fd.Case:
    return oscillator(linear_law(), MASS * OMEGA**2)


def case2(history=None, alpha: float = 0.0628, beta: float = 0.0, **options) -> fd.Case:
    """Case study 2 of Herkal et al. (supports, pulse and damping: our assumptions)."""
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    load = fd.Force([7], (0.01, 0.0, 0.0), history or fd.HalfSine(duration=0.5))
    s = fd.discretize(pattern, SHEET, **options, preset="herkal")
    return fd.Case(s, SUPPORTS, [load], fd.Rayleigh(alpha, beta))


@pytest.mark.parametrize("method", IMPLICIT)
def test_the_error_follows_the_tolerance(spring, method):
    """Steps go with the cube root of the tolerance, so the error with its power 2/3."""
    tolerance, errors, steps = np.array([1e-4, 1e-5, 1e-6]), [], []
    for each in tolerance:
        motion = fd.simulate(spring, 4.0, method, tolerance=each, initial=released(0.1))
        exact = 0.1 * np.cos(OMEGA * motion.time.to_numpy())
        errors.append(float(np.abs(motion.displacement[:, 1, 0].to_numpy() - exact).max()))
        steps.append(motion.attrs["steps"])
    assert observed_order(tolerance, errors) == pytest.approx(2.0 / 3.0, abs=0.12)
    assert errors[1] < 0.01 * 0.1  # two and a half periods
    periods = 4.0 * OMEGA / (2.0 * np.pi)
    assert 100 < steps[1] / periods < 200  # the default: see docs/integrators.md
    default = fd.simulate(spring, 4.0, method, initial=released(0.1))
    assert default.attrs["tolerance"] == 1e-5
    assert default.attrs["steps"] == steps[1]


@pytest.mark.parametrize("method", IMPLICIT)
def test_steps_grow_where_the_motion_is_smooth(method):
    """A vibration that has died out under a slow load: few steps for a long time."""
    case = oscillator(linear_law(), MASS * OMEGA**2, alpha=4.0)
    pull = fd.Force([1], (1.0, 0.0, 0.0), fd.Ramp(duration=40.0, smooth=True))
    case = fd.Case(case.structure, case.supports, [pull], case.damping)
    motion = fd.simulate(case, 40.0, method, initial=released(0.1))
    t = motion.time.to_numpy()
    assert (t < 4.0).sum() > 2 * (t > 20.0).sum()
    assert len(t) < 0.4 * 40.0 * OMEGA / (2.0 * np.pi) * 130
    static = 1.0 / (MASS * OMEGA**2)
    assert float(motion.displacement[-1, 1, 0]) == pytest.approx(static, rel=1e-4)


@pytest.mark.parametrize("every", [0.01, 0.37])
def test_samples_in_seconds(spring, every):
    """Steps end at the times asked for; the states are those of the method."""
    motion = fd.simulate(spring, 4.0, "newmark", every=every, initial=released(0.1))
    t = motion.time.to_numpy()
    np.testing.assert_allclose(t, every * np.arange(int(4.0 / every + 1e-9) + 1), rtol=1e-12)
    exact = 0.1 * np.cos(OMEGA * t)
    np.testing.assert_allclose(motion.displacement[:, 1, 0], exact, atol=4e-4)
    assert motion.attrs["steps"] >= len(t) - 1
    assert motion.attrs["every"] == every


def test_samples_by_steps(spring):
    """Each so many accepted steps, the room for them growing as needed."""
    whole = fd.simulate(spring, 4.0, "newmark", tolerance=1e-7, initial=released(0.1))
    third = fd.simulate(spring, 4.0, "newmark", tolerance=1e-7, every=3, initial=released(0.1))
    assert float(whole.time[-1]) == 4.0
    assert whole.sizes["time"] == whole.attrs["steps"] + 1
    np.testing.assert_array_equal(third.time, whole.time[::3])
    np.testing.assert_array_equal(third.displacement, whole.displacement[::3])
    largest = fd.simulate(
        spring, 4.0, "newmark", dt=0.02, tolerance=1e-3, initial=released(0.1)
    )  # dt bounds the steps
    assert largest.attrs["largest_step"] <= 0.02 * (1.0 + 1e-9)


@pytest.mark.parametrize("method", IMPLICIT)
def test_a_load_that_jumps_within_a_step(method):
    """A pulse that ends anywhere: steps end there, and the order stays 2, fixed step or not."""
    case = oscillator(linear_law(), MASS * OMEGA**2)
    load = fd.Force([1], (1.0, 0.0, 0.0), fd.Pulse(duration=0.777))
    case = fd.Case(case.structure, case.supports, [load])
    static = 1.0 / (MASS * OMEGA**2)

    def error(motion) -> float:
        t = motion.time.to_numpy()
        exact = static * (1.0 - np.cos(OMEGA * t))
        exact -= np.where(t > 0.777, static * (1.0 - np.cos(OMEGA * (t - 0.777))), 0.0)
        return float(np.abs(motion.displacement[:, 1, 0].to_numpy() - exact).max())

    steps = np.array([50, 100, 200])
    errors = [error(fd.simulate(case, 2.0, method, dt=2.0 / n)) for n in steps]
    assert observed_order(2.0 / steps, errors) == pytest.approx(2.0, abs=0.1)
    adaptive = fd.simulate(case, 2.0, method)
    assert error(adaptive) < 4e-3 * static
    assert np.isclose(adaptive.time, 0.777, rtol=0, atol=1e-12).any()
    on_a_step = fd.simulate(case, 0.777, method, dt=0.777 / 100)
    assert error(on_a_step) < 2e-3 * static
    assert on_a_step.attrs["energy_error"] < 1e-4


@pytest.mark.parametrize("method", IMPLICIT)
def test_a_motion_goes_on_from_where_it_was_stored(method):
    """Continued at `start` with the stored state, moving supports included.

    The generalized-alpha method also carries an acceleration of its own, which a state has not:
    there the difference falls with the square of the step.
    """
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    s = fd.discretize(
        pattern,
        fd.Sheet(1e6, 0.25, 0.01, 1000.0),
        bend_law="linear",
        fold_law="linear",
        preset="herkal",
    )
    pull = fd.Impose([6, 7, 8], "x", 1e-3, lambda t: np.sin(300.0 * t))
    case = fd.Case(s, [*SUPPORTS, pull, fd.BaseMotion("z", fd.Harmonic(40.0), 1e-4)])
    differences = []
    for n in (200, 400):
        whole = fd.simulate(case, 0.02, method, dt=0.02 / n, every=n // 20)
        middle = fd.initial_state(whole, at=10)
        rest = fd.simulate(
            case, 0.01, method, dt=0.02 / n, every=n // 20, initial=middle, start=0.01
        )
        np.testing.assert_allclose(rest.time, whole.time[10:], rtol=1e-14)
        scale = float(np.abs(whole.displacement).max())
        differences.append(float(np.abs(rest.displacement - whole.displacement[10:]).max()) / scale)
    if method == "generalized_alpha":
        assert differences[1] < 1e-3
        assert differences[0] / differences[1] > 3.0
    else:
        assert max(differences) < 1e-7


def test_runs_are_bit_identical_whatever_is_sampled():
    case = case2()
    for method in IMPLICIT:
        dense = fd.simulate(case, 0.5, method, dt=2.5e-3)
        again = fd.simulate(case, 0.5, method, dt=2.5e-3)
        thin = fd.simulate(case, 0.5, method, dt=2.5e-3, every=7)
        np.testing.assert_array_equal(again.displacement, dense.displacement)
        np.testing.assert_array_equal(thin.displacement, dense.displacement[::7])
        np.testing.assert_array_equal(thin.work, dense.work[::7])


def test_statistics_travel_with_the_result(tmp_path):
    motion = fd.simulate(case2(), 0.5, "generalized_alpha", every=0.1, spectral_radius=0.5)
    fd.save(motion, tmp_path / "run.nc")
    a = fd.load(tmp_path / "run.nc").attrs
    assert a["critical_step"] == np.inf
    assert a["spectral_radius"] == 0.5
    assert a["iterations"] >= a["steps"]
    assert 0 < a["factorizations"] <= a["iterations"]
    assert a["linear_solver"] == "banded"
    assert a["halved_steps"] == 0
    again = fd.simulate(
        fd.case_of(motion), 0.5, a["method"], every=0.1, spectral_radius=a["spectral_radius"],
        tolerance=a["tolerance"],
    )  # fmt: skip
    np.testing.assert_allclose(again.displacement, motion.displacement, rtol=0, atol=1e-12)


@pytest.mark.filterwarnings("ignore:the energy balance")
def test_steps_on_which_newton_fails_are_halved_and_counted():
    """A spinning soft sheet with a tenth of a radian a step: some steps are taken in parts."""
    pattern = fd.patterns.miura(cells=(2, 1), a=0.025, b=0.025, panel_angle=60, dihedral=90)
    paper = fd.Sheet(1.219e9, 0.2, 0.24e-3, 667.0, length_scale_ratio=2.7)
    s = fd.discretize(pattern, paper, bend_law="linear", preset="herkal")
    x = s.nodes - s.nodes.mean(axis=0)
    state = fd.State(velocity=np.cross([2.0, 80.0, 1.5], x))
    motion = fd.simulate(fd.Case(s), 0.4, "energy_momentum", dt=4e-3, initial=state)
    assert 0 < motion.attrs["halved_steps"] <= 100
    np.testing.assert_allclose(motion.time, 4e-3 * np.arange(101), rtol=1e-12)
    assert motion.attrs["energy_error"] < 1e-9


@pytest.mark.filterwarnings("ignore:the energy balance")
@pytest.mark.parametrize("options", [{"dt": 2e-3}, {"tolerance": 1e-4}])
@pytest.mark.parametrize("method", IMPLICIT)
def test_panels_that_pass_through_each_other_stop_the_motion(method, options):
    """Linear folds do not lock: a fold that is driven shut passes through, and says so."""
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    structure = fd.discretize(pattern, SHEET, fold_law="linear", preset="herkal")
    v = np.zeros(structure.nodes.shape)
    v[[0, 1], 0], v[[4, 5], 0] = 10.0, -10.0
    with pytest.raises(PenetrationError, match="panel passed through panel") as caught:
        fd.simulate(fd.Case(structure), 2.0, method, initial=fd.State(velocity=v), **options)
    folds, _ = structure.dihedrals(caught.value.partial.displacement[-1])
    assert folds[0] > np.radians(300)


@pytest.mark.filterwarnings("ignore:the history of a load is a function")
@pytest.mark.parametrize("options", [{"dt": 0.01}, {"every": 0.01}])
@pytest.mark.parametrize("method", IMPLICIT)
def test_what_goes_wrong_is_named_and_the_motion_until_then_kept(method, options):
    bad = case2(lambda t: np.where(t > 0.3, np.nan, 1.0))
    with pytest.raises(InstabilityError, match="finite number at every time") as caught:
        fd.simulate(bad, 1.0, method, **options)
    assert 0.0 < float(caught.value.partial.time[-1]) <= 0.31

    def broken(t):
        if t > 0.3:
            raise ArithmeticError("no load is known beyond 0.3 s")
        return 1.0

    with pytest.raises((InstabilityError, ArithmeticError), match=r"beyond 0\.3 s"):
        fd.simulate(case2(broken), 1.0, method, **options)

    def stop(state):
        if state.time > 0.2:
            raise KeyboardInterrupt

    with pytest.raises(MotionInterrupted) as interrupted:
        fd.simulate(case2(), 5.0, method, progress=stop, **options)
    assert 0.2 < float(interrupted.value.partial.time[-1]) < 5.0


def test_a_node_that_nothing_holds_and_nothing_slows_is_refused():
    pattern = fd.Pattern([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [3, 3, 0]], [[0, 1, 2, 3]])
    structure = fd.discretize(pattern, SHEET, preset="herkal")
    push = fd.Force([4], (1.0, 0.0, 0.0))
    with pytest.raises(InstabilityError, match="a mass or a stiffness may be missing"):
        fd.simulate(fd.Case(structure, [], [push]), 0.1, "newmark")
    structure = fd.discretize(pattern, SHEET, mass="consistent", preset="herkal")
    with pytest.raises(InputError, match="node 4 is free but has no mass"):
        fd.simulate(fd.Case(structure), 0.1, "newmark")


def test_stiffening_needs_no_smaller_step_to_be_stable():
    """What stops an explicit run at 0.99 of its critical step is followed here."""
    case = oscillator(duffing_law(1e3), 8.0)
    motion = fd.simulate(case, 4.0, "energy_momentum", dt=0.01, initial=released(0.0, speed=20.0))
    assert motion.attrs["energy_error"] < 1e-9
    assert float(np.abs(motion.velocity).max()) < 20.5


def test_progress_is_told():
    seen = []
    fd.simulate(case2(), 1.0, "newmark", every=0.1, progress=seen.append)
    times = [state.time for state in seen]
    assert times == sorted(times)
    assert times[-1] == pytest.approx(1.0)


@pytest.mark.parametrize("method", IMPLICIT)
def test_two_jumps_within_a_nanosecond_are_one(method):
    """Of the step between them rounding leaves what a step of usual length would not have."""
    push, jump = case2(fd.Constant()).loads[0], 0.0817
    one = case2(fd.Step(jump)).altered(loads=[push, fd.Force([7], (0.001, 0, 0), fd.Step(jump))])
    halves = [fd.Force([7], (5e-4, 0, 0), fd.Step(jump - late)) for late in (0.0, 4e-11)]
    found = [
        fd.simulate(case, 0.1, method, dt=0.01, every=10).displacement.values[-1]
        for case in (one, one.altered(loads=[push, *halves]))
    ]
    np.testing.assert_allclose(*found, rtol=0, atol=1e-7 * np.abs(found[0]).max())
