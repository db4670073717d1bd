"""Discrete gradients of functions of the mutual distances of four points.

In a step the points move by dx about their mean positions x, and a measure e, such as a squared
distance, changes from e0 to e1. Let D be the deforming part of dx, without the rigid motion (least
squares about x). Then

    g = grad e(x) + (e1 - e0 - grad e(x) . dx) D / |D|^2

does exactly the work e1 - e0. It has neither a resultant nor a moment about x, because the gradient
of a measure has none and D, which is orthogonal to all rigid motions, has none (Gonzalez, J.
Nonlinear Sci. 6, 1996). The correction is of third order in the step. It vanishes for the squared
distance of points that remain the closest ones.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.discrete_gradient import inertia_inverse, moment_of, turned_by

NOISE = 16.0 * float(np.finfo(float).eps)  # rounding error of a measure, relative to positions


class Move(NamedTuple):
    """Motion of four points in a step, and scratch arrays for a measure."""

    start: NDArray  # (4, 3) m
    middle: NDArray  # (4, 3) m
    end: NDArray  # (4, 3) m
    motion: NDArray  # (4, 3) dx, m
    deform: NDArray  # (4, 3) D, m
    by_end: NDArray  # (12, 12) derivative of D with respect to the end positions
    slope: NDArray  # (12,) gradient of a measure at the midpoint of the step
    second: NDArray  # (12, 12) second derivative at the midpoint
    after: NDArray  # (12,) gradient at the end
    gradient: NDArray  # (12,) discrete gradient
    weights: NDArray  # (4,) weights of a distance; see `mechanics.contact.potential`
    moves: NDArray  # (2, 4) derivatives of the weights
    apart: NDArray  # (3,) distance vector, m


def new_move() -> Move:
    """Scratch arrays for four points."""
    shapes = *[(4, 3)] * 5, (12, 12), (12,), (12, 12), (12,), (12,), (4,), (2, 4), (3,)
    return Move(*map(np.zeros, shapes))


@inner
def go(move, tangent):
    """Compute the move from start and end; return |D|^2 (m2) and the largest coordinate (m).

    tangent : whether to compute the derivative of D too.
    """
    r, d, farthest = np.empty((4, 3)), move.deform, 0.0
    for c in range(3):
        middle, shift = 0.0, 0.0
        for v in range(4):
            x0, x1 = move.start[v, c], move.end[v, c]
            farthest = max(farthest, abs(x0), abs(x1))
            move.middle[v, c], move.motion[v, c] = 0.5 * (x0 + x1), x1 - x0
            middle += 0.25 * move.middle[v, c]
            shift += 0.25 * move.motion[v, c]
        for v in range(4):
            r[v, c], d[v, c] = move.middle[v, c] - middle, move.motion[v, c] - shift
    inverse = inertia_inverse(r)
    w, size = (0.0, 0.0, 0.0), 0.0
    for _ in range(2):  # twice, as narrow pairs lose digits in the inverse
        turn = turned_by(inverse, *moment_of(r, d))
        for v in range(4):
            d[v, 0] -= turn[1] * r[v, 2] - turn[2] * r[v, 1]
            d[v, 1] -= turn[2] * r[v, 0] - turn[0] * r[v, 2]
            d[v, 2] -= turn[0] * r[v, 1] - turn[1] * r[v, 0]
        w = (w[0] + turn[0], w[1] + turn[1], w[2] + turn[2])
        for c in range(3):
            shift = 0.25 * (d[0, c] + d[1, c] + d[2, c] + d[3, c])
            for v in range(4):
                d[v, c] -= shift
    for v in range(4):
        for c in range(3):
            size += d[v, c] * d[v, c]
    if tangent:
        _by_end(move, r, w, inverse)
    return size, farthest


@inner
def _by_end(move, r, w, inverse):
    """Derivative of D = dx - w x r with respect to the end, which moves r by half, and w."""
    one, moved = np.zeros(3), np.zeros(3)
    for v in range(4):
        for c in range(3):
            one[:] = 0.0
            one[c] = 1.0
            # contribution of the end to D and to the moment of dx about x: e - w x e / 2
            moved[0] = one[0] - 0.5 * (w[1] * one[2] - w[2] * one[1])
            moved[1] = one[1] - 0.5 * (w[2] * one[0] - w[0] * one[2])
            moved[2] = one[2] - 0.5 * (w[0] * one[1] - w[1] * one[0])
            d, a = move.deform[v], r[v]
            turn = turned_by(
                inverse,
                0.5 * (one[1] * d[2] - one[2] * d[1]) + a[1] * moved[2] - a[2] * moved[1],
                0.5 * (one[2] * d[0] - one[0] * d[2]) + a[2] * moved[0] - a[0] * moved[2],
                0.5 * (one[0] * d[1] - one[1] * d[0]) + a[0] * moved[1] - a[1] * moved[0],
            )
            for i in range(4):
                share = 0.75 if i == v else -0.25
                row, b = 3 * i, r[i]
                column = 3 * v + c
                move.by_end[row, column] = share * moved[0] - turn[1] * b[2] + turn[2] * b[1]
                move.by_end[row + 1, column] = share * moved[1] - turn[2] * b[0] + turn[0] * b[2]
                move.by_end[row + 2, column] = share * moved[2] - turn[0] * b[1] + turn[1] * b[0]


@inner
def add_measure(move, size, farthest, change, law, law_slope, tangent, force, block):
    """Add the force (12,) of a measure, and the derivative (12, 12) with respect to the end.

    size, farthest : results of `go`.
    change : change of the measure in the step.
    law, law_slope : quotient of the changes of an energy and of the measure, N per unit of the
        measure's gradient, and the derivative of this quotient with respect to the end measure.
    tangent : whether to compute the derivative.
    """
    dx, deform = flat(move.motion), flat(move.deform)
    missed, rounding, share = change, 0.0, 0.0
    for i in range(12):
        missed -= move.slope[i] * dx[i]
        rounding += abs(move.slope[i])
    if abs(missed) > NOISE * farthest * rounding and size > 0.0:
        share = missed / size
    for i in range(12):
        move.gradient[i] = move.slope[i] + share * deform[i]
        force[i] += law * move.gradient[i]
    if not tangent:
        return
    for j in range(12):
        along, half = 0.0, 0.0
        if share != 0.0:
            for i in range(12):
                half += 0.5 * move.second[j, i] * dx[i]
                along += move.by_end[i, j] * deform[i]
            along = (move.after[j] - move.slope[j] - half - 2.0 * share * along) / size
        for i in range(12):
            value = 0.5 * move.second[i, j] + share * move.by_end[i, j] + along * deform[i]
            block[i, j] += law * value + law_slope * move.gradient[i] * move.after[j]
