"""Histories: their values, their arguments, and what may stand in for one."""

from __future__ import annotations

import math

import numpy as np
import pytest

from foldyn.cases import (
    HISTORIES,
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
from foldyn.errors import InputError

EXAMPLES = [
    Constant(),
    Pulse(duration=0.5),
    HalfSine(duration=0.5),
    Ramp(duration=2.0),
    Step(time=0.25),
    Harmonic(frequency=2.0, phase=30.0),
    Table(times=[0.0, 1.0, 3.0], values=[0.0, 2.0, -2.0]),
    Function(lambda t: t**2),
]


def test_every_registered_history_has_an_example() -> None:
    assert {type(history) for history in EXAMPLES} >= set(HISTORIES.values())
    assert all(history.kind == kind for kind, history in HISTORIES.items())


@pytest.mark.parametrize("history", EXAMPLES, ids=lambda history: history.kind)
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
    ],
)
def test_values(history, time, factor) -> None:
    np.testing.assert_allclose(history(time), factor, rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Pulse(-1), "duration = -1: must be greater than 0"),
        (lambda: HalfSine(0.0), "duration = 0.0: must be greater than 0"),
        (lambda: Ramp(math.nan), "duration = nan: must be a finite number"),
        (lambda: Pulse(True), "duration = true: must be a number"),
        (lambda: Pulse("1"), 'duration = "1": must be a number'),
        (lambda: Pulse(10**400), "must be a finite number"),
        (lambda: Step(math.inf), "time = inf: must be a finite number"),
        (lambda: Harmonic(0.0), "frequency = 0.0: must be greater than 0"),
        (lambda: Table([0, 1], [0, math.nan]), r"values\[1\] = nan: must be a finite number"),
        (lambda: Table([0, 1], [0, True]), "values = .*: must be numbers"),
        (lambda: Table([0, 1], ["a", "b"]), "values = .*: must be numbers"),
        (lambda: Table([0, 1, 1], [0, 1, 2]), r"times\[2\] = 1.0: must be greater than"),
        (lambda: Table([0, 1], [0, 1, 2]), r"as many numbers as times \(2\)"),
        (lambda: Table([0], [0]), "times = .*: must be a list of at least two numbers"),
        (lambda: Table([[0, 1]], [[0, 1]]), "times = .*: must be a list of at least two"),
        (lambda: as_history("pulse"), 'history = "pulse": must be a history'),
        (lambda: as_history(Pulse), "history = Pulse: give an object"),
    ],
)
def test_wrong_arguments(make, text) -> None:
    with pytest.raises(InputError, match=text):
        make()


def test_equal_histories_compare_equal() -> None:
    assert Pulse(1) == Pulse(1.0) != Pulse(2.0)
    assert Constant() == Constant() != Pulse(1.0)
    table = Table([0, 1], [0, 1])
    assert table == Table([0.0, 1.0], [0.0, 1.0])
    assert table != Table([0, 1], [0, 2])
    assert hash(table) == hash(Table([0.0, 1.0], [0.0, 1.0]))
    assert as_history(math.sin) == as_history(math.sin) != as_history(math.cos)


def test_table_keeps_its_own_numbers() -> None:
    values = np.array([0.0, 1.0])
    table = Table([0, 1], values)
    values[1] = 7.0
    assert table(1.0) == 1.0
    with pytest.raises(ValueError, match="read-only"):
        table.values[1] = 7.0


def test_what_becomes_a_history() -> None:
    assert as_history(None) == Constant()
    pulse = Pulse(1.0)
    assert as_history(pulse) is pulse
    assert as_history(math.cos)(0.0) == 1.0


@pytest.mark.parametrize(
    "function",
    [
        lambda t: 1.0 if t < 1.0 else 0.0,  # fails on arrays
        lambda t: math.exp(-t),  # fails on arrays
        lambda t: np.exp(-t),  # takes arrays
        lambda t: 3,  # a number whatever it gets
    ],
)
def test_functions_of_numbers_and_of_arrays(function) -> None:
    times = np.linspace(0.0, 2.0, 7)
    np.testing.assert_allclose(
        as_history(function)(times), [function(t) for t in times.tolist()], rtol=1e-15
    )


def test_a_function_must_give_finite_numbers() -> None:
    with pytest.raises(InputError, match=r"gives nan at t = 1.0 s: must be a finite number"):
        as_history(lambda t: np.where(t > 0.5, np.nan, 1.0))(np.array([0.0, 1.0]))
    with pytest.raises(InputError, match=r'gives "no" at t = 0.0 s: must be a number'):
        as_history(lambda t: "no")(0.0)
