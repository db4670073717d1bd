"""Paths with a free load factor, through limit points and snap-backs.

A step predicts along the tangent of the path, over a length, and corrects under the rule of its
method. The length follows the ratio of target to actual iterations; it also shrinks where the
path bends, in the plane of motion and load factor (the latter scaled so that the first step has a
slope of 1), and where hinges turn far. A step is cut if it does not converge, if a hinge turns by
more than 1.5 times `largest_turn`, or if it lies more than 60 degrees off the previous step or off
the tangent at its own end: it may then have left the path.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from foldyn.statics.newton import COLLIDES, Attempt, Rule, Solver
from foldyn.statics.problem import EPS, UNKNOWN, clear_share
from foldyn.statics.stepping import (
    PathStoppedError,
    Station,
    Walk,
    arrive,
    kept,
    step_to,
    stopped,
)

# rule of one step from its length and its prediction (m,)
ArcRule = Callable[[float, NDArray], Rule]

ALIGNED = 0.5  # cosine of the largest angle to the previous step and to the tangent at the end
BEND = np.radians(12.0)  # target for the bend of the path within a step
REMEDY = (
    "take smaller steps (first_step, or settings with a smaller largest_turn), or start from a "
    "state that is less symmetric"
)


class Plane:
    """Rule of modified generalized displacement control, the method of MERLIN2, for one step.

    After the prediction c1 = df1 b1, with b1 the response to the load factor at the start of the
    step, every correction a + df b is orthogonal to b1: df = -(b1.a)/(b1.b). Predictions are as
    long as the first step of the path, |df1| = length/|b1|, which with the first response b0 is
    the square root of the generalized stiffness parameter |b0.b0/(b1.b1)| (Leon, Lages, de Araujo
    and Paulino, Comput. Mech. 53, 2014: "modified" because the parameter and the plane use the
    response of the present step twice, not once that of the previous step).
    """

    def __init__(self, length: float, prediction: NDArray) -> None:
        self.prediction = prediction  # the plane passes through its end, whatever the length

    def __call__(self, moved: NDArray, step: NDArray, response: NDArray) -> float:
        """Change of the load factor; nan where the plane contains the response."""
        across = float(self.prediction @ response)
        # if only part of a step was taken, the motion is brought back into the plane
        short = float(self.prediction @ (moved + step)) - float(self.prediction @ self.prediction)
        return -short / across if across != 0.0 else math.nan


class Cylinder:
    """Rule of the cylindrical arc length for one step, which fixes its length from start to end.

    With c the motion since the start of the step, a the step of Newton's method at the present
    load factor and b the response to the factor, |c + a + df b| = length is a quadratic equation
    for df (Crisfield, Computers and Structures 13, 1981). The root taken is the one that
    continues in the direction of the step.
    """

    def __init__(self, length: float, prediction: NDArray) -> None:
        self.length, self.prediction = length, prediction

    def __call__(self, moved: NDArray, step: NDArray, response: NDArray) -> float:
        """Change of the load factor; nan where the arc does not meet the linearized path."""
        reached = moved + step
        a = float(response @ response)
        b = float(response @ reached)
        c = float(reached @ reached) - self.length**2
        root = b * b - a * c
        if not root >= 0.0 or a == 0.0:
            return math.nan
        root = math.sqrt(root)
        # without cancellation: one root by the sum of two terms of one sign, one by Vieta
        far = -(b + math.copysign(root, b))
        roots = (far / a, c / far if far != 0.0 else 0.0)
        along = [float((reached + root * response) @ self.prediction) for root in roots]
        return roots[int(np.argmax(along))]


def follow(
    solver: Solver, start: Station, rule: ArcRule, first_step: float, direction: NDArray | None,
) -> Walk:  # fmt: skip
    """Stations along a path, without end.

    Parameters
    ----------
    solver, start
        Where the path begins.
    rule : ArcRule
        Rule of the method, such as `Cylinder`.
    first_step : float
        Change of the load factor in the first step, which sets the length of the next ones.
    direction : (m,) or None
        Motion that the path continues; if given, it sets the length of the first step instead.
    """
    station = start if direction is not None else _first(solver, start, first_step)
    if direction is None:
        yield station
    moved = station.point.u - start.point.u if direction is None else direction
    pace = _Pace(solver, station, moved)
    while True:
        attempt = _advance(solver, station, rule, pace.length, pace.moved)
        arrived = None if attempt.failure else arrive(solver, attempt)
        failure = pace.objection(station, arrived) if arrived else attempt.failure
        if arrived is None or failure:
            solver.tally.cuts += 1
            if not pace.cut():
                raise PathStoppedError(
                    "the path could not be followed beyond the load factor "
                    f"{station.point.factor:.6g} ({failure})",
                    REMEDY,
                )
            continue
        pace.accept(station, arrived)
        station = kept(solver.problem, arrived)
        yield station


class _Pace:
    """Step length control, with the last step (m,) taken."""

    def __init__(self, solver: Solver, station: Station, moved: NDArray) -> None:
        self.solver, self.settings, self.moved = solver, solver.settings, moved
        self.length = float(np.linalg.norm(moved))
        self.cuts = 0  # since the last step
        self.largest = float(np.radians(self.settings.largest_turn))
        climb = _climb(station, self.length, moved)
        self.scale = self.length / abs(climb) if climb != 0.0 else 1.0
        self.slope = np.arctan2(self.scale * climb, self.length)

    def objection(self, station: Station, arrived: Station) -> str:
        """Reason to reject a converged step; empty if it is accepted.

        The tangent at its end must also lie along the step: otherwise the direction in which the
        path continues would be arbitrary.
        """
        moved = arrived.point.u - station.point.u
        along = _cosine(moved, self.moved), abs(_cosine(moved, arrived.response))
        if min(along) < ALIGNED:
            return "the path turns too sharply"
        turn = self.solver.problem.turn(station.point.u, arrived.point.u)
        return "a hinge turns too far" if turn > 1.5 * self.largest else ""

    def cut(self) -> bool:
        """Halve the step; return False after too many cuts or below round-off."""
        self.length, self.cuts = 0.5 * self.length, self.cuts + 1
        return self.cuts < self.settings.cuts and self.length > EPS * self.solver.problem.length

    def accept(self, station: Station, arrived: Station) -> None:
        """Set the length of the next step, at most the size of the structure."""
        one, other = station.point, arrived.point
        self.moved = other.u - one.u
        length = float(np.linalg.norm(self.moved))
        turn = self.solver.problem.turn(one.u, other.u)
        slope = np.arctan2(self.scale * (other.factor - one.factor), length)
        growth = np.sqrt(self.settings.target / max(other.iterations, 1))
        bend = abs(slope - self.slope)
        limits = (2.0, growth, BEND / max(bend, 1e-9), self.largest / max(turn, 1e-9))
        self.length = min(length * max(min(limits), 0.25), self.solver.problem.length)
        self.slope, self.cuts = slope, 0


def _first(solver: Solver, start: Station, first_step: float) -> Station:
    """Station after a first step of the load factor, halved until it converges."""
    step = first_step
    for _ in range(solver.settings.cuts + 1):
        attempt = step_to(solver, start, start.point.factor + step)
        if not attempt.failure and not np.array_equal(attempt.u, start.point.u):
            return kept(solver.problem, arrive(solver, attempt))
        solver.tally.cuts += 1
        step *= 0.5
    raise stopped(start, attempt)  # pyright: ignore


def _advance(
    solver: Solver, station: Station, rule: ArcRule, length: float, moved: NDArray
) -> Attempt:
    """One step of a given length along the path, in the direction of the last motion `moved`."""
    climb = _climb(station, length, moved)
    prediction = climb * station.response
    problem, point = solver.problem, station.point
    clear = clear_share(problem, point.u, prediction)
    factor = point.factor + clear * climb
    u = point.u + clear * prediction
    u[problem.held] = problem.prescribed(factor)
    if clear == 0.0 or not np.isfinite(problem.turn(point.u, u)):
        return Attempt(u, factor, 0, UNKNOWN, COLLIDES)
    return solver.correct(u, factor, rule(length, prediction), origin=point.u)


def _climb(station: Station, length: float, moved: NDArray) -> float:
    """Change of the load factor over a length along the tangent, in the direction of a motion."""
    size = float(np.linalg.norm(station.response))
    return float(np.copysign(length / size, station.response @ moved))


def _cosine(one: NDArray, other: NDArray) -> float:
    sizes = float(np.linalg.norm(one)) * float(np.linalg.norm(other))
    return float(one @ other) / sizes if sizes > 0.0 else 0.0
