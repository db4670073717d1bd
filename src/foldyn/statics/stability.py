"""Critical points between the points of a path, located and classified.

If the count of negative eigenvalues of the tangent changes along a step, an eigenvalue has passed
through zero. The step is halved until one crossing remains. The crossing is then located as the
zero of the tangent's determinant, evaluated at equilibria in planes across the step.

If no equilibria are found close to a crossing, the load factors of the nearest equilibria on both
sides bracket it, and one of these equilibria stands for it.

At a limit point the load factor turns: the response to the factor points along the step on one
side and against it on the other. At a bifurcation it does not, and another path crosses.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, eigsh

from foldyn.algebra.superlu import Factorization
from foldyn.statics.newton import Solver, plane
from foldyn.statics.stepping import Station, arrive, kept

APART = 1e-6  # share of a step within which crossings count as one multiple point
SHARP = 1e-13  # accuracy of a located point or crossing, as a share of the step
LOOKS = 0.5, 0.25, 0.75  # shares of the way between two equilibria, tried in turn to find another


class Mark(NamedTuple):
    """A station at a share of the way along a step."""

    share: float
    station: Station

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues at the station."""
        return self.station.point.negative


class LostError(Exception):
    """No equilibrium was found on a section of the path."""


class Section:
    """Equilibria in planes across a step from one station to another."""

    def __init__(self, solver: Solver, start: Station, end: Station) -> None:
        self.solver, self.start = solver, start
        self.chord = end.point.u - start.point.u
        self.whole = float(self.chord @ self.chord)
        self.ends = Mark(0.0, start), Mark(1.0, end)
        times = (getattr(station.point.memory, "time", 0.0) for station in (end, start))
        self.seconds = next(times) - next(times)

    def at(self, share: float, low: Mark, high: Mark) -> Mark | None:
        """Station at a share of the step, starting between two marks; None if not found."""
        weight = (share - low.share) / (high.share - low.share)
        one, other = low.station.point, high.station.point
        factor = one.factor + weight * (other.factor - one.factor)
        u = one.u + weight * (other.u - one.u)
        u[self.solver.problem.held] = self.solver.problem.prescribed(factor)
        rule = plane(self.chord, share * self.whole)
        self.solver.problem.elapse(share * self.seconds)
        attempt = self.solver.correct(u, factor, rule, origin=self.start.point.u)
        farthest = 2.0 * np.sqrt(self.whole)  # from the start: twice the length of the step
        if attempt.failure or np.linalg.norm(attempt.u - self.start.point.u) > farthest:
            return None
        return Mark(share, arrive(self.solver, attempt))

    def share(self, station: Station) -> float:
        """Share of the step at which a station lies."""
        return float((station.point.u - self.start.point.u) @ self.chord) / self.whole

    def zero(
        self, function: Callable[[Mark], float], xtol: float,
        ends: tuple[Mark, Mark] | None = None, nearest: bool = False,
    ) -> Mark:  # fmt: skip
        """Mark between two others at which a function of marks vanishes; raises `LostError`.

        xtol : accuracy of the mark, as a share of the step.
        ends : the two marks; the ends of the section by default.
        nearest : whether iterations start between the nearest known marks.
        """
        from scipy.optimize import brentq

        low, high = ends or self.ends
        marks = {low.share: low, high.share: high}

        def value(share: float) -> float:
            if share not in marks:
                one, other = low, high
                if nearest:
                    one = marks[max(known for known in marks if known < share)]
                    other = marks[min(known for known in marks if known > share)]
                mark = self.at(share, one, other)
                if mark is None:
                    raise LostError
                marks[share] = mark
            return function(marks[share])

        root = float(brentq(value, low.share, high.share, xtol=xtol))
        value(root)
        return marks[root]

    def slope(self, mark: Mark) -> float:
        """Derivative of the load factor with respect to the share, at a mark."""
        return self.whole / float(self.chord @ mark.station.response)

    def climbs(self, mark: Mark) -> bool:
        """Whether the load factor grows along the step at a mark."""
        return float(self.chord @ mark.station.response) > 0.0


def critical_points(solver: Solver, start: Station, end: Station) -> list[Station]:
    """Stations at the limit and bifurcation points of a step, in order, then the end of the step.

    The end itself stands for a crossing if no equilibrium is found between start and end. All
    other stations are computed with the structure's memory at the start of the step.
    """
    counts = start.point.negative, end.point.negative
    if counts[0] == counts[1] or min(counts) < 0:
        return [end]
    section, found = Section(solver, start, end), []
    solver.problem.recall(start.point.memory)
    for station in _crossings(section, *section.ends):
        if station.point.u is end.point.u:
            end = station
            break
        solver.problem.elapse(section.share(station) * section.seconds)
        found.append(kept(solver.problem, station))
        solver.problem.recall(start.point.memory)
    solver.problem.recall(end.point.memory)
    return [*found, end]


def _crossings(section: Section, low: Mark, high: Mark) -> list[Station]:
    """Stations at all crossings between two marks, by bisection until each is alone."""
    change = abs(high.negative - low.negative)
    if change == 0:
        return []
    if change > 1 and high.share - low.share > APART:
        middle = _between(section, low, high)
        if middle is not None:
            return _crossings(section, low, middle) + _crossings(section, middle, high)
    return [_crossing(section, low, high)]


def _crossing(section: Section, low: Mark, high: Mark) -> Station:
    """The critical point between two marks, as close as equilibria are found."""
    kind = "bifurcation" if section.climbs(low) == section.climbs(high) else "limit"
    count = min(low.negative, high.negative)
    single = abs(high.negative - low.negative) == 1
    if single and low.station.stiffness.symmetric.pivots() is not None:
        try:
            critical = _zero_of_determinant(section, low, high)
        except LostError:
            pass
        else:
            return critical._replace(point=replace(critical.point, negative=count, kind=kind))
    low, high = _bracketed(section, low, high)
    located = high.share - low.share <= APART
    interval = None if located else _interval(section, low, high, kind == "limit")
    if not located and (low.share, high.share) == (0.0, 1.0):
        end = high.station
        return end._replace(point=replace(end.point, kind=kind, interval=interval))
    station = low.station if low.share > 0.0 and high.share == 1.0 else high.station
    point = replace(station.point, negative=count, kind=kind, interval=interval)
    return station._replace(point=point)


def _interval(section: Section, low: Mark, high: Mark, limit: bool) -> tuple[float, float]:
    """Load factors that bracket the critical point between two marks.

    A limit point lies beyond both marks, but not beyond the intersection of their tangents.
    """
    one, other = low.station.point.factor, high.station.point.factor
    if limit:
        rises, falls = section.slope(low), section.slope(high)
        ahead = (other - one - falls * (high.share - low.share)) / (rises - falls)
        farther = max(one, other) if rises > 0.0 else min(one, other)
        one, other = farther, one + rises * ahead
    return min(one, other), max(one, other)


def _zero_of_determinant(section: Section, low: Mark, high: Mark) -> Station:
    """Station between two marks at which the determinant of the tangent vanishes."""
    scale = _log_determinant(low)

    def determinant(mark: Mark) -> float:
        if mark.negative < 0:
            raise LostError
        sign = 1.0 if (mark.negative - low.negative) % 2 == 0 else -1.0
        return sign * float(np.exp(min(_log_determinant(mark) - scale, 600.0)))

    return section.zero(determinant, SHARP, (low, high), nearest=True).station


def _log_determinant(mark: Mark) -> float:
    pivots = mark.station.stiffness.symmetric.pivots()
    with np.errstate(divide="ignore"):
        return float(np.log(np.abs(pivots)).sum()) if pivots is not None else np.nan


def _bracketed(section: Section, low: Mark, high: Mark) -> tuple[Mark, Mark]:
    """The nearest marks found on the two sides of a crossing."""
    while high.share - low.share > SHARP:
        middle = _between(section, low, high)
        if middle is None:
            break
        low, high = (middle, high) if middle.negative == low.negative else (low, middle)
    return low, high


def _between(section: Section, low: Mark, high: Mark) -> Mark | None:
    """A mark between two others at which negative eigenvalues are counted; None if not found."""
    for weight in LOOKS if high.share - low.share > APART else LOOKS[:1]:
        share = low.share + weight * (high.share - low.share)
        mark = section.at(share, low, high) if low.share < share < high.share else None
        if mark is not None and mark.negative >= 0:
            return mark
    return None


def critical_modes(solver: Solver, station: Station, count: int = 1) -> tuple[NDArray, NDArray]:
    """Eigenvalues (k,) of the tangent nearest to zero, N/m, and oriented shapes (m, k)."""
    problem = solver.problem
    matrix = solver.reduce(station.stiffness.matrix).symmetric
    values, vectors = softest_modes(matrix, station.stiffness.symmetric, count, dense=300)
    nearest = np.argsort(np.abs(values))[:count]
    shapes = np.zeros((len(problem.free) + len(problem.held), len(nearest)))
    shapes[problem.free] = vectors[:, nearest]
    return values[nearest], oriented(shapes)


def softest_modes(
    matrix: Any, factors: Factorization, count: int, dense: int, shift: float = 0.0
) -> tuple[NDArray, NDArray]:
    """Eigenvalues of a symmetric matrix nearest to a shift, and their vectors.

    Returns all eigenvalues for up to `dense` rows; for more rows, uses Lanczos' method with the
    factors at the shift.
    """
    size = matrix.shape[0]
    if size <= dense or count >= size - 1:
        return np.linalg.eigh(matrix.toarray())
    inverse = LinearOperator((size, size), matvec=factors.solve)
    start = np.random.default_rng(0).standard_normal(size)
    return eigsh(matrix, k=count, sigma=shift, OPinv=inverse, v0=start)


def oriented(shapes: NDArray) -> NDArray:
    """Shapes (m, k) with the largest entry of each positive, independent of the solver.

    Among entries that are equal to within round-off, the first one decides.
    """
    size = np.abs(shapes)
    first = np.argmax(size > (1.0 - 1e-6) * size.max(axis=0), axis=0)
    return shapes * np.sign(shapes[first, np.arange(shapes.shape[1])])
