"""Gradients at designs drawn at random, against differences: right to 1e-5, or refused by name.

What fails is found again by its seed: `compared(seed)`.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pytest
from gradient_draws import Draw, draw
from numpy.typing import NDArray

from foldyn.dynamics.generalized_alpha import Alpha
from foldyn.errors import ComputationError, FoldynWarning, InputError
from pairwise import beyond

# states that are no equilibria, soft hinges, coarse steps: not what this is about
pytestmark = pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")

CLOSE = 1e-5
LEAST = 1e-2  # of the number: what a change by the whole of a parameter is compared with, at least
LENGTHS = (2e-3, 2e-4, 1e-2, 2e-5, 1e-6, 3e-8)  # of a parameter: further ones where these fail
TRIES = 30


@pytest.fixture(autouse=True)
def to_rounding(monkeypatch):
    """Equations of steps solved to rounding, as gradients take them."""
    monkeypatch.setattr(Alpha, "tolerance", 1e-12)


class Compared(NamedTuple):
    """Error of a rate over its size, what differences leave unsure of it, and draws refused."""

    drawn: Draw
    error: float
    unsure: float
    refused: int


def rates(drawn: Draw, direction: NDArray, h: float) -> Iterator[float]:
    """A rate by differences of the fourth order, then by those of twice the step."""

    def apart(by: float) -> float:
        ahead, behind = (drawn.value + side * by * direction for side in (1.0, -1.0))
        return drawn.number(ahead) - drawn.number(behind)

    one, two = apart(h), apart(2.0 * h)
    yield (8.0 * one - two) / (12.0 * h)
    yield (8.0 * two - apart(4.0 * h)) / (24.0 * h)


def nearest(drawn: Draw, value: float, rate: float, direction: NDArray) -> tuple[float, float]:
    """Error of a rate, and what differences leave unsure of it: at the step where both are least.

    Over the size of the rate; unsure 0 where the error is small anyway, nan without differences.
    """
    found = [(np.nan, np.nan)]
    for h in LENGTHS:
        try:
            several = rates(drawn, direction, h)
            expected = next(several)
            scale = max(abs(expected), LEAST * abs(value)) or 1.0
            if (error := abs(rate - expected) / scale) <= CLOSE:
                return error, 0.0
            found.append((error, abs(next(several) - expected) / scale))
        except (InputError, ComputationError):  # beyond a bound
            continue
    return min(found, key=lambda one: np.nan_to_num(sum(one), nan=np.inf))


def compared(seed: int) -> Compared:
    """The first draw that is not refused and on which something depends."""
    refused = 0
    for attempt in range(TRIES):
        chance = np.random.default_rng((seed, attempt, 1))
        try:
            drawn = draw(seed, attempt)
        except (InputError, ComputationError):  # no case, or no path
            continue
        size = np.abs(drawn.value) if np.any(drawn.value) else 0.1
        direction = size * chance.uniform(0.5, 1.5, np.shape(drawn.value))
        try:
            with warnings.catch_warnings():
                warnings.filterwarnings("error", ".* have a kink here", FoldynWarning)
                value, gradient = drawn.gradient()
            still = not gradient.any() and drawn.number(drawn.value + 1e-3 * direction) == value
        except ComputationError:
            continue
        except (InputError, FoldynWarning):  # by name
            refused += 1
            continue
        rate = float(np.sum(gradient * direction))
        error, unsure = nearest(drawn, value, rate, direction) if not still else (np.nan, 0.0)
        if not np.isnan(error):
            return Compared(drawn, error, unsure, refused)
    raise AssertionError("all that was drawn is refused")


def check(seed: int) -> None:
    found = compared(seed)
    drawn = found.drawn
    assert found.error <= CLOSE + 10.0 * found.unsure, (
        f"{drawn.measure} by {drawn.name}: {found.error:.2g} off (differences {found.unsure:.2g}), "
        f"{drawn.analysis}"
    )


@pytest.mark.parametrize("seed", [*range(8), *beyond(range(8, 20), 2)])
def test_gradients_are_those_of_differences(seed):
    check(seed)


@pytest.mark.matrix
@pytest.mark.parametrize("seed", range(1000, 1000 + int(os.environ.get("DRAWS", "500"))))
def test_many_gradients_are_those_of_differences(seed):
    check(seed)
