"""Pseudo-arclength continuation of a family of motions, R(z, p) = 0.

A step is predicted along the unit tangent and corrected at right angles to it (Keller, in
Applications of Bifurcation Theory, ed. Rabinowitz, 1977; Seydel, Practical Bifurcation and
Stability Analysis, 3rd ed. 2010, chapter 4). The length of a step combines |dz| divided by the size
of the motion and |dp| divided by the range of the parameter.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lu_factor, lu_solve

from foldyn.periodic.families import Family

ITERATIONS = 8  # most iterations of Newton's method per step
EASY = 4  # iterations up to which the next step is longer
GROWTH, CUT = 1.5, 0.5
NOISE = 10.0  # a residual below this many times its rounding counts as zero
STRAIGHT = np.cos(np.radians(25.0))  # least cosine between the tangents at the ends of a step
SMALLEST = 1e-5  # the branch is lost if steps become shorter than this fraction of the longest
LOCATED = 1e-11  # accuracy of located points, as a fraction of the step
MISSES = 8  # a search for a special point ends after more failures than this
NEAR = 0.2  # a step passes points up to this distance from it, as a fraction of its length


@dataclass(frozen=True, eq=False)
class Point:
    """A motion of a family.

    Attributes
    ----------
    z, p
        Unknowns (n,) and parameter.
    tangent : ndarray, shape (n + 1,)
        Unit tangent of the curve, dz and dp.
    side : float
        Sign of the determinant of the bordered matrix; it changes where branches cross.
    iterations : int
    """

    z: NDArray
    p: float
    tangent: NDArray
    side: float
    iterations: int = 0


def _weights(family: Family, z: NDArray) -> NDArray:
    """Weights (n + 1,) of the squares in the length of a step at z."""
    return np.append(np.full(len(z), family.size(z) ** -2.0), family.span**-2.0)


def _bordered(family: Family, z: NDArray, p: float, row: NDArray):
    """LU factors of the derivative with respect to z and p, with `row` added as the last row."""
    n = len(z)
    matrix = np.empty((n + 1, n + 1))
    matrix[:n, :n] = family.jacobian(z, p)
    matrix[:n, n] = family.slope(z, p)
    matrix[n] = row
    return lu_factor(matrix, overwrite_a=True, check_finite=False)


def _side(factors) -> float:
    """Sign of the determinant of a matrix, from its LU factors."""
    lu, swaps = factors
    odd = np.count_nonzero(swaps != np.arange(len(swaps))) % 2
    return float(np.prod(np.sign(np.diag(lu))) * (-1.0 if odd else 1.0))


def corrected(
    family: Family, z: NDArray, p: float, row: NDArray, most: int = ITERATIONS
) -> tuple[NDArray, float, int] | None:
    """Motion near (z, p), in the plane through (z, p) normal to `row`; None if not found."""
    z, p, last = z.copy(), p, np.inf
    for iteration in range(most):
        residual = family.residual(z, p)
        norm = float(np.linalg.norm(residual))
        if not np.isfinite(norm):
            return None
        step = -lu_solve(_bordered(family, z, p, row), np.append(residual, 0.0), check_finite=False)
        if not np.isfinite(step).all():
            return None
        z, p = z + step[:-1], p + float(step[-1])
        change = float(np.sqrt(_weights(family, z) @ step**2))
        if change <= family.tolerance or (iteration and norm <= NOISE * family.rounding):
            return z, p, iteration + 1
        if iteration > 1 and change > 2.0 * last:
            return None
        last = change
    return None


def point_at(family: Family, z: NDArray, p: float, along: NDArray, iterations: int = 0) -> Point:
    """Point of a motion, with the tangent in the direction of `along` (n + 1,)."""
    weights = _weights(family, z)
    row = weights * along
    factors = _bordered(family, z, p, row / np.abs(row).max())
    right = np.zeros(len(row))
    right[-1] = 1.0
    tangent = lu_solve(factors, right, check_finite=False)  # in the direction of the row
    tangent /= np.sqrt(weights @ tangent**2)
    return Point(z, p, tangent, _side(factors), iterations)


def ahead(family: Family, point: Point, length: float) -> Point | None:
    """The point a given length farther along the curve, or None."""
    z, p = point.z + length * point.tangent[:-1], point.p + length * float(point.tangent[-1])
    row = _weights(family, point.z) * point.tangent
    found = corrected(family, z, p, row / np.abs(row).max())
    return None if found is None else point_at(family, *found[:2], point.tangent, found[2])


def located(
    family: Family, point: Point, other: Point, length: float, value: Callable[[Point], float]
) -> Point:
    """The point between two points, `length` apart, at which a function changes its sign.

    Where Newton's method fails, very close to crossing branches, the closest point found is
    returned.
    """
    from scipy.optimize import brentq

    found: dict[float, Point | None] = {0.0: point, length: other}

    def at(ahead_by: float) -> float:
        if ahead_by not in found:
            found[ahead_by] = ahead(family, point, ahead_by)
        reached = found[ahead_by]
        if list(found.values()).count(None) > MISSES:
            raise ArithmeticError
        return value(other if reached is None else reached)  # stay before a failure

    with suppress(ArithmeticError, ValueError):
        brentq(at, 0.0, length, xtol=LOCATED * length, rtol=1e-14, maxiter=60)
    return min((one for one in found.values() if one), key=lambda one: abs(value(one)))


class Stride(NamedTuple):
    """Step length control."""

    first: float
    longest: float
    most: int  # largest number of points


class Step(NamedTuple):
    """A step along a family: its ends and its length."""

    before: Point
    after: Point
    length: float


LOST, LONG = "lost", "long"


def steps(
    family: Family, first: Point, stride: Stride, outside: Callable[[Point], float]
) -> Iterator[Step | str]:
    """Follow a family up to the point at which a function of points exceeds 0.

    A closed curve ends before it returns to its start.

    Yields
    ------
    Step or str
        Finally, instead of a step, LOST if no further point is found, or LONG after the maximum
        number of points.
    """
    point, length = first, stride.first
    for taken in range(stride.most):
        other = ahead(family, point, length)
        while other is None or _turns(family, point, other):
            length *= CUT
            if length < SMALLEST * stride.longest:
                yield LOST
                return
            other = ahead(family, point, length)
        if outside(other) > 0.0:
            if outside(point) < 0.0:
                end = located(family, point, other, length, outside)
                yield Step(point, end, _along(family, point, end))
            return
        step = Step(point, other, length)
        if taken > 1 and _passes(family, step, first):
            return  # the curve is closed
        yield step
        point = other
        if other.iterations <= EASY:
            length = min(length * GROWTH, stride.longest)
        elif other.iterations > EASY + 2:
            length *= CUT
    yield LONG


def _along(family: Family, one: Point, other: Point) -> float:
    """Distance from `one` to `other` along the tangent at `one`."""
    apart = np.append(other.z - one.z, other.p - one.p)
    return float((_weights(family, one.z) * one.tangent) @ apart)


def _passes(family: Family, step: Step, first: Point) -> bool:
    """Whether a step passes the first point, in the direction in which the curve left it."""
    along, weights = _along(family, step.before, first), _weights(family, step.before.z)
    if not 0.0 < along <= step.length or (weights * step.before.tangent) @ first.tangent <= 0.0:
        return False
    apart = np.append(first.z - step.before.z, first.p - step.before.p)
    return bool(weights @ apart**2 - along**2 <= (NEAR * step.length) ** 2)


def _turns(family: Family, one: Point, other: Point) -> bool:
    """Whether the curve turns too far between two points, or jumps to another curve."""
    weights = _weights(family, one.z)
    apart = np.append(other.z - one.z, other.p - one.p)
    if _along(family, one, other) < STRAIGHT * np.sqrt(weights @ apart**2):
        return True
    lengths = np.sqrt((weights @ one.tangent**2) * (weights @ other.tangent**2))
    return bool((weights * one.tangent) @ other.tangent < STRAIGHT * lengths)


def branch_point(family: Family, z: NDArray, p: float, across: NDArray, far: float) -> Point | None:
    """First point of a branch that leaves (z, p) along a direction across (n,), or None.

    far : length of the step, as a fraction of the motion (in units of z if nothing moves).
    """
    size = float(np.linalg.norm(across))
    row = np.append(across / size, 0.0)
    for shrink in (1.0, 0.3, 0.1, 0.03):
        reach = shrink * far * across / size
        found = corrected(family, z + reach, p, row, 2 * ITERATIONS)
        if found is not None:
            along = np.append(found[0] - z, found[1] - p)
            return point_at(family, *found[:2], along, found[2])
    return None
