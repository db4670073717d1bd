"""Histories: their values, their arguments, and what may stand in for one."""

from __future__ import annotations

import math
from dataclasses import MISSING, dataclass, fields

import numpy as np
import pytest

from foldyn.cases import (
    HISTORIES,
    Chirp,
    Constant,
    Function,
    HalfSine,
    Harmonic,
    Pulse,
    Ramp,
    Step,
    Table,
    as_history,
)
from foldyn.cases.history import Formula, Waveform
from foldyn.errors import InputError

SMALL = math.sin(math.pi / 8)
EXAMPLES = [
    Constant(),
    Pulse(duration=0.5),
    HalfSine(duration=0.5),
    Ramp(duration=2.0),
    Step(time=0.25),
    Harmonic(frequency=2.0, phase=30.0),
    Chirp(from_frequency=0.5, to_frequency=3.0, duration=2.0, phase=30.0),
    Table(times=[0.0, 1.0, 3.0], values=[0.0, 2.0, -2.0]),
]
# of others, numbers without a default are 0.7
EXAMPLES += [
    kind(**{field.name: 0.7 for field in fields(kind) if field.default is MISSING})
    for kind in HISTORIES.values()
    if kind not in map(type, EXAMPLES)
]


@pytest.mark.parametrize("history", [*EXAMPLES, Ramp(1.5, smooth=True)], ids=repr)
def test_derivatives_and_jumps_are_as_declared(history) -> None:
    times = np.linspace(-0.5, 4.0, 4501) + 1e-4
    factor, rate, second = history.derivatives(times)
    apart = np.diff(times)[0]

    def changes(knots, values, slopes):
        """Whether values are their slopes' integral between times without one of these in it."""
        missed = np.diff(values) - 0.5 * apart * (slopes[1:] + slopes[:-1])
        at = np.array([*knots, np.inf])
        within = (at > times[:-1, None]) & (at <= times[1:, None])
        return np.abs(missed)[~within.any(axis=1)].max()

    assert changes(history.jumps(), factor, rate) < 1e-2
    assert changes(history.knots(), factor, rate) < 1e-4
    assert changes(history.knots(), rate, second) < 1e-3


@dataclass(frozen=True)
class Unknown(Formula):
    """A history whose code is that of another one."""

    kind = "unknown"
    formulas = (Waveform(Pulse.code, None),)


def test_a_formula_that_kernels_do_not_know_is_refused() -> None:
    with pytest.raises(InputError, match="history unknown: its formula is not one that kernels"):
        Unknown()(0.5)


@pytest.mark.parametrize(
    "history", [*EXAMPLES, Function(lambda t: t**2)], ids=lambda history: history.kind
)
def test_shape_follows_the_times(history) -> None:
    times = np.linspace(-0.5, 4.0, 12).reshape(3, 4)
    factors = history(times)
    assert factors.shape == (3, 4)
    assert isinstance(history(0.3), float)
    scalars = [history(float(t)) for t in times.ravel()]
    np.testing.assert_array_equal(factors.ravel(), scalars)


@pytest.mark.parametrize(
    ("history", "time", "factor"),
    [
        (Pulse(0.5), [-0.1, 0.0, 0.499, 0.5, 1.0], [0, 1, 1, 0, 0]),
        (HalfSine(0.5), [-0.1, 0.0, 0.25, 0.5, 0.6], [0, 0, 1, 0, 0]),
        (HalfSine(3.0), [0.5], [0.5]),
        (Ramp(2.0), [-1.0, 0.0, 0.5, 2.0, 9.0], [0, 0, 0.25, 1, 1]),
        (Step(0.25), [0.0, 0.2499, 0.25, 1.0], [0, 0, 1, 1]),
        (Harmonic(2.0), [0.0, 0.125, 0.375], [0, 1, -1]),
        (Harmonic(1.0, phase=90.0), [0.0, 0.5], [1, -1]),
        (Table([0, 1, 3], [0, 2, -2]), [-5.0, 0.5, 1.0, 2.0, 9.0], [0, 1, 2, 0, -2]),
        # 2 t + t^2/2 turns: 1/2 at t = sqrt(5) - 2, 5/2 at t = 1
        (Chirp(2.0, 4.0, 2.0), [-0.1, 0.0, 5**0.5 - 2, 1.0, 2.0, 3.0], [0, 0, 0, 0, 0, 0]),
        (Chirp(2.0, 4.0, 2.0, phase=90.0), [-0.1, 0.0, 5**0.5 - 2, 1.0, 2.0], [0, 1, -1, -1, 0]),
        # t - t^2/4 turns: 7/16, 3/4 and 15/16
        (Chirp(1.0, 0.0, 2.0), [0.5, 1.0, 1.5], np.array([SMALL, -1, -SMALL])),
        (Chirp(2.0, 2.0, 1.0), [0.125, 0.375, 1.5], [1, -1, 0]),
    ],
)
def test_values(history, time, factor) -> None:
    np.testing.assert_allclose(history(time), factor, rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Pulse(-1), "duration = -1: must be greater than 0"),
        (lambda: HalfSine(0.0), "duration = 0.0: must be greater than 0"),
        (lambda: Ramp(math.nan), "duration = nan: must be a finite number"),
        (lambda: Step(math.inf), "time = inf: must be a finite number"),
        (lambda: Harmonic(0.0), "frequency = 0.0: must be greater than 0"),
        (lambda: Chirp(-1, 2, 3), "from_frequency = -1: must be at least 0"),
        (lambda: Chirp(1, -2, 3), "to_frequency = -2: must be at least 0"),
        (lambda: Chirp(0, 0, 3), "this or from_frequency must be above 0"),
        (lambda: Chirp(1, 2, 0), "duration = 0: must be greater than 0"),
        (lambda: Chirp(1, 2, 3, math.inf), "phase = inf: must be a finite number"),
        (lambda: Table([0, 1], [0, math.nan]), r"values\[1\] = nan: must be a finite number"),
        (lambda: Table([0, 1], ["a", "b"]), "values = .*: must be numbers"),
        (lambda: Table([0, 1, 1], [0, 1, 2]), r"times\[2\] = 1.0: must increase"),
        (lambda: Table([0, 1], [0, 1, 2]), r"as many numbers as times \(2\)"),
        (lambda: Table([0], [0]), "times = .*: must be a list of at least two numbers"),
        (lambda: as_history("pulse"), 'history = "pulse": must be a history'),
        (lambda: as_history(Pulse), "history = Pulse: give an object"),
    ],
)
def test_wrong_arguments(make, text) -> None:
    with pytest.raises(InputError, match=text):
        make()


def test_a_chirp_sweeps_from_start_to_end() -> None:
    time = np.linspace(0.0, 10.0, 200_001)[:-1]
    factor = Chirp(from_frequency=1.0, to_frequency=9.0, duration=10.0)(time)
    # the mean of the frequency times the duration is the number of turns: two zeros in each
    zeros = time[1:][np.diff(np.signbit(factor))]
    assert len(zeros) == pytest.approx(2 * 5.0 * 10.0, abs=1)
    rate = 1.0 / (zeros[2:] - zeros[:-2])  # zeros two apart are one period apart
    np.testing.assert_allclose(rate[5:], 1.0 + 0.8 * zeros[6:-1], rtol=0.03)


def test_equal_histories_compare_equal() -> None:
    assert Pulse(1) == Pulse(1.0) != Pulse(2.0)
    assert Constant() == as_history(None) != Pulse(1.0)
    table = Table([0, 1], [0, 1])
    assert as_history(table) is table == Table([0.0, 1.0], [0.0, 1.0]) != Table([0, 1], [0, 2])
    assert hash(table) == hash(Table([0.0, 1.0], [0.0, 1.0]))
    assert as_history(math.sin) == as_history(math.sin) != as_history(math.cos)


def test_table_keeps_its_own_numbers() -> None:
    values = np.array([0.0, 1.0])
    table = Table([0, 1], values)
    values[1] = 7.0
    assert table(1.0) == 1.0
    with pytest.raises(ValueError, match="read-only"):
        table.values[1] = 7.0


@pytest.mark.parametrize(
    "function",
    [
        lambda t: 1.0 if t < 1.0 else 0.0,  # fails on arrays
        lambda t: math.exp(-t),  # fails on arrays
        lambda t: np.exp(-t),  # takes arrays
        lambda t: 3,  # a number whatever it gets
        # answers an array with one branch: the entries tell otherwise
        lambda t: np.ones_like(t) if np.any(t > 0.5) else np.zeros_like(t),
    ],
)
def test_functions_of_numbers_and_of_arrays(function) -> None:
    times = np.linspace(0.0, 2.0, 7)
    wanted = [float(function(t)) for t in times.tolist()]
    np.testing.assert_allclose(as_history(function)(times), wanted, rtol=1e-15)


def test_a_function_must_give_finite_numbers() -> None:
    def broken(t):
        return 1.0 / (float(t) - 0.5)

    for function, message in (
        (
            lambda t: np.where(t > 0.5, np.nan, 1.0),
            r"gives nan at t = 1.0 s: must be a finite numb",
        ),
        (lambda t: "no", r'gives "no" at t = 0.0 s: must be a number'),
        (broken, r"history broken fails at t = 0.5 s: ZeroDivisionError"),
    ):
        with pytest.raises(InputError, match=message):
            as_history(function)(np.array([0.0, 0.5, 1.0]))
