"""Pairs of a vertex and a triangle, or of two edges: their nodes and distances."""

from __future__ import annotations

import math

from foldyn.jit.compiled import inner, inner_scalar, scalar
from foldyn.mechanics.contact.distances import (
    apart,
    between,
    closest_of_segments,
    closest_on_triangle,
    dot,
    point,
)

VERTEX, EDGES = 0, 1  # kinds of pairs, and the places of their lists in `memory`


@inner_scalar
def nodes_of(triangles, edges, kind, one, other):
    """The four nodes of vertex `one` and triangle `other`, or of these two edges."""
    if kind == VERTEX:
        return one, triangles[other, 0], triangles[other, 1], triangles[other, 2]
    return edges[one, 0], edges[one, 1], edges[other, 0], edges[other, 1]


@inner_scalar
def weights_of(kind, p, q):
    """Weights (4) of the vector from the second part of a pair to the first.

    p, q : its end points: for a triangle, the weights of its second and third corner; for two
    edges, the fractions of their lengths.
    """
    if kind == VERTEX:
        return 1.0, p + q - 1.0, -p, -q
    return 1.0 - p, p, q - 1.0, -q


@inner
def put_corners(x, nodes, out):
    """Set out (4, 3) to the positions of four nodes."""
    a, b, c, d = nodes
    for axis in range(3):
        out[0, axis], out[1, axis] = x[a, axis], x[b, axis]
        out[2, axis], out[3, axis] = x[c, axis], x[d, axis]


@inner_scalar
def vertex_distance(p, a, b, c):
    """Distance (m) of a point from a triangle."""
    wa, wb, wc, _ = closest_on_triangle(p, a, b, c)
    r = apart(p, a, b, c, wa, wb, wc)
    return math.sqrt(dot(r, r))


@inner_scalar
def edge_distance(a, b, c, d):
    """Distance (m) of the segments ab and cd."""
    s, t, _ = closest_of_segments(a, b, c, d)
    r = between(a, b, c, d, s, t)
    return math.sqrt(dot(r, r))


@scalar
def vertex_gap(x, triangles, v, t):
    """Distance (m) of vertex v from triangle t."""
    pa, pb = point(x, triangles[t, 0]), point(x, triangles[t, 1])
    return vertex_distance(point(x, v), pa, pb, point(x, triangles[t, 2]))


@scalar
def edge_gap(x, edges, i, j):
    """Distance (m) of two edges."""
    pa, pb = point(x, edges[i, 0]), point(x, edges[i, 1])
    return edge_distance(pa, pb, point(x, edges[j, 0]), point(x, edges[j, 1]))


@inner
def gap_of(triangles, edges, x, kind, one, other):
    """Distance (m) of a pair."""
    if kind == VERTEX:
        return vertex_gap(x, triangles, one, other)
    return edge_gap(x, edges, one, other)


@inner
def closest_of(triangles, edges, x, kind, one, other):
    """Closest points of a pair, as in `weights_of`; whether inside both edges."""
    a, b, c, d = nodes_of(triangles, edges, kind, one, other)
    pa, pb, pc, pd = point(x, a), point(x, b), point(x, c), point(x, d)
    if kind == VERTEX:
        _, p, q, _ = closest_on_triangle(pa, pb, pc, pd)
        return p, q, True
    return closest_of_segments(pa, pb, pc, pd)


@inner
def corners_gap(kind, corners):
    """Distance (m) of a pair of corners (4, 3)."""
    a, b, c, d = point(corners, 0), point(corners, 1), point(corners, 2), point(corners, 3)
    return vertex_distance(a, b, c, d) if kind == VERTEX else edge_distance(a, b, c, d)
