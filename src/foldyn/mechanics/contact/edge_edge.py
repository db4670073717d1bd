"""An edge against an edge: energy, force and tangent.

An edge pair contributes only if the closest points lie inside both edges,

    V = m(|e x g|^2) (b(d_EE) - b(d_end)),

with d_end the distance of the closest end from the other edge, which vertex-triangle pairs already
cover, so that V starts at zero. m(c) = (2 - c/c0) c/c0 below c0 = 1e-3 |e|^2 |g|^2 at rest removes
the jump of the closest points of parallel edges (Li et al., ACM Trans. Graph. 39, 2020).
"""

from __future__ import annotations

import math

import numpy as np

from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.mechanics.contact.distance_hessian import add_second
from foldyn.mechanics.contact.distances import (
    between,
    closest_end,
    closest_of_segments,
    cross,
    dot,
    minus,
    point,
)
from foldyn.mechanics.contact.potential import barrier

PARALLEL = 1e-3


@inner_scalar
def mollifier(cc, c0):
    """The factor m at a squared cross product, and its first two derivatives."""
    if cc >= c0:
        return 1.0, 0.0, 0.0
    return (2.0 - cc / c0) * cc / c0, 2.0 * (1.0 - cc / c0) / c0, -2.0 / (c0 * c0)


@inner
def _part(x, force, nodes, s, t, d0, k):
    """Energy k d0^2 f(d/d0) between the points at s and t of two edges, and its force along d.

    Adds its gradient, unless force is None.
    """
    a, b, c, d = nodes
    r = between(point(x, a), point(x, b), point(x, c), point(x, d), s, t)
    distance = math.sqrt(dot(r, r))
    if distance >= d0:
        return 0.0, 0.0
    f, f1, _ = barrier(distance / d0)
    if force is not None:
        by = k * d0 * f1 / distance
        for axis in range(3):
            force[a, axis] += by * (1.0 - s) * r[axis]
            force[b, axis] += by * s * r[axis]
            force[c, axis] -= by * (1.0 - t) * r[axis]
            force[d, axis] -= by * t * r[axis]
    return k * d0 * d0 * f, -k * d0 * f1


@kernel
def edge_edge(tables, x, force, i, j, d0):
    """Energy (J) of edges i and j at positions x (n, 3), and their normal force (N).

    Adds the gradient to force (n, 3), unless that is None. Also returns the fractions of the
    closest points on both edges.
    """
    a, b = tables.edges[i, 0], tables.edges[i, 1]
    c, d = tables.edges[j, 0], tables.edges[j, 1]
    pa, pb, pc, pd = point(x, a), point(x, b), point(x, c), point(x, d)
    first, second, inside = closest_of_segments(pa, pb, pc, pd)
    if not inside:
        return 0.0, 0.0, first, second
    r = between(pa, pb, pc, pd, first, second)
    if dot(r, r) >= d0 * d0:
        return 0.0, 0.0, first, second
    e, g = minus(pb, pa), minus(pd, pc)
    n = cross(e, g)
    cc = dot(n, n)
    m, m1, _ = mollifier(cc, PARALLEL * tables.edge_square[i] * tables.edge_square[j])
    nodes, k = (a, b, c, d), m * tables.stiffness
    energy, pressed = _part(x, force, nodes, first, second, d0, k)
    s, t, square = closest_end(pa, pb, pc, pd)
    if square < d0 * d0:
        more, push = _part(x, force, nodes, s, t, d0, -k)
        energy, pressed = energy + more, pressed + push
    if force is not None and m1 > 0.0 and m > 0.0:
        by = 2.0 * m1 * energy / m
        ee, gg, eg = dot(e, e), dot(g, g), dot(e, g)
        for axis in range(3):
            de = by * (e[axis] * gg - g[axis] * eg)
            dg = by * (g[axis] * ee - e[axis] * eg)
            force[b, axis] += de
            force[a, axis] -= de
            force[d, axis] += dg
            force[c, axis] -= dg
    return energy, pressed, first, second


@inner
def weigh_edges(corners, which, weights, moves):
    """Set weights (4,) and moves (2, 4) for the distance of two edges, or of the closest end.

    corners : (4, 3) of the first edge and the second.
    which : 0 for the edges, 1 for the closest end.

    Returns the number of parameters over which the distance is minimal, and whether the closest
    points lie inside both edges.
    """
    a, b, c, d = point(corners, 0), point(corners, 1), point(corners, 2), point(corners, 3)
    s, t, inside = closest_of_segments(a, b, c, d)
    if which == 1:
        s, t, _ = closest_end(a, b, c, d)
    weights[0], weights[1], weights[2], weights[3] = 1.0 - s, s, t - 1.0, -t
    moves[:] = 0.0
    free = 0
    if 0.0 < s < 1.0:
        moves[free, 0], moves[free, 1] = -1.0, 1.0
        free += 1
    if 0.0 < t < 1.0:
        moves[free, 2], moves[free, 3] = 1.0, -1.0
        free += 1
    return free, inside


@kernel
def edge_edge_tangent(tables, x, i, j, d0, out):
    """Add the Hessian of the energy of `edge_edge` to out (12, 12); return the energy.

    Rows and columns belong to the ends of edge i and then of edge j.
    """
    corners, inner, slope = np.empty((4, 3)), np.zeros((12, 12)), np.zeros(12)
    weights, moves = np.empty(4), np.empty((2, 4))
    for axis in range(3):
        for end in range(2):
            corners[end, axis] = x[tables.edges[i, end], axis]
            corners[2 + end, axis] = x[tables.edges[j, end], axis]
    free, inside = weigh_edges(corners, 0, weights, moves)
    if not inside:
        return 0.0
    energy = add_second(corners, weights, moves, free, d0, tables.stiffness, inner, slope)
    if energy == 0.0:
        return 0.0
    free, _ = weigh_edges(corners, 1, weights, moves)
    energy += add_second(corners, weights, moves, free, d0, -tables.stiffness, inner, slope)
    e, g = minus(point(corners, 1), point(corners, 0)), minus(point(corners, 3), point(corners, 2))
    n = cross(e, g)
    c0 = PARALLEL * tables.edge_square[i] * tables.edge_square[j]
    m, m1, m2 = mollifier(dot(n, n), c0)
    for p in range(12):
        for q in range(12):
            out[p, q] += m * inner[p, q]
    if m1 == 0.0:
        return m * energy
    first, second = square_of_cross(e, g)
    for p in range(12):
        for q in range(12):
            out[p, q] += m1 * (first[p] * slope[q] + slope[p] * first[q])
            out[p, q] += energy * (m1 * second[p, q] + m2 * first[p] * first[q])
    return m * energy


@inner
def square_of_cross(e, g):
    """First and second derivatives, (12,) and (12, 12), of |e x g|^2 by the ends of both edges."""
    ee, gg, eg = dot(e, e), dot(g, g), dot(e, g)
    by_vectors, twice = np.empty(6), np.empty((6, 6))
    for p in range(3):
        by_vectors[p] = 2.0 * (e[p] * gg - g[p] * eg)
        by_vectors[3 + p] = 2.0 * (g[p] * ee - e[p] * eg)
        for q in range(3):
            one = 1.0 if p == q else 0.0
            twice[p, q] = 2.0 * (gg * one - g[p] * g[q])
            twice[3 + p, 3 + q] = 2.0 * (ee * one - e[p] * e[q])
            twice[p, 3 + q] = 2.0 * (2.0 * e[p] * g[q] - g[p] * e[q] - eg * one)
            twice[3 + q, p] = twice[p, 3 + q]
    first, second = np.empty(12), np.empty((12, 12))
    for p in range(12):
        row, sign = 3 * (p // 6) + p % 3, 1.0 if (p // 3) % 2 else -1.0
        first[p] = sign * by_vectors[row]
        for q in range(12):
            column, other = 3 * (q // 6) + q % 3, 1.0 if (q // 3) % 2 else -1.0
            second[p, q] = sign * other * twice[row, column]
    return first, second
