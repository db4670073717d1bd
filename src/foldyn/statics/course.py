"""The course of a path: which points belong to it, and where it ends."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import islice

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from foldyn.statics.continuation import ArcRule, follow
from foldyn.statics.newton import Solver
from foldyn.statics.stability import Mark, Section, critical_points
from foldyn.statics.station import PathStoppedError, Station, Walk, arrive
from foldyn.statics.stepping import walk

Until = Callable[[NDArray, float], bool]  # of all dofs (m,) and the load factor


def driven(
    solver: Solver, start: Station, factors: Sequence[float], between: bool, until: Until | None
) -> Walk:
    """Stations at load factors that are given, with `between` all points on the way."""
    way = walk(solver, start, factors, between)
    yield from _ended(_with_critical(solver, start, way) if between else way, until)


def free(
    solver: Solver, start: Station, rule: ArcRule, first_step: float, steps: int,
    end: float | None, until: Until | None, direction: NDArray | None = None,
) -> Walk:  # fmt: skip
    """Stations along a path whose load factor moves freely, up to a number of steps or `end`."""
    way = islice(follow(solver, start, rule, first_step, direction), steps)
    if end is not None:
        way = _up_to(solver, start, way, end, steps)
    yield from _ended(_with_critical(solver, start, way), until)


def _ended(way: Walk, until: Until | None) -> Walk:
    for station in way:
        yield station
        if until is not None and until(station.point.u, station.point.factor):
            return


def _with_critical(solver: Solver, start: Station, way: Walk) -> Walk:
    before = start
    for station in way:
        if solver.settings.stability and solver.settings.locate:
            yield from critical_points(solver, before, station)
        yield station
        before = station


def _up_to(solver: Solver, start: Station, way: Iterator[Station], end: float, steps: int) -> Walk:
    """The way until the load factor first passes `end`, where it stops exactly."""
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
    """Station at the load factor `end` between two others; the one after it if none is found."""
    section = Section(solver, before, after)
    low, high = Mark(0.0, before), Mark(1.0, after)
    found = {0.0: low, 1.0: high}

    def above(share: float) -> float:
        if share not in found:
            mark = section.at(share, low, high)
            if mark is None:
                raise ArithmeticError
            found[share] = mark
        return found[share].station.point.factor - end

    try:
        share = float(brentq(above, 0.0, 1.0, xtol=1e-10))
    except ArithmeticError:
        return after
    above(share)
    near = found[share].station
    attempt = solver.correct(near.point.u, end, stiffness=near.stiffness)
    strayed = np.linalg.norm(attempt.u - near.point.u) > 1e-3 * np.sqrt(section.whole)
    return after if attempt.failure or strayed else arrive(solver, attempt)
