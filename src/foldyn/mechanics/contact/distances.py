"""Closest points and distances of a vertex and a triangle, and of two edges.

Points are tuples of three numbers. A closest point is given by its weights on the corners; its
region is the part of the triangle that contains it. Search through the regions of a triangle:
Ericson, Real-Time Collision Detection, 2005, section 5.1.5; of two segments: section 5.1.9.
"""

from __future__ import annotations

import math

from foldyn.jit.compiled import inner, inner_scalar, kernel, scalar

INSIDE, SIDE_AB, SIDE_BC, SIDE_CA, CORNER_A, CORNER_B, CORNER_C = range(7)  # regions
PARALLEL = 1e-14  # segments e, g are parallel if |e x g|^2 is less than this times |e|^2 |g|^2


@inner_scalar
def point(x, i):
    """Row i of positions (n, 3)."""
    return x[i, 0], x[i, 1], x[i, 2]


@inner_scalar
def dot(a, b):
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inner_scalar
def minus(a, b):
    """Difference a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@scalar
def cross(a, b):
    """Cross product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inner_scalar
def apart(p, a, b, c, wa, wb, wc):
    """Vector to p from the point of a triangle with the weights wa, wb, wc."""
    return (
        p[0] - wa * a[0] - wb * b[0] - wc * c[0],
        p[1] - wa * a[1] - wb * b[1] - wc * c[1],
        p[2] - wa * a[2] - wb * b[2] - wc * c[2],
    )


@inner_scalar
def between(a, b, c, d, s, t):
    """Vector from the point at fraction t of segment cd to the point at fraction s of ab."""
    return (
        a[0] + s * (b[0] - a[0]) - c[0] - t * (d[0] - c[0]),
        a[1] + s * (b[1] - a[1]) - c[1] - t * (d[1] - c[1]),
        a[2] + s * (b[2] - a[2]) - c[2] - t * (d[2] - c[2]),
    )


@kernel
def closest_on_triangle(p, a, b, c):
    """Weights of the point of a triangle that is closest to p, and that point's region."""
    ab, ac, ap = minus(b, a), minus(c, a), minus(p, a)
    d1, d2 = dot(ab, ap), dot(ac, ap)
    if d1 <= 0.0 and d2 <= 0.0:
        return 1.0, 0.0, 0.0, CORNER_A
    bp = minus(p, b)
    d3, d4 = dot(ab, bp), dot(ac, bp)
    if d3 >= 0.0 and d4 <= d3:
        return 0.0, 1.0, 0.0, CORNER_B
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v = d1 / (d1 - d3)
        return 1.0 - v, v, 0.0, SIDE_AB
    cp = minus(p, c)
    d5, d6 = dot(ab, cp), dot(ac, cp)
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 0.0, 1.0, CORNER_C
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        w = d2 / (d2 - d6)
        return 1.0 - w, 0.0, w, SIDE_CA
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / (d4 - d3 + d5 - d6)
        return 0.0, 1.0 - w, w, SIDE_BC
    whole = 1.0 / (va + vb + vc)
    v, w = vb * whole, vc * whole
    return 1.0 - v - w, v, w, INSIDE


@inner_scalar
def closest_on_segment(p, a, b):
    """Fraction along segment ab of the point closest to p."""
    ab = minus(b, a)
    return min(1.0, max(0.0, dot(minus(p, a), ab) / dot(ab, ab)))


@kernel
def closest_of_segments(a, b, c, d):
    """Fractions of the closest points of segments ab and cd, and whether both are inside."""
    e, g, r = minus(b, a), minus(d, c), minus(a, c)
    ee, gg, gr, er, eg = dot(e, e), dot(g, g), dot(g, r), dot(e, r), dot(e, g)
    across = ee * gg - eg * eg
    s = 0.0
    if across > PARALLEL * ee * gg:
        s = min(1.0, max(0.0, (eg * gr - er * gg) / across))
    t = (eg * s + gr) / gg
    if t < 0.0:
        t, s = 0.0, min(1.0, max(0.0, -er / ee))
    elif t > 1.0:
        t, s = 1.0, min(1.0, max(0.0, (eg - er) / ee))
    return s, t, 0.0 < s < 1.0 and 0.0 < t < 1.0


@inner
def closest_end(a, b, c, d):
    """Fractions on ab and cd of the closest two points of which one is an end."""
    s, t = 0.0, closest_on_segment(a, c, d)
    r = between(a, b, c, d, s, t)
    best = dot(r, r)
    for which in range(1, 4):
        if which == 1:
            si, ti = 1.0, closest_on_segment(b, c, d)
        elif which == 2:
            si, ti = closest_on_segment(c, a, b), 0.0
        else:
            si, ti = closest_on_segment(d, a, b), 1.0
        r = between(a, b, c, d, si, ti)
        square = dot(r, r)
        if square < best:
            best, s, t = square, si, ti
    return s, t, best


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

    p, q : parameters of the vector's end points: for a triangle, the weights of its second and
    third corner; for two edges, the fractions of their lengths.
    """
    if kind == VERTEX:
        return 1.0, p + q - 1.0, -p, -q
    return 1.0 - p, p, q - 1.0, -q


@inner_scalar
def weighted(x, nodes, weights):
    """Weighted sum of the rows of four nodes in x (n, 3)."""
    a, b, c, d = point(x, nodes[0]), point(x, nodes[1]), point(x, nodes[2]), point(x, nodes[3])
    e, f, g, h = weights
    return (
        e * a[0] + f * b[0] + g * c[0] + h * d[0],
        e * a[1] + f * b[1] + g * c[1] + h * d[1],
        e * a[2] + f * b[2] + g * c[2] + h * d[2],
    )


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
    """Closest points of a pair, as p, q of `weights_of`; whether they lie inside both edges."""
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
