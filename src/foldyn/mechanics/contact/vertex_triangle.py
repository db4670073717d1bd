"""A vertex against a triangle: energy, force and tangent of the potential of their distance.

Where the closest point lies on a side or corner that triangles share, each of them would count it.
So what is shared is taken out again:

    V = b(d_T) - 1/2 sum b(d_E) + sum b(d_V) / n

over the sides E that two triangles share and the corners V around which n triangles close. Over a
flat sheet the sum for all its triangles is b(d) once, also above its inner sides and corners.
"""

from __future__ import annotations

import math

import numpy as np

from foldyn.jit.compiled import kernel, scalar
from foldyn.mechanics.contact.distances import (
    CORNER_A,
    CORNER_B,
    CORNER_C,
    SIDE_AB,
    SIDE_BC,
    SIDE_CA,
    apart,
    closest_on_segment,
    closest_on_triangle,
    dot,
    point,
)
from foldyn.mechanics.contact.potential import barrier
from foldyn.mechanics.contact.second import add_second


@scalar
def _push(force, i, by, r):
    force[i, 0] += by * r[0]
    force[i, 1] += by * r[1]
    force[i, 2] += by * r[2]


@scalar
def _one(i, j):
    return 1.0 if i == j else 0.0


@kernel
def _part(x, force, nodes, wa, wb, wc, d0, k):
    """Energy of k d0^2 f(d/d0) for weights of the closest point; adds its gradient."""
    v, a, b, c = nodes
    r = apart(point(x, v), point(x, a), point(x, b), point(x, c), wa, wb, wc)
    d = math.sqrt(dot(r, r))
    if d >= d0:
        return 0.0
    f, f1, _ = barrier(d / d0)
    by = k * d0 * f1 / d
    _push(force, v, by, r)
    _push(force, a, -wa * by, r)
    _push(force, b, -wb * by, r)
    _push(force, c, -wc * by, r)
    return k * d0 * d0 * f


@kernel
def vertex_triangle(tables, x, force, v, t, d0):
    """Energy (J) of vertex v against triangle t at positions x (n, 3); adds the gradient."""
    a, b, c = tables.triangles[t, 0], tables.triangles[t, 1], tables.triangles[t, 2]
    nodes, k = (v, a, b, c), tables.stiffness
    p, pa, pb, pc = point(x, v), point(x, a), point(x, b), point(x, c)
    wa, wb, wc, _ = closest_on_triangle(p, pa, pb, pc)
    r = apart(p, pa, pb, pc, wa, wb, wc)
    if dot(r, r) >= d0 * d0:
        return 0.0
    energy = _part(x, force, nodes, wa, wb, wc, d0, k)
    for side in range(3):
        share = tables.shared_side[t, side]
        if share > 0.0:
            if side == 0:
                s = closest_on_segment(p, pa, pb)
                wa, wb, wc = 1.0 - s, s, 0.0
            elif side == 1:
                s = closest_on_segment(p, pb, pc)
                wa, wb, wc = 0.0, 1.0 - s, s
            else:
                s = closest_on_segment(p, pc, pa)
                wa, wb, wc = s, 0.0, 1.0 - s
            energy += _part(x, force, nodes, wa, wb, wc, d0, -k * share)
        share = tables.shared_corner[tables.triangles[t, side]]
        if share > 0.0:
            wa, wb, wc = _one(side, 0), _one(side, 1), _one(side, 2)
            energy += _part(x, force, nodes, wa, wb, wc, d0, k * share)
    return energy


@kernel
def _second_part(corners, w, region, d0, k, out, slope):
    """The second derivative of such a term, to out (12, 12); its gradient to slope (12,)."""
    weights, moves = np.zeros(4), np.zeros((2, 4))
    weights[0] = 1.0
    for i in range(3):
        weights[1 + i] = -w[i]
    free = 0
    if region < SIDE_AB:
        free = 2
        moves[0, 1], moves[0, 2] = 1.0, -1.0
        moves[1, 1], moves[1, 3] = 1.0, -1.0
    elif region <= SIDE_CA:
        free = 1
        first = region - SIDE_AB
        moves[0, 1 + first], moves[0, 1 + (first + 1) % 3] = 1.0, -1.0
    return add_second(corners, weights, moves, free, d0, k, out, slope)


@scalar
def _on_side(s, side, first, second):
    """Region of the point at the fraction s of a side between two corners."""
    return first if s <= 0.0 else (second if s >= 1.0 else side)


@kernel
def vertex_triangle_tangent(tables, x, v, t, d0, out):
    """Add the second derivative of the energy of `vertex_triangle` to out (12, 12); the energy.

    Rows and columns belong to the vertex and then the corners.
    """
    a, b, c = tables.triangles[t, 0], tables.triangles[t, 1], tables.triangles[t, 2]
    corners, k, slope = np.empty((4, 3)), tables.stiffness, np.zeros(12)
    for axis in range(3):
        corners[0, axis], corners[1, axis] = x[v, axis], x[a, axis]
        corners[2, axis], corners[3, axis] = x[b, axis], x[c, axis]
    p, pa, pb, pc = point(x, v), point(x, a), point(x, b), point(x, c)
    wa, wb, wc, region = closest_on_triangle(p, pa, pb, pc)
    energy = _second_part(corners, (wa, wb, wc), region, d0, k, out, slope)
    if energy == 0.0:
        return 0.0
    s = closest_on_segment(p, pa, pb)
    share = -k * tables.shared_side[t, 0]
    region = _on_side(s, SIDE_AB, CORNER_A, CORNER_B)
    energy += _second_part(corners, (1.0 - s, s, 0.0), region, d0, share, out, slope)
    s = closest_on_segment(p, pb, pc)
    share = -k * tables.shared_side[t, 1]
    region = _on_side(s, SIDE_BC, CORNER_B, CORNER_C)
    energy += _second_part(corners, (0.0, 1.0 - s, s), region, d0, share, out, slope)
    s = closest_on_segment(p, pc, pa)
    share = -k * tables.shared_side[t, 2]
    region = _on_side(s, SIDE_CA, CORNER_C, CORNER_A)
    energy += _second_part(corners, (s, 0.0, 1.0 - s), region, d0, share, out, slope)
    for i in range(3):
        share = k * tables.shared_corner[tables.triangles[t, i]]
        w = (_one(i, 0), _one(i, 1), _one(i, 2))
        energy += _second_part(corners, w, CORNER_A + i, d0, share, out, slope)
    return energy
