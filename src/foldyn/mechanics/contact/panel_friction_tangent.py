"""Derivative of friction between panels.

With Q = (|q|^2 - d^2) / 2, its gradient g and Hess Q = a_i a_j I - Hess(d^2 / 2), see
`panel_friction` and `distance_hessian`, it is k Hess Q for a sticking pair, and for a slipping pair
with the normal force N

    mu N / s (Hess Q - g g' / s^2) + mu / s g grad N'.

With N from the end of the last step the second term vanishes, and the derivative is symmetric.
"""

from __future__ import annotations

import math

import numpy as np

from foldyn.jit.compiled import inner, kernel
from foldyn.mechanics.contact.distance_hessian import apart_of, half_square
from foldyn.mechanics.contact.distances import cross, dot, minus, point
from foldyn.mechanics.contact.edge_edge import PARALLEL, mollifier, square_of_cross, weigh_edges
from foldyn.mechanics.contact.pairs import VERTEX, nodes_of, put_corners, weights_of
from foldyn.mechanics.contact.panel_friction import bound, pressed_pair
from foldyn.mechanics.contact.potential import barrier
from foldyn.mechanics.contact.vertex_triangle import PARTS, share_of, weigh_triangle


@kernel
def add_rub_tangent(tables, memory, x, kind, pair, share, out):
    """Add the friction tangent of a pair at x (n, 3), times a share, to out (12, 12)."""
    tie = memory.tie[kind, pair]
    if tie[2] == 0.0:
        return
    one, other = memory.pairs[kind, pair, 0], memory.pairs[kind, pair, 1]
    lagged, k = memory.counts.lagged == 1, tables.stiffness
    pressed = tie[2] if lagged else pressed_pair(tables, memory, x, kind, pair)[0]
    if pressed <= 0.0:
        return
    corners, r, apart = np.empty((4, 3)), np.empty(3), np.empty(3)
    weights, moves, tied = np.empty(4), np.empty((2, 4)), np.empty(4)
    slope, second, normal = np.empty(12), np.empty((12, 12)), np.zeros(12)
    put_corners(x, nodes_of(tables.triangles, tables.edges, kind, one, other), corners)
    tied[0], tied[1], tied[2], tied[3] = weights_of(kind, tie[0], tie[1])
    if kind == VERTEX:
        free = weigh_triangle(corners, 0, weights, moves)
    else:
        free, inside = weigh_edges(corners, 0, weights, moves)
        if not inside:
            return
    square = apart_of(corners, tied, apart) - apart_of(corners, weights, r)
    stretch = math.sqrt(max(0.0, square))
    half_square(corners, weights, moves, free, r, slope, second)
    for i in range(12):
        slope[i] = tied[i // 3] * apart[i % 3] - slope[i]
        for j in range(12):
            moved = tied[i // 3] * tied[j // 3] if i % 3 == j % 3 else 0.0
            second[i, j] = moved - second[i, j]
    most = bound(tables, memory, kind, pair, pressed)
    slips = stretch > most
    pull = k * most / stretch if slips else k
    if slips and not lagged:
        if kind == VERTEX:
            _vertex_slope(tables, corners, other, memory.d0[kind, pair], weights, moves, normal)
        else:
            _edges_slope(tables, corners, one, other, memory.d0[kind, pair], weights, moves, normal)
    for i in range(12):
        for j in range(12):
            value = pull * second[i, j]
            if slips:
                value -= pull * slope[i] * slope[j] / (stretch * stretch)
                value += tables.friction * slope[i] * normal[j] / stretch
            out[i, j] += share * value


@inner
def _add_slope(corners, weights, d0, k, out):
    """Add the gradient of -k d0 f'(d/d0) to out (12,); return its value (N)."""
    r = np.empty(3)
    d = math.sqrt(apart_of(corners, weights, r))
    if d >= d0:
        return 0.0
    _, f1, f2 = barrier(d / d0)
    for i in range(12):
        out[i] -= k * f2 / d * weights[i // 3] * r[i % 3]
    return -k * d0 * f1


@inner
def _vertex_slope(tables, corners, t, d0, weights, moves, out):
    """Gradient (12,) of the normal force of a vertex and triangle t."""
    for which in range(PARTS):
        share = share_of(tables, t, which)
        if share != 0.0:
            weigh_triangle(corners, which, weights, moves)
            _add_slope(corners, weights, d0, share * tables.stiffness, out)


@inner
def _edges_slope(tables, corners, i, j, d0, weights, moves, out):
    """Gradient (12,) of the normal force of edges i and j."""
    e, g = minus(point(corners, 1), point(corners, 0)), minus(point(corners, 3), point(corners, 2))
    n = cross(e, g)
    c0 = PARALLEL * tables.edge_square[i] * tables.edge_square[j]
    m, m1, _ = mollifier(dot(n, n), c0)
    weigh_edges(corners, 0, weights, moves)
    pressed = _add_slope(corners, weights, d0, tables.stiffness, out)
    weigh_edges(corners, 1, weights, moves)
    pressed += _add_slope(corners, weights, d0, -tables.stiffness, out)
    for a in range(12):
        out[a] *= m
    if m1 > 0.0:
        first = square_of_cross(e, g)[0]
        for a in range(12):
            out[a] += m1 * pressed * first[a]
