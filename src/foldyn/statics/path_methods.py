"""The methods for following a path, the course it takes, and the points that belong to it.

With a free load factor a path leads through limit points and snap-backs. A step is predicted along
the tangent of the path, over a given length, and corrected under the rule of the method. The next
length is scaled with the ratio of target to actual iterations; it also shrinks where hinges turn
far and where the path bends in the plane of motion and load factor (with the load factor scaled so
that the first step has a slope of 1). A step is cut if it does not converge, if a hinge turns by
more than 1.5 times `largest_turn`, or if the step lies more than 60 degrees off the previous step
or off the tangent at its own end: it may then have left the path.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import islice, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.statics.newton import COLLIDES, EPS, UNKNOWN, Attempt, Rule, Solver, plane
from foldyn.statics.stability import LostError, Section, critical_points
from foldyn.statics.stepping import (
    PathStoppedError,
    Station,
    Walk,
    arrive,
    kept,
    step_to,
    stopped,
    walk,
)
from foldyn.values import choice, number, numbers, show

STEPS_DRIVEN = 10
STEPS_FREE = 100
FIRST_STEP = 0.05  # first change of the load factor, or fraction of the range to the last factor
# function of the length and the prediction (m,) of a step that returns the step's rule
ArcRule = Callable[[float, NDArray], Rule]

ALIGNED = 0.5  # cosine of a step's largest angle to the previous step and to the tangent at the end
BEND = np.radians(12.0)  # target for the bend of the path within a step
REMEDY = (
    "take smaller steps (first_step, or settings with a smaller largest_turn), or start from a "
    "state that is less symmetric"
)


def normal_plane(length: float, prediction: NDArray) -> Rule:
    """Rule of modified generalized displacement control, the method of MERLIN2, for one step.

    After the prediction c1 = df1 b1, with b1 the response to the load factor at the start of the
    step, every correction a + df b is orthogonal to b1: df = -(b1.a)/(b1.b). Predictions are as
    long as the first step of the path, |df1| = length/|b1|, which with the first response b0 is
    the square root of the generalized stiffness parameter |b0.b0/(b1.b1)| (Leon, Lages, de Araujo
    and Paulino, Comput. Mech. 53, 2014: "modified" because the parameter and the plane use only
    the response of the present step, not also the response of the previous step). If only part of
    a step was taken, the motion is brought back into the plane.
    """
    return plane(prediction, float(prediction @ prediction))


def cylinder(length: float, prediction: NDArray) -> Rule:
    """Rule of the cylindrical arc length for one step: it fixes the distance from start to end.

    With c the motion since the start of the step, a the step of Newton's method at the present
    load factor and b the response to the factor, |c + a + df b| = length is a quadratic equation
    for df (Crisfield, Computers and Structures 13, 1981). The rule takes the root that
    continues in the direction of the step, or nan where the arc does not meet the linearized path.
    """

    def change(moved: NDArray, step: NDArray, response: NDArray) -> float:
        reached = moved + step
        a = float(response @ response)
        b = float(response @ reached)
        c = float(reached @ reached) - length**2
        root = b * b - a * c
        if not root >= 0.0 or a == 0.0:
            return math.nan
        root = math.sqrt(root)
        # without cancellation: one root from a sum of two terms of equal sign, the other by Vieta
        far = -(b + math.copysign(root, b))
        roots = (far / a, c / far if far != 0.0 else 0.0)
        along = [float((reached + root * response) @ prediction) for root in roots]
        return roots[int(np.argmax(along))]

    return change


def follow(
    solver: Solver, start: Station, rule: ArcRule, first_step: float, direction: NDArray | None,
) -> Walk:  # fmt: skip
    """Stations along a path, without end.

    Parameters
    ----------
    solver, start
        Solver, and the station where the path begins.
    rule : ArcRule
        Rule of the method, such as `cylinder`.
    first_step : float
        Change of the load factor in the first step; it sets the length of the following steps.
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

        The tangent at the end of the step must also lie along the step: otherwise the direction in
        which the path continues would be arbitrary.
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
    clear = problem.clear(point.u, prediction)
    factor = point.factor + clear * climb
    u = point.u + clear * prediction
    u[problem.held] = problem.prescribed(factor)
    if clear == 0.0 or not np.isfinite(problem.turn(point.u, u)):
        return Attempt(u, factor, 0, UNKNOWN, COLLIDES)
    return solver.correct(u, factor, rule(length, prediction), origin=point.u)


def _climb(station: Station, length: float, moved: NDArray) -> float:
    """Change of the load factor for a length along the tangent, in the direction of a motion."""
    size = float(np.linalg.norm(station.response))
    return float(np.copysign(length / size, station.response @ moved))


def _cosine(one: NDArray, other: NDArray) -> float:
    sizes = float(np.linalg.norm(one)) * float(np.linalg.norm(other))
    return float(one @ other) / sizes if sizes > 0.0 else 0.0


class PathMethod(NamedTuple):
    """A method for following a path.

    `rule` is None if the load factor drives the path; `between` says whether points between the
    given load factors also belong to the path.
    """

    name: str
    rule: ArcRule | None
    between: bool


METHODS: Mapping[str, PathMethod] = {
    "newton": PathMethod("newton", None, False),
    "displacement": PathMethod("displacement", None, True),
    "mgdcm": PathMethod("mgdcm", normal_plane, True),
    "arc_length": PathMethod("arc_length", cylinder, True),
}


class PathPlan(NamedTuple):
    """How a path is followed, from its start to its end."""

    method: PathMethod
    begin: float
    factors: list[float]  # load factors that drive the path; empty if the factor is free
    end: float | None  # end of a free factor
    steps: int
    first_step: float
    durations: Sequence[float] = ()  # s, of the steps to `factors`; empty without time
    motion: NDArray | None = None  # (n, 3), m, that a path with a free factor continues


def plan_path(
    name: str, load_factors: Any, steps: int | None, first_step: float | None, duration: Any = None
) -> PathPlan:
    """Check the arguments that define the course of a path."""
    method = METHODS[choice("method", name, METHODS)]
    factors = None
    if load_factors is not None:
        array = numbers("load_factors", load_factors)
        if array.ndim != 1 or not array.size:
            raise InputError(
                f" = {show(load_factors)}: give a list of numbers, at least one", "load_factors"
            )
        factors = array.tolist()
    if first_step is not None and method.rule is None:
        raise InputError(
            f": method {name!r} is driven by load_factors or steps; leave it out", "first_step"
        )
    if method.rule is None:
        return _driven(method, factors, steps, duration)
    if duration is not None:
        raise InputError(
            f": method {name!r} finds its load factors on the way, and they may turn back, so that "
            "no step has a time; take 'newton' or 'displacement'",
            "duration",
        )
    if factors is not None and len(factors) != 2:
        raise InputError(
            f": method {name!r} chooses its own; give two numbers, where the "
            f"path begins and ends, instead of {len(factors)}, or leave them out",
            "load_factors",
        )
    begin, end = (0.0, None) if factors is None else factors
    if end == begin:
        raise InputError(f" = {factors}: begin and end must differ", "load_factors")
    way = 1.0 if end is None else end - begin
    step = FIRST_STEP * way if first_step is None else first_step
    if not number("first_step", step):
        raise InputError(f" = {show(first_step)}: give a number that is not zero", "first_step")
    if end is not None and step * way < 0.0:
        raise InputError(f" = {step:g} leads away from the last load factor {end:g}", "first_step")
    if end is not None and abs(step) > abs(way):
        step = way
    return PathPlan(method, begin, [], end, int(steps or STEPS_FREE), float(step))


def _driven(
    method: PathMethod, factors: list[float] | None, steps: int | None, duration: Any
) -> PathPlan:
    """Plan of a path driven by the load factor."""
    if factors is not None and steps is not None:
        raise InputError(
            " and steps: give one of them; steps counts equal steps from 0 to 1", "load_factors"
        )
    if factors is None:
        count = int(steps or STEPS_DRIVEN)
        factors = [k / count for k in range(count + 1)]
    durations = [] if duration is None else _durations(duration, len(factors) - 1)
    for i, (one, other) in enumerate(pairwise(factors)):
        if one == other and not (durations and durations[i] > 0.0):
            raise InputError(
                f": number {i + 1} repeats the previous one, {one:g}, which needs a duration",
                "load_factors",
            )
    return PathPlan(method, factors[0], factors[1:], None, len(factors) - 1, 0.0, durations)


def _durations(given: Any, steps: int) -> list[float]:
    """Duration (s) of each step."""
    array = numbers("duration", given)
    if array.ndim > 1 or (array.ndim and len(array) != steps) or not (array >= 0.0).all():
        raise InputError(
            f" = {show(given)}: give one time (s), at least 0, for all steps, or one for each of "
            f"the {steps} steps",
            "duration",
        )
    return np.broadcast_to(array, steps).tolist()


def along(solver: Solver, start: Station, plan: PathPlan, direction: NDArray | None = None) -> Walk:
    """Stations of a path after its first one; `direction` as in `follow`."""
    method = plan.method
    if method.rule is None:
        way = walk(solver, start, plan.factors, method.between, plan.durations)
    else:
        way = islice(follow(solver, start, method.rule, plan.first_step, direction), plan.steps)
    if plan.end is not None:
        way = _up_to(solver, start, way, plan.end, plan.steps)
    if method.between and solver.settings.stability and solver.settings.locate:
        way = _with_critical(solver, start, way)
    return way


def _with_critical(solver: Solver, start: Station, way: Walk) -> Walk:
    """The stations of a path, with the critical points located between them."""
    before = start
    for station in way:
        yield from critical_points(solver, before, station)
        before = station


def _up_to(solver: Solver, start: Station, way: Iterator[Station], end: float, steps: int) -> Walk:
    """Stations until the load factor first passes `end`; the last one lies exactly at `end`."""
    before = start
    for station in way:
        one, other = before.point.factor - end, station.point.factor - end
        if one * other <= 0.0 and one != 0.0:
            yield station if other == 0.0 else _landed(solver, before, station, end)
            return
        yield station
        before = station
    raise PathStoppedError(
        f"the load factor {end:g} was not reached in {steps} steps",
        "give more steps, or a larger first_step",
    )


def _landed(solver: Solver, before: Station, after: Station, end: float) -> Station:
    """Station at the load factor `end` between two others; `after` if none is found."""
    section = Section(solver, before, after)
    solver.problem.recall(before.point.memory)
    try:
        near = section.zero(lambda mark: mark.station.point.factor - end, 1e-10).station
    except LostError:
        solver.problem.recall(after.point.memory)
        return after
    attempt = solver.correct(near.point.u, end, stiffness=near.stiffness)
    strayed = np.linalg.norm(attempt.u - near.point.u) > 1e-3 * np.sqrt(section.whole)
    if attempt.failure or strayed:
        solver.problem.recall(after.point.memory)
        return after
    return kept(solver.problem, arrive(solver, attempt))
