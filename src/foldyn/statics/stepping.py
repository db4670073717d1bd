"""Paths driven by the load factor: load stepping with Newton's method.

A step that does not converge, or that snaps to somewhere else, is tried again with a line search
and then halved; after a success steps grow again. So a path ends where no equilibrium follows it:
at a limit point, which only the methods with a moving load factor pass.
"""

from __future__ import annotations

from collections.abc import Sequence

from foldyn.statics.newton import COLLIDES, Attempt, Solver
from foldyn.statics.station import PathStoppedError, Station, Walk, arrive, snapped

SNAPS = "the structure snaps to a state off its path"
REMEDY_LIMIT = (
    "a limit point may lie ahead: method 'arc_length' follows the path through it "
    "(or take smaller steps)"
)
REMEDY_COLLISION = "let the folds lock before panels meet (fold_law 'enhanced')"


def step_to(solver: Solver, start: Station, factor: float) -> Attempt:
    """Equilibrium at another load factor, on the path on which `start` lies."""
    plain = _guarded(solver, start, solver.correct(start.point.u, factor, None, start.stiffness))
    if not plain.failure or plain.failure == SNAPS:
        return plain
    searched = solver.correct(start.point.u, factor, None, start.stiffness, search=True)
    searched = _guarded(solver, start, searched)
    return plain if searched.failure else searched


def _guarded(solver: Solver, start: Station, attempt: Attempt) -> Attempt:
    """The attempt, refused if it has snapped to a state off its path."""
    if not attempt.failure and snapped(solver, start, attempt):
        return attempt._replace(failure=SNAPS)
    return attempt


def walk(solver: Solver, start: Station, factors: Sequence[float], between: bool) -> Walk:
    """Stations at the given factors, reached in turn, and those in between if `between`."""
    station = start
    step = abs(factors[0] - start.point.factor) if len(factors) else 0.0
    for goal in factors:
        origin = station.point.factor
        whole = abs(goal - origin)
        step = min(max(step, 1e-3 * whole), whole)
        shortest = whole * 2.0**-solver.settings.cuts
        while station.point.factor != goal:
            left = goal - station.point.factor
            # no crumbs: the rest is taken in one or in two equal steps
            length = abs(left) if abs(left) <= 1.01 * step else min(step, 0.5 * abs(left))
            target = goal if length == abs(left) else station.point.factor + length * _sign(left)
            attempt = step_to(solver, station, target)
            if attempt.failure:
                solver.tally.cuts += 1
                step = 0.5 * length
                if step < shortest:
                    raise stopped(station, attempt)
                continue
            if attempt.iterations <= 2 * solver.settings.target:
                step = max(step, min(2.0 * length, whole))
            station = arrive(solver, attempt)
            if between or target == goal:
                yield station


def stopped(station: Station, attempt: Attempt) -> PathStoppedError:
    """The end of a path driven by the load factor."""
    return PathStoppedError(
        f"no equilibrium was found beyond the load factor {station.point.factor:.6g} "
        f"({attempt.failure})",
        REMEDY_COLLISION if attempt.failure == COLLIDES else REMEDY_LIMIT,
    )


def _sign(value: float) -> float:
    return 1.0 if value >= 0.0 else -1.0
