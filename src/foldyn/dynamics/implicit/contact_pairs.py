"""Contact pairs in a step: forces that do exactly the work of their potential.

The potential is a sum over distances d. As with bars, the force of each term is the difference
quotient with respect to d^2 / 2 times the discrete gradient of d^2 / 2, which does exactly the
term's work (`contact_measure`). The potential of two edges, V = m B, changes by mean(m) (B1 - B0)
+ mean(B) (m1 - m0); the second part depends on the squared cross product of the edges.
"""

from __future__ import annotations

import math

import numpy as np

from foldyn.dynamics.implicit.contact_measure import add_measure, go
from foldyn.jit.compiled import inner, kernel
from foldyn.mechanics.contact.distances import EDGES, VERTEX, cross, dot, minus, point
from foldyn.mechanics.contact.pair_potentials import (
    PARALLEL,
    PARTS,
    mollifier,
    share_of,
    square_of_cross,
    weigh_edges,
    weigh_triangle,
)
from foldyn.mechanics.contact.potential import apart_of, barrier, difference_quotient, half_square


@inner
def _weigh(kind, which, corners, move):
    """Set weights and moves; return the number of free weights, and whether an edge pair counts."""
    if kind == VERTEX:
        return weigh_triangle(corners, which, move.weights, move.moves), True
    return weigh_edges(corners, which, move.weights, move.moves)


@inner
def _add_distance(kind, which, d0, k, move, size, tangent, force, block, push):
    """Add force and tangent of the potential k d0^2 f(d/d0); return the energies (J) at both ends.

    size : result of `go`; push : (12,) to which the energy gradient at the end is added.
    """
    _weigh(kind, which, move.start, move)
    x0 = math.sqrt(apart_of(move.start, move.weights, move.apart)) / d0
    _weigh(kind, which, move.end, move)
    x1 = math.sqrt(apart_of(move.end, move.weights, move.apart)) / d0
    if (x0 >= 1.0 and x1 >= 1.0) or k == 0.0:
        return 0.0, 0.0
    before = barrier(x0)[0] if x0 < 1.0 else 0.0
    f, f1, _ = barrier(x1) if x1 < 1.0 else (0.0, 0.0, 0.0)
    for i in range(12):
        move.after[i] = move.weights[i // 3] * move.apart[i % 3]
        push[i] += k * f1 / x1 * move.after[i]
    free, _ = _weigh(kind, which, move.middle, move)
    apart_of(move.middle, move.weights, move.apart)
    half_square(move.middle, move.weights, move.moves, free, move.apart, move.slope, move.second)
    value, slope = difference_quotient(x0, x1)
    law = 2.0 * k * value / (x0 + x1)
    law_slope = (2.0 * k * slope - law) / ((x0 + x1) * x1 * d0 * d0)
    change = 0.5 * d0 * d0 * (x1 - x0) * (x1 + x0)
    add_measure(move, size[0], size[1], change, law, law_slope, tangent, force, block)
    return k * d0 * d0 * before, k * d0 * d0 * f


@kernel
def vertex_step(tables, t, d0, move, tangent, force, block):
    """Add force (12,) and tangent (12, 12) of a vertex with triangle t for a step.

    The tangent is computed only if `tangent`. Returns the energy (J) at the end.
    """
    size, energy, push = go(move, tangent), 0.0, np.zeros(12)
    for which in range(PARTS):
        k = tables.stiffness * share_of(tables, t, which)
        energy += _add_distance(VERTEX, which, d0, k, move, size, tangent, force, block, push)[1]
    return energy


@kernel
def edges_step(tables, i, j, d0, move, tangent, force, block):
    """Add force and tangent of edges i and j, whose closest points must lie inside the edges."""
    inside = _weigh(EDGES, 0, move.end, move)[1]
    if not inside and not _weigh(EDGES, 0, move.start, move)[1]:
        return 0.0
    size, c0 = go(move, tangent), PARALLEL * tables.edge_square[i] * tables.edge_square[j]
    inner, inner_block, push = np.zeros(12), np.zeros((12, 12)), np.zeros(12)
    before = after = 0.0
    for which in range(2):
        k = tables.stiffness if which == 0 else -tables.stiffness
        one, other = _add_distance(
            EDGES, which, d0, k, move, size, tangent, inner, inner_block, push
        )
        before, after = before + one, after + other
    if not inside:
        after = 0.0  # both distances agree up to rounding
    u0, u1 = _across(move.start, c0), _across(move.end, c0)
    m0, m1 = mollifier(u0, 1.0)[0], mollifier(u1, 1.0)[0]
    mean = 0.5 * (m0 + m1)
    for p in range(12):
        force[p] += mean * inner[p]
        for q in range(12):
            block[p, q] += mean * inner_block[p, q]
    if u0 < 1.0 or u1 < 1.0:
        _add_mollifier(u0, u1, c0, before, after, move, size, tangent, inner, push, force, block)
    return m1 * after


@inner
def _across(corners, c0):
    """Squared cross product of two edges, divided by c0."""
    n = cross(*_edges(corners))
    return dot(n, n) / c0


@inner
def _edges(corners):
    """Vectors of two edges."""
    e = minus(point(corners, 1), point(corners, 0))
    return e, minus(point(corners, 3), point(corners, 2))


@inner
def _mollified(u0, u1):
    """Difference quotient of the mollifier m, and the derivative of it with respect to u1.

    m = 1 - v^2 with v = max(1 - u, 0).
    """
    v0, v1 = max(0.0, 1.0 - u0), max(0.0, 1.0 - u1)
    if u0 < 1.0 and u1 < 1.0:
        return v0 + v1, -1.0
    if u0 < 1.0:
        value = v0 * v0 / (u1 - u0)
        return value, -value / (u1 - u0)
    value = v1 * v1 / (u0 - u1)
    return value, (value - 2.0 * v1) / (u0 - u1)


@inner
def _add_mollifier(
    u0, u1, c0, before, after, move, size, tangent, inner, push, force, block
):  # fmt: skip
    """Add the part due to the mollifier of two nearly parallel edges to force and tangent."""
    value, slope = _mollified(u0, u1)
    value, slope, energy = value / c0, slope / (c0 * c0), 0.5 * (before + after)
    e, g = _edges(move.end)
    move.after[:] = square_of_cross(e, g)[0]
    e, g = _edges(move.middle)
    first, second = square_of_cross(e, g)
    move.slope[:], move.second[:] = first, second
    change = (u1 - u0) * c0
    add_measure(
        move, size[0], size[1], change, energy * value, energy * slope, tangent, force, block
    )
    if not tangent:
        return
    turned = 0.5 * mollifier(u1, 1.0)[1] / c0
    for p in range(12):
        for q in range(12):
            block[p, q] += turned * inner[p] * move.after[q]
            block[p, q] += 0.5 * value * move.gradient[p] * push[q]
