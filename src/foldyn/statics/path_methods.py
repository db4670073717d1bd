"""The methods for following a path, the course it takes, and the points that belong to it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.statics.continuation import ArcRule, Cylinder, Plane, follow
from foldyn.statics.newton import Solver
from foldyn.statics.stability import LostError, Section, critical_points
from foldyn.statics.stepping import PathStoppedError, Station, Walk, arrive, kept, recall, walk
from foldyn.values import choice, number, numbers, show

STEPS_DRIVEN = 10
STEPS_FREE = 100
FIRST_STEP = 0.05  # of the load, or of the range to the last load factor


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
    "mgdcm": PathMethod("mgdcm", Plane, True),
    "arc_length": PathMethod("arc_length", Cylinder, True),
}


class PathPlan(NamedTuple):
    """How a path is followed, from its start to its end."""

    method: PathMethod
    begin: float
    factors: list[float]  # that drive the path; empty if the factor is free
    end: float | None  # end of a free factor
    steps: int
    first_step: float
    durations: Sequence[float] = ()  # s, of the steps to `factors`; empty without time


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
                f": number {i + 1} repeats the one before, {one:g}, which takes a duration",
                "load_factors",
            )
    return PathPlan(method, factors[0], factors[1:], None, len(factors) - 1, 0.0, durations)


def _durations(given: Any, steps: int) -> list[float]:
    """Times (s) of a number of steps."""
    array = numbers("duration", given)
    if array.ndim > 1 or (array.ndim and len(array) != steps) or not (array >= 0.0).all():
        raise InputError(
            f" = {show(given)}: give the time (s) of a step, at least 0, or that of each of the "
            f"{steps} steps",
            "duration",
        )
    return np.broadcast_to(array, steps).tolist()


def along(solver: Solver, start: Station, plan: PathPlan, direction: NDArray | None = None) -> Walk:
    """Stations of a path after its first one; `direction` as in `continuation.follow`."""
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
    """The way until the load factor first passes `end`; its last station lies exactly there."""
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
    """Station at the load factor `end` between two others; the second one if none is found."""
    section = Section(solver, before, after)
    recall(solver.problem, before)
    try:
        near = section.zero(lambda mark: mark.station.point.factor - end, 1e-10).station
    except LostError:
        recall(solver.problem, after)
        return after
    attempt = solver.correct(near.point.u, end, stiffness=near.stiffness)
    strayed = np.linalg.norm(attempt.u - near.point.u) > 1e-3 * np.sqrt(section.whole)
    if attempt.failure or strayed:
        recall(solver.problem, after)
        return after
    return kept(solver.problem, arrive(solver, attempt))
