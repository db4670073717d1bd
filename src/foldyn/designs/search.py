"""A search, which evaluates each design once, records it, and scales its values for the method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from foldyn.designs.evaluator import JACOBIAN, VALUES, Point
from foldyn.designs.problem import Problem, Space
from foldyn.errors import FoldynError
from foldyn.sweeps.evaluations import Evaluations

BAD = 1e6
"""Objective assigned to a design that cannot be computed, relative to the objective's size."""
MOST_FAILED = 20, 200
"""Failed designs in a row after which a search is given up, for methods with gradients and for
stochastic methods."""
NEAR, STILL = 1e-7, 20
"""Designs closer than the first number, relative to the width of the bounds, are equal; more equal
designs in a row than the second number end a search with gradients."""


class Ended(Exception):  # noqa: N818
    """Ends a search, whatever the method."""


@dataclass(frozen=True, eq=False)
class Trial:
    """An evaluated design, with scaled values and slopes with respect to entries from 0 to 1.

    Attributes
    ----------
    x : ndarray, shape (n,)
    objective : float
        Value to minimize.
    excess : ndarray, shape (c,)
        Excess of each constraint: at most 0 if the constraint holds; 0 if an equality holds.
    slope, slopes : ndarray, shapes (n,) and (c, n)
        Derivatives of `objective` and `excess`; empty if the method needs none.
    violation : float
        The largest violation of all constraints.
    """

    x: NDArray
    objective: float
    excess: NDArray
    slope: NDArray
    slopes: NDArray
    violation: float


@dataclass(frozen=True, eq=False)
class Row:
    """A row of the history.

    numbers : the objective, and left minus right sides of constraints; nan for a failed design.
    """

    search: int
    iteration: int
    point: Point
    numbers: NDArray
    violation: float
    feasible: bool
    seconds: float
    failure: str
    warnings: str
    values: dict[str, float] = field(default_factory=dict)
    slopes: NDArray | None = None  # derivatives of `numbers` with respect to entries of the design

    @property
    def objective(self) -> float:
        """The first of `numbers`."""
        return float(self.numbers[0])


class Search:
    """Evaluates designs for a method.

    Parameters
    ----------
    problem, space
    evaluations : Evaluations
    gradient : bool
        Whether evaluations include derivatives.
    slack : float
        Relative violation of a constraint up to which it counts as satisfied.
    most : int
        Most evaluations of one search.
    tell : callable, optional
        Called after each new row.
    """

    def __init__(
        self, problem: Problem, space: Space, evaluations: Evaluations[Point], gradient: bool,
        slack: float, most: int, tell: Callable[[], None] | None = None,
    ) -> None:  # fmt: skip
        self.problem, self.space, self.evaluations = problem, space, evaluations
        self.gradient, self.slack, self.most, self.tell = gradient, slack, most, tell
        self.rows: list[Row] = []
        self.sizes: NDArray | None = None  # from the first design that can be computed
        self.number = 0
        self.best: Row | None = None
        self._known: dict[Point, Trial | None] = {}
        self.begin(0)

    def begin(self, number: int) -> None:
        """Begin a search from another guess."""
        self.number, self.iteration, self.count, self._failed = number, 0, 0, 0
        self._still = 0
        self._known.clear()
        self._last: Trial | None = None

    def step(self, *_: object) -> None:
        """Count an iteration of the method."""
        self.iteration += 1

    def at(self, x: NDArray) -> Trial:
        """Evaluate a design.

        If the design fails, the objective is very large, and all other values are the values of the
        last successful design, so that methods take a shorter step.

        Raises
        ------
        Ended
            The first design of a search, or too many designs in a row, cannot be computed, or the
            limit of evaluations is reached.
        """
        point = self.space.point(np.asarray(x, float))
        if point not in self._known:
            if self.count >= self.most:
                raise Ended(f"{self.most} evaluations; allow more by max_evaluations")
            self.count += 1
            self._known[point] = self._new(point)
        found = self._known[point]
        if found is not None:
            self._count_still(found)
            self._last, self._failed = found, 0
            return found
        self._failed += 1
        if self._last is None:
            raise Ended(f"the first design cannot be computed: {self.rows[-1].failure}")
        most = MOST_FAILED[not self.gradient]
        if self._failed > most:
            raise Ended(f"{most} designs in a row failed: {self.rows[-1].failure}")
        last = self._last
        return Trial(np.asarray(x), BAD, last.excess, last.slope, last.slopes, np.inf)

    def _count_still(self, found: Trial) -> None:
        """End a search with gradients that stays at one design, such as when none is feasible."""
        last = self._last
        if not self.gradient or last is None or found is last:
            return
        near = float(np.abs(found.x - last.x).max()) < NEAR
        self._still = self._still + 1 if near else 0
        if self._still > STILL:
            raise Ended("the design no longer changes")

    def _new(self, point: Point) -> Trial | None:
        (found,) = self.evaluations.at([point])
        failure, values, trial, slopes = found.failure, dict[str, float](), None, None
        numbers = np.full(1 + len(self.problem.constraints), np.nan)
        if not failure:
            values = dict(zip(self.problem.measures, found.values[VALUES].tolist(), strict=True))
            try:
                if self.gradient:
                    rows = zip(self.problem.measures, found.values[JACOBIAN], strict=True)
                    numbers, slopes = self.problem.with_slopes(values, dict(rows))
                else:
                    numbers = self.problem.numbers(values)
                if self.sizes is None:
                    self.sizes = self.problem.sizes(values)
                trial = self._trial(point, numbers, slopes)
            except FoldynError as error:
                failure = str(error)
        violation = np.nan if trial is None else trial.violation
        row = Row(
            self.number, self.iteration, point, numbers, violation, violation <= self.slack,
            found.seconds, failure, found.warnings, values, slopes,
        )  # fmt: skip
        self.rows.append(row)
        if trial is not None and (self.best is None or self.key(row) < self.key(self.best)):
            self.best = row
        if self.tell is not None:
            self.tell()
        return trial

    def _trial(self, point: Point, numbers: NDArray, slopes: NDArray | None) -> Trial:
        """Scaled values of a design."""
        scale = np.array([self.problem.sign, *self.problem.signs]) / self.sizes
        scaled = numbers * scale
        by = np.zeros((len(scaled), 0)) if slopes is None else (
            slopes * scale[:, None] * (self.space.upper - self.space.lower)
        )  # fmt: skip
        excess = scaled[1:]
        off = np.where(self.problem.equal, np.abs(excess), np.maximum(excess, 0.0))
        return Trial(
            self.space.x(np.array(point)), float(scaled[0]), excess, by[0], by[1:],
            float(off.max(initial=0.0)),
        )  # fmt: skip

    def key(self, row: Row) -> tuple[bool, float]:
        """Sort key for the best design: feasible first, then least objective or violation."""
        least = self.problem.sign * row.objective if row.feasible else row.violation
        return not row.feasible, float(least)
