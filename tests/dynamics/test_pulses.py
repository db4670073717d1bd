"""No pulse is lost: what a load puts in is what arrives, whatever the method and its steps."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from measured import apart
from moving_sheets import IMPLICIT, SHEET, fold
from oscillators import MASS, place, pulled, spring
from scipy.integrate import quad

import foldyn as fd
from foldyn.cases import Function
from foldyn.dynamics import METHODS
from foldyn.errors import FoldynWarning, InputError, InstabilityError
from pairwise import beyond

OMEGA = 4.0
SPRING, PERIOD = spring(OMEGA), 2.0 * np.pi / OMEGA
ADAPTIVE = [name for name, method in METHODS.items() if method.adaptive or method.implicit]
SOME = [*ADAPTIVE[:2], *beyond(ADAPTIVE[2:])]
SHELLS = [name for name, method in METHODS.items() if method.implicit]
# With the default tolerance there are 127 steps in a period, whose relative error is then
# (2 pi/127)^2/12: over 20 rad the phase is off by 4e-3
GLOBAL = 5e-3
SHAPES = {
    "triangle": ([0, 0.5, 1], [0, 1, 0]),
    "half_sine": (np.linspace(0, 1, 41), np.sin(np.pi * np.linspace(0, 1, 41))),
    "box": ([0, 1e-3, 1 - 1e-3, 1], [0, 1, 1, 0]),
    "skew": ([0, 0.1, 1], [0, 1, 0]),
    "burst": (np.linspace(0, 1, 9), [0, 1, 0, -1, 0, 1, 0, -0.5, 0]),
}


def pulse(shape: str, begin: float, length: float, **options) -> fd.Table:
    """A pulse of height 1 as a table; before and after it the load is zero."""
    x, y = SHAPES[shape]
    return fd.Table(begin + length * np.asarray(x, float), y, **options)


def pushed(history, force: float = 1.0) -> fd.Case:
    """The oscillator under a force of 1 N times the history."""
    return pulled(SPRING, force, history)


def duhamel(history: fd.Table, times) -> np.ndarray:
    """Displacement of the oscillator from rest, by quadrature piece by piece of the table."""

    def pushes(s, t):
        return float(history(s)) * np.sin(OMEGA * (t - s))

    def pieces(t):
        for a, b in zip(history.times[:-1], np.minimum(history.times[1:], t), strict=True):
            if b > a:
                yield quad(pushes, a, b, (t,), epsrel=1e-9)[0]

    return np.array([sum(pieces(t)) for t in times]) / (MASS * OMEGA)


def error(motion, exact) -> float:
    return np.abs(place(motion) - exact).max() / np.abs(exact).max()


def tried(case, duration, method, **options):
    """The motion, None if it was stopped, and whether it was said that steps are too coarse."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            motion = fd.simulate(case, duration, method=method, **options)
        except InstabilityError:  # the work of a pulse that is not resolved is nonsense
            motion = None
    return motion, any("do not resolve" in str(one.message) for one in told)


def random_pulses(count: int, seed: int):
    """Shapes, arrivals and lengths from 1e-4 to 1 of the period."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        length = PERIOD * 10.0 ** rng.uniform(-4, 0)
        yield pulse(str(rng.choice([*SHAPES])), float(rng.uniform(0.0, 2.0)), length)


@pytest.mark.parametrize("method", beyond([*METHODS, "auto"], 2))
def test_random_pulses_on_an_oscillator_at_rest(method):
    """The response is Duhamel's integral to the tolerance, or the method says that it is not."""
    for history in random_pulses(6, seed=20):
        motion, told = tried(pushed(history), 5.0, method, interval=0.25)
        assert not (told and method in ADAPTIVE)  # they need no excuse
        if not told:
            exact = duhamel(history, motion.time.values)
            assert error(motion, exact) < (GLOBAL if method in ADAPTIVE else 1.5e-2), history


@pytest.mark.matrix
@pytest.mark.parametrize("method", SOME)
def test_random_pulses_on_a_moving_oscillator(method):
    """The same for pulses that arrive while it swings: superposition holds."""
    swing = fd.State(velocity=[[0, 0, 0], [0.3, 0, 0]])
    for history in random_pulses(6, seed=21):
        motion = fd.simulate(pushed(history), 5.0, method=method, interval=0.25, initial=swing)
        t = motion.time.values
        exact = duhamel(history, t) + 0.3 / OMEGA * np.sin(OMEGA * t)
        assert error(motion, exact) < 2.0 * GLOBAL, history


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("kind", "method"),
    [*(("bars", name) for name in METHODS), *beyond([("shell", name) for name in SHELLS], 3)],
)
def test_the_impulse_arrives_on_a_free_sheet(kind, method):
    """Momentum after the pulse = the pulse's integral, whatever bends and swings meanwhile."""
    bars = fold(mass="circumcenter")
    s = bars if kind == "bars" else fd.shell(bars.pattern, SHEET, divisions=2)
    rng, tolerance = np.random.default_rng(3), 1e-4 if method in IMPLICIT else None
    for shape in ("triangle", "half_sine", "box"):
        length = 0.5 * 10.0 ** rng.uniform(-4, -1)
        history = pulse(shape, float(rng.uniform(0.05, 0.2)), length)
        case = fd.Case(s, [], [fd.Force([0, 1, 2], (1e-4, 0.0, 2e-4), history)])
        motion, told = tried(case, 0.5, method, interval=0.5, tolerance=tolerance)
        assert not (told and method in ADAPTIVE)
        if not told:
            momentum = (s.mass @ motion.velocity.values[-1]).sum(axis=0)
            impulse = 3.0 * np.trapezoid(history.values, history.times)
            assert apart(momentum, impulse * np.array([1e-4, 0.0, 2e-4])) < 1e-2, shape


@pytest.mark.matrix
@pytest.mark.parametrize("method", SOME)
def test_supports_and_folds_that_move_for_a_moment(method):
    """A support that goes forth and back, and a fold that is actuated and let go, are seen."""
    s = fold(mass="circumcenter")
    bump = pulse("half_sine", 0.3, 4e-3, smooth=True)  # actuators' power must not jump
    base, rollers = fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")
    push = fd.Impose([0, 1], "x", -1e-2, bump)
    moved = fd.Case(s, [base, fd.Fix([0, 1], "yz"), push])
    based = fd.Case(s, [base, rollers, fd.BaseMotion("x", bump, 1e-2)])
    turned = fd.Case(s, [base], [fd.Actuate("all", angle=290.0, history=bump)])
    for case in (moved, based, turned):
        true, found = (
            fd.simulate(case, 0.4, method=name, interval=0.02, dt=dt).displacement.values[16:]
            for name, dt in (("rk4", 2.5e-5), (method, None))
        )
        assert apart(found, true) < 0.02


@pytest.mark.matrix
def test_steps_end_at_knots():
    """Beginnings, corners and ends of all histories; sharp corners of tables only."""
    tap = fd.Table([0.0, 0.31, 0.32, 0.33], [0, 0, 1, 0])
    case = pulled(pushed(tap), 0.5, fd.HalfSine(duration=0.57))
    for method in ADAPTIVE:
        times = fd.simulate(case, 1.0, method=method, every_steps=1).time.values
        for knot in (0.31, 0.32, 0.33, 0.57):
            assert np.abs(times - knot).min() < 1e-12, (method, knot)
    curve = np.linspace(0.0, 1.0, 401)
    assert fd.Table(curve, np.sin(2 * np.pi * curve)).knots() == (0.0, 1.0)
    assert fd.Table(curve, np.sin(2 * np.pi * curve), smooth=True).knots() == (0.0, 1.0)
    assert fd.Table([0, 1, 2, 3], [0, 1, 2, 0]).knots() == (0.0, 2.0, 3.0)
    assert fd.Ramp(2.0).knots() == (0.0, 2.0)
    assert fd.Harmonic(3.0).knots() == ()


@pytest.mark.matrix
@pytest.mark.parametrize("method", [*IMPLICIT[:1], *beyond(IMPLICIT[1:])])
def test_periods_that_fit_the_steps_are_not_lost(method):
    """A hum whose period divides every step that would be tried first, from rest."""
    motion = fd.simulate(pushed(fd.Harmonic(frequency=50.0)), 1.0, method=method, interval=0.25)
    t, fast = motion.time.values, 2.0 * np.pi * 50.0
    exact = np.sin(fast * t) - fast / OMEGA * np.sin(OMEGA * t)
    assert error(motion, exact / (MASS * (OMEGA**2 - fast**2))) < GLOBAL


def test_slow_loads_still_take_few_steps():
    """What the load does within a step costs no steps where it is slow and smooth."""
    case = pulled(spring(OMEGA, alpha=4.0), 1.0, fd.Ramp(duration=400.0, smooth=True))
    assert fd.simulate(case, 400.0, method="newmark").attrs["steps"] < 600


@pytest.mark.matrix
@pytest.mark.parametrize("method", ["rk4", "central_difference", *IMPLICIT])
def test_fixed_steps_that_miss_a_pulse_say_so(method):
    """Half-sine of one step, harmonic of a whole period a step; none for what they resolve."""
    for history in (
        fd.Table([0.0, 0.5, 0.505, 0.51], [0, 0, 1, 0]),
        fd.Table([0.0, 1.0002, 1.0004, 1.0006], [0, 0, 1, 0]),
        fd.Harmonic(frequency=100.0),
        Function(lambda t: float(0.5 < t < 0.501), at=[0.5, 0.501]),
    ):
        assert tried(pushed(history), 2.0, method, dt=0.01)[1]
    slow = (fd.HalfSine(0.5), fd.Pulse(0.777), fd.Ramp(1.0), fd.Harmonic(2.0), fd.Step(0.3))
    for history in slow:
        fd.simulate(pushed(history), 2.0, method=method, dt=0.01)  # silent


def test_a_half_sine_as_long_as_the_fixed_step_says_so():
    with pytest.warns(FoldynWarning, match="half_sine of a load"):
        motion = fd.simulate(pushed(fd.HalfSine(0.01)), 1.0, method="newmark", dt=0.01)
    assert float(np.abs(motion.displacement).max()) == 0.0  # the fault that the warning names


def test_long_motions_are_looked_at_about_their_knots():
    """Too many steps to look at each: a pulse in the middle is found all the same."""
    tap = fd.Table([0.0, 100.0, 100.00005, 100.0001], [0, 0, 1, 0])
    assert tried(pushed(tap), 200.0, "central_difference", dt=1e-3, every_steps=10_000)[1]


@pytest.mark.matrix
def test_functions_are_looked_at_within_steps_and_warned_about():
    """A function's pulse longer than the points' distance is found; its corners may be named."""

    def tap(t: float) -> float:
        return max(0.0, 1.0 - abs(t - 0.9) / 0.02)

    named = Function(tap, at=[0.92, 0.88, 0.9])
    assert named.knots() == (0.88, 0.9, 0.92)
    with pytest.warns(FoldynWarning, match=r"fd\.Function\(f, at="):
        found = fd.simulate(pushed(tap), 2.0, method="newmark", interval=0.1)
    again = fd.simulate(pushed(named), 2.0, method="newmark", interval=0.1)  # without a warning
    exact = duhamel(fd.Table([0.88, 0.9, 0.92], [0, 1, 0]), found.time.values)
    assert max(error(motion, exact) for motion in (found, again)) < GLOBAL
    with pytest.raises(InputError, match="at"):
        Function(tap, at=["soon"])


def test_small_motions_say_that_their_errors_are_not_judged():
    with pytest.warns(FoldynWarning, match="the motion is small"):
        fd.simulate(pushed(fd.HalfSine(0.5), 1e-9), 1.0, method="newmark")
