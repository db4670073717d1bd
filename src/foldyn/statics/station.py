"""Points of a path, and where a walk along it stands."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.statics.newton import Attempt, Solver, Stiffness

NEGLIGIBLE = 1e-6  # of the structure's size: motions below are never a snap


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
    """

    u: NDArray
    factor: float
    iterations: int
    residual: float
    negative: int = -1
    kind: str = "regular"


class Station(NamedTuple):
    """A point with the tangent there and the response to the load factor (m,)."""

    point: Point
    stiffness: Stiffness
    response: NDArray


class PathStoppedError(Exception):
    """A path cannot go on; says why and what to do."""

    def __init__(self, reason: str, remedy: str) -> None:
        super().__init__(f"{reason}; {remedy}")
        self.reason, self.remedy = reason, remedy


Walk = Iterator[Station]


def arrive(solver: Solver, attempt: Attempt) -> Station:
    """Station at the equilibrium that a correction found."""
    stiffness = solver.stiffness(attempt.u, attempt.factor)
    negative = stiffness.factors.negative() if solver.settings.stability else -1
    relative = attempt.balance.relative
    point = Point(attempt.u, attempt.factor, attempt.iterations, relative, negative)
    return Station(point, stiffness, stiffness.response(attempt.u, attempt.factor))


def snapped(solver: Solver, start: Station, attempt: Attempt) -> bool:
    """Whether a step of the load factor went much farther than its linear prediction."""
    climb = abs(attempt.factor - start.point.factor)
    predicted = climb * float(np.linalg.norm(start.response))
    went = float(np.linalg.norm(attempt.u - start.point.u))
    negligible = NEGLIGIBLE * solver.problem.length
    return went > solver.settings.jump * predicted + negligible
