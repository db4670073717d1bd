"""A vertex against a triangle, and an edge against an edge: energy, force and tangent.

If the point of a triangle closest to a vertex lies on a shared side or corner, each triangle with
this side or corner would count it. So shared parts are subtracted:

    V = b(d_T) - 1/2 sum b(d_E) + sum b(d_V) / n

with sums over the sides E that two triangles share and over the corners V that n triangles enclose.
Over a flat sheet, the sum over all triangles is b(d), also above inner sides and corners.

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
from foldyn.mechanics.contact.distances import (
    CORNER_A,
    CORNER_B,
    CORNER_C,
    EDGES,
    SIDE_AB,
    SIDE_BC,
    SIDE_CA,
    VERTEX,
    apart,
    between,
    closest_end,
    closest_of_segments,
    closest_on_segment,
    closest_on_triangle,
    cross,
    dot,
    minus,
    nodes_of,
    point,
    put_corners,
    weights_of,
)
from foldyn.mechanics.contact.potential import add_second, barrier

PARTS = 7  # parts of a triangle: itself, its sides, its corners


@inner
def _press(force, nodes, weights, r, d0, k):
    """Energy k d0^2 f(d/d0) of a distance d = |r| between four nodes, and the force along r.

    Adds the gradient to `force`, unless that is None.

    weights : coefficients of the nodes' positions in r.
    """
    d = math.sqrt(dot(r, r))
    if d >= d0:
        return 0.0, 0.0
    f, f1, _ = barrier(d / d0)
    if force is not None:
        by = k * d0 * f1 / d
        for i in range(4):
            for axis in range(3):
                force[nodes[i], axis] += by * weights[i] * r[axis]
    return k * d0 * d0 * f, -k * d0 * f1


@kernel
def vertex_triangle(tables, x, force, v, t, d0):
    """Energy (J) of vertex v against triangle t at positions x (n, 3), and the normal force (N).

    Adds the gradient to force (n, 3), unless that is None. Also returns the weights of the second
    and third corner at the closest point. Normal forces of a triangle's parts are summed like their
    energies, so that over a flat sheet the sum equals the force everywhere.
    """
    nodes, k = nodes_of(tables.triangles, tables.edges, VERTEX, v, t), tables.stiffness
    p, a, b, c = point(x, nodes[0]), point(x, nodes[1]), point(x, nodes[2]), point(x, nodes[3])
    wa, second, third, _ = closest_on_triangle(p, a, b, c)
    r = apart(p, a, b, c, wa, second, third)
    if dot(r, r) >= d0 * d0:
        return 0.0, 0.0, second, third
    energy, pressed = _press(force, nodes, (1.0, -wa, -second, -third), r, d0, k)
    for side in range(3):
        for which in (1 + side, 4 + side):
            share = share_of(tables, t, which)
            if share != 0.0:
                wa, wb, wc, _ = _closest_on_part(p, a, b, c, which)
                r = apart(p, a, b, c, wa, wb, wc)
                more, push = _press(force, nodes, (1.0, -wa, -wb, -wc), r, d0, share * k)
                energy, pressed = energy + more, pressed + push
    return energy, pressed, second, third


@inner_scalar
def _on_side(s, side, first, second):
    """Region of the point at fraction s of a side between two corners."""
    return first if s <= 0.0 else (second if s >= 1.0 else side)


@inner
def _closest_on_part(p, a, b, c, which):
    """Weights of the closest point on a part of a triangle, and the point's region.

    which : 0 for the triangle, 1 to 3 for its sides, 4 to 6 for its corners.
    """
    if which == 0:
        return closest_on_triangle(p, a, b, c)
    if which == 1:
        s = closest_on_segment(p, a, b)
        return 1.0 - s, s, 0.0, _on_side(s, SIDE_AB, CORNER_A, CORNER_B)
    if which == 2:
        s = closest_on_segment(p, b, c)
        return 0.0, 1.0 - s, s, _on_side(s, SIDE_BC, CORNER_B, CORNER_C)
    if which == 3:
        s = closest_on_segment(p, c, a)
        return s, 0.0, 1.0 - s, _on_side(s, SIDE_CA, CORNER_C, CORNER_A)
    if which == 4:
        return 1.0, 0.0, 0.0, CORNER_A
    return 0.0, (1.0 if which == 5 else 0.0), (1.0 if which == 6 else 0.0), CORNER_A


@inner
def weigh_triangle(corners, which, weights, moves):
    """Set weights (4,) and moves (2, 4) for the distance of a vertex from a part of a triangle.

    corners : (4, 3) of the vertex and the triangle; which : see `_closest_on_part`.

    Returns the number of parameters over which the distance is minimized; see `potential`.
    """
    p, a, b, c = point(corners, 0), point(corners, 1), point(corners, 2), point(corners, 3)
    wa, wb, wc, region = _closest_on_part(p, a, b, c, which)
    weights[0], weights[1], weights[2], weights[3] = 1.0, -wa, -wb, -wc
    moves[:] = 0.0
    if region < SIDE_AB:
        moves[0, 1], moves[0, 2] = 1.0, -1.0
        moves[1, 1], moves[1, 3] = 1.0, -1.0
        return 2
    if region <= SIDE_CA:
        first = region - SIDE_AB
        moves[0, 1 + first], moves[0, 1 + (first + 1) % 3] = 1.0, -1.0
        return 1
    return 0


@inner_scalar
def share_of(tables, t, which):
    """Coefficient of a part of triangle t; see `weigh_triangle`."""
    if which == 0:
        return 1.0
    if which < 4:
        return -tables.shared_side[t, which - 1]
    return tables.shared_corner[tables.triangles[t, which - 4]]


@kernel
def vertex_triangle_tangent(tables, x, v, t, d0, out):
    """Add the Hessian of the energy of `vertex_triangle` to out (12, 12); return the energy.

    Rows and columns belong to the vertex and then the corners.
    """
    corners, slope, energy = np.empty((4, 3)), np.zeros(12), 0.0
    weights, moves = np.empty(4), np.empty((2, 4))
    put_corners(x, nodes_of(tables.triangles, tables.edges, VERTEX, v, t), corners)
    for which in range(PARTS):
        k = tables.stiffness * share_of(tables, t, which)
        free = weigh_triangle(corners, which, weights, moves)
        energy += add_second(corners, weights, moves, free, d0, k, out, slope)
        if which == 0 and energy == 0.0:
            return 0.0
    return energy


PARALLEL = 1e-3


@inner_scalar
def mollifier(cc, c0):
    """The factor m at a squared cross product, and its first two derivatives."""
    if cc >= c0:
        return 1.0, 0.0, 0.0
    return (2.0 - cc / c0) * cc / c0, 2.0 * (1.0 - cc / c0) / c0, -2.0 / (c0 * c0)


@kernel
def edge_edge(tables, x, force, i, j, d0):
    """Energy (J) of edges i and j at positions x (n, 3), and the normal force (N).

    Adds the gradient to force (n, 3), unless that is None. Also returns the fractions of the
    closest points on both edges.
    """
    nodes = nodes_of(tables.triangles, tables.edges, EDGES, i, j)
    pa, pb, pc, pd = point(x, nodes[0]), point(x, nodes[1]), point(x, nodes[2]), point(x, nodes[3])
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
    k = m * tables.stiffness
    energy, pressed = _press(force, nodes, weights_of(EDGES, first, second), r, d0, k)
    s, t, square = closest_end(pa, pb, pc, pd)
    if square < d0 * d0:
        r = between(pa, pb, pc, pd, s, t)
        more, push = _press(force, nodes, weights_of(EDGES, s, t), r, d0, -k)
        energy, pressed = energy + more, pressed + push
    if force is not None and m1 > 0.0 and m > 0.0:
        by = 2.0 * m1 * energy / m
        ee, gg, eg = dot(e, e), dot(g, g), dot(e, g)
        for axis in range(3):
            de = by * (e[axis] * gg - g[axis] * eg)
            dg = by * (g[axis] * ee - e[axis] * eg)
            force[nodes[1], axis] += de
            force[nodes[0], axis] -= de
            force[nodes[3], axis] += dg
            force[nodes[2], axis] -= dg
    return energy, pressed, first, second


@inner
def weigh_edges(corners, which, weights, moves):
    """Set weights (4,) and moves (2, 4) for the distance of two edges, or of the closest end.

    corners : (4, 3) of the first edge and the second.
    which : 0 for the edges, 1 for the closest end.

    Returns the number of parameters over which the distance is minimized, and whether the closest
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
    put_corners(x, nodes_of(tables.triangles, tables.edges, EDGES, i, j), corners)
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
    """Derivatives (12,) and (12, 12) of |e x g|^2 with respect to the ends of both edges."""
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
