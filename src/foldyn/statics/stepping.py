"""Load stepping: successive equilibria, driven by the load factor.

A step that does not converge, or that snaps elsewhere, is repeated with a line search and then
halved; after a success steps grow again. So a path ends where no equilibrium continues it: at a
limit point, which only the methods with a free load factor pass.

The first point of a path is an equilibrium near a given state. A state out of equilibrium (under
constant loads, with folds that have a moment at rest, or simply a guess) is held by its own
out-of-balance force, which is then gradually released: load stepping as along a path leads to the
equilibrium that belongs to the state, rather than to wherever one large Newton step lands.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import repeat
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import brief
from foldyn.statics.newton import COLLIDES, Attempt, Problem, Solver, Stiffness, balance

NEGLIGIBLE = 1e-6  # motions below this fraction of the structure's size are never a snap
SNAPS = "the structure snaps to a state off its path"
REMEDY_LIMIT = (
    "a limit point may lie ahead: method 'arc_length' follows the path through it "
    "(or take smaller steps)"
)
REMEDY_CREEP = "it may give way by creep there (or take shorter steps, with shorter durations)"
REMEDY_COLLISION = "let the folds lock before panels meet (fold_law 'enhanced')"
REMEDY_LOCKED = (
    "the folds lock already, but panels are pushed into each other: end the path before, or take "
    "smaller steps"
)


@brief
@dataclass(frozen=True, eq=False)
class Point:
    """An equilibrium on a path.

    Attributes
    ----------
    u : (m,)
        All dofs.
    factor : float
        Load factor.
    iterations : int
        Newton iterations that it took.
    residual : float
        Residual as a fraction of the forces at play.
    negative : int
        Negative eigenvalues of the tangent on the free dofs; -1 if they were not counted.
    kind : str
        "regular", "limit" or "bifurcation".
    interval : tuple of (float, float), optional
        Load factors that bracket a critical point which could not be located.
    memory
        Argument of the problem's `recall`, if parts of the structure yield.
    """

    u: NDArray
    factor: float
    iterations: int
    residual: float
    negative: int = -1
    kind: str = "regular"
    interval: tuple[float, float] | None = None
    memory: Any = None


class Station(NamedTuple):
    """A point, with the tangent and the response (m,) to the load factor at this point."""

    point: Point
    stiffness: Stiffness
    response: NDArray


class PathStoppedError(Exception):
    """A path cannot be continued; holds the reason and a remedy."""

    def __init__(self, reason: str, remedy: str) -> None:
        super().__init__(f"{reason}; {remedy}")
        self.reason, self.remedy = reason, remedy


Walk = Iterator[Station]


def arrive(solver: Solver, attempt: Attempt) -> Station:
    """Station at the equilibrium found by a correction."""
    stiffness = solver.stiffness(attempt.u, attempt.factor)
    counted = solver.settings.stability and not solver.problem.slips(attempt.u)
    negative = stiffness.symmetric.negative() if counted else -1
    point = Point(attempt.u, attempt.factor, attempt.iterations, attempt.balance.relative, negative)
    return Station(point, stiffness, stiffness.response(attempt.u, attempt.factor))


def kept(problem: Problem, station: Station) -> Station:
    """The station with its memory of yield and slip, from which the problem continues."""
    memory = problem.keep(station.point.u, station.point.factor)
    if memory is None:
        return station
    return station._replace(point=replace(station.point, memory=memory))


def step_to(solver: Solver, start: Station, factor: float, seconds: float = 0.0) -> Attempt:
    """Equilibrium at another load factor, or after some seconds, on the path of `start`."""
    solver.problem.elapse(seconds)
    plain = _step(solver, start, factor, seconds, False)
    if not plain.failure or plain.failure == SNAPS:
        return plain
    searched = _step(solver, start, factor, seconds, True)
    return plain if searched.failure else searched


def _step(solver: Solver, start: Station, factor: float, seconds: float, search: bool) -> Attempt:
    """One attempt; a motion much larger than its linear prediction counts as a snap."""
    problem, u = solver.problem, start.point.u
    attempt = solver.correct(u, factor, None, start.stiffness, search)
    if attempt.failure:
        return attempt
    change = factor - start.point.factor
    length = float(np.linalg.norm(attempt.u - u))
    # N, out-of-balance force at the start of the step after relaxation during the step
    relaxed = problem.residual(u, start.point.factor) if seconds > 0.0 else None

    def snaps(stiffness: Stiffness, response: NDArray) -> bool:
        predicted = change * response
        if relaxed is not None:
            predicted = predicted - stiffness.solve(relaxed, np.zeros(len(problem.held)))
        reach = solver.settings.jump * float(np.linalg.norm(predicted))
        return length > reach + NEGLIGIBLE * problem.length

    if not snaps(start.stiffness, start.response) or problem.opens(attempt.u, factor):
        return attempt
    if start.point.memory is not None:
        # parts may yield or slip within the step: compare with the tangent at its end
        there = solver.stiffness(attempt.u, factor)
        if not snaps(there, there.response(attempt.u, factor)):
            return attempt
    return attempt._replace(failure=SNAPS)


def walk(
    solver: Solver, start: Station, factors: Sequence[float], between: bool,
    durations: Sequence[float] = (),
) -> Walk:  # fmt: skip
    """Stations at the given factors, in turn, and also between them if `between`.

    durations : time (s) to each factor, if any; a factor may then repeat the previous one.
    """
    station = start
    step = abs(factors[0] - start.point.factor) if len(factors) else 0.0
    for goal, seconds in zip(factors, durations or repeat(0.0), strict=False):
        waits = goal == station.point.factor
        left = whole = 1.0 if waits else abs(goal - station.point.factor)
        step = whole if waits else min(max(step, 1e-3 * whole), whole)
        shortest = whole * 2.0**-solver.settings.cuts
        while left > 0.0:
            # avoid tiny last steps: the rest is taken in one or two equal steps
            length = left if left <= 1.01 * step else min(step, 0.5 * left)
            last = waits or length == left
            ahead = math.copysign(length, goal - station.point.factor)
            target = goal if last else station.point.factor + ahead
            attempt = step_to(solver, station, target, seconds * (length / whole))
            if attempt.failure:
                solver.tally.cuts += 1
                step = 0.5 * length
                if step < shortest:
                    raise stopped(station, attempt)
                continue
            if attempt.iterations <= 2 * solver.settings.target:
                step = max(step, min(2.0 * length, whole))
            station = kept(solver.problem, arrive(solver, attempt))
            left = left - length if waits else abs(goal - station.point.factor)
            if between or left == 0.0:
                yield station


def stopped(station: Station, attempt: Attempt) -> PathStoppedError:
    """Error for a path, driven by the load factor, that cannot continue."""
    time = getattr(station.point.memory, "time", 0.0)
    after = f"after {time:.6g} s " if time else ""
    remedy = REMEDY_CREEP if time else REMEDY_LIMIT
    return PathStoppedError(
        f"no equilibrium was found beyond the load factor {station.point.factor:.6g} {after}"
        f"({attempt.failure})",
        REMEDY_COLLISION if attempt.failure == COLLIDES else remedy,
    )


class Released(Problem):
    """A problem at a fixed load factor; its out-of-balance force fades as `factor` goes to 1."""

    def __init__(self, problem: Problem, u: NDArray, factor: float) -> None:
        self.problem, self.factor = problem, factor
        self.free, self.held = problem.free, problem.held
        self.force_rounding, self.length = problem.force_rounding, problem.length
        self.turn, self.clear = problem.turn, problem.clear
        self._from = u[problem.held]
        self._to = problem.prescribed(factor)
        self._out = problem.residual(u, factor)
        self._out[problem.held] = 0.0

    def prescribed(self, factor: float) -> NDArray:
        """Values of the held dofs, between their initial and their prescribed values."""
        return self._from + factor * (self._to - self._from)

    def residual(self, u: NDArray, factor: float) -> NDArray:
        """Residual less the remaining holding force."""
        return self.problem.residual(u, self.factor) - (1.0 - factor) * self._out

    def tangent(self, u: NDArray, factor: float, before: NDArray | None = None) -> Any:
        """Tangent of the problem."""
        return self.problem.tangent(u, self.factor, before)

    def rate(self, u: NDArray, factor: float) -> NDArray:
        """Derivative of the residual with respect to `factor`."""
        return self._out

    def reference(self, u: NDArray, factor: float) -> float:
        """Forces at play in the problem."""
        return self.problem.reference(u, self.factor)

    def keep(self, u: NDArray, factor: float) -> Any:
        """Accept a state in the problem."""
        return self.problem.keep(u, self.factor)


def settle(solver: Solver, u: NDArray, factor: float) -> Station:
    """Station at the equilibrium that belongs to a state (m,) at a load factor.

    Raises
    ------
    PathStoppedError
        No equilibrium was found.
    """
    problem = solver.problem
    moved = not np.array_equal(u[problem.held], problem.prescribed(factor))
    given = balance(problem, u, factor, problem.residual(u, factor))
    negligible = max(problem.force_rounding, solver.settings.tolerance * given.reference)
    if given.residual <= negligible and not moved:
        return arrive(solver, Attempt(u, factor, 0, given))
    released = Solver(Released(problem, u, factor), solver.settings)
    released.tally = solver.tally
    at_rest = balance(released.problem, u, 0.0, released.problem.residual(u, 0.0))
    try:
        *_, last = walk(released, arrive(released, Attempt(u, 0.0, 0, at_rest)), [1.0], False)
    except PathStoppedError as stop:
        raise PathStoppedError(
            f"no equilibrium was found at the load factor {factor:.6g} from the state given",
            "start from a state nearer to it, or apply the constant loads in smaller steps "
            f"({stop.reason})",
        ) from None
    attempt = solver.correct(last.point.u, factor)
    if attempt.failure:
        raise PathStoppedError(
            f"the first point at the load factor {factor:.6g} did not settle ({attempt.failure})",
            "start from another state",
        )
    return arrive(solver, attempt)
