"""A vertex against a triangle: energy, force and tangent of the potential of their distance.

If the closest point lies on a shared side or corner, each triangle would count it. So shared parts
are subtracted:

    V = b(d_T) - 1/2 sum b(d_E) + sum b(d_V) / n

summed over sides E of two triangles and corners V enclosed by n triangles. Over a flat sheet, the
sum over all triangles is b(d), also above inner sides and corners.
"""

from __future__ import annotations

import math

import numpy as np

from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.mechanics.contact.distance_hessian import add_second
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

PARTS = 7  # parts of a triangle: itself, its sides, its corners


@inner_scalar
def _push(force, i, by, r):
    force[i, 0] += by * r[0]
    force[i, 1] += by * r[1]
    force[i, 2] += by * r[2]


@inner_scalar
def _one(i, j):
    return 1.0 if i == j else 0.0


@inner
def _part(x, force, nodes, wa, wb, wc, d0, k):
    """Energy of k d0^2 f(d/d0) for the closest point's weights, and its force along d.

    Adds its gradient, unless force is None.
    """
    v, a, b, c = nodes
    r = apart(point(x, v), point(x, a), point(x, b), point(x, c), wa, wb, wc)
    d = math.sqrt(dot(r, r))
    if d >= d0:
        return 0.0, 0.0
    f, f1, _ = barrier(d / d0)
    if force is not None:
        by = k * d0 * f1 / d
        _push(force, v, by, r)
        _push(force, a, -wa * by, r)
        _push(force, b, -wb * by, r)
        _push(force, c, -wc * by, r)
    return k * d0 * d0 * f, -k * d0 * f1


@kernel
def vertex_triangle(tables, x, force, v, t, d0):
    """Energy (J) of vertex v against triangle t at positions x (n, 3), and their normal force (N).

    Adds the gradient to force (n, 3), unless that is None. Also returns the weights of the second
    and third corner at the closest point. Normal forces of a triangle's parts are summed like their
    energies: over a flat sheet this equals the force everywhere.
    """
    a, b, c = tables.triangles[t, 0], tables.triangles[t, 1], tables.triangles[t, 2]
    nodes, k = (v, a, b, c), tables.stiffness
    p, pa, pb, pc = point(x, v), point(x, a), point(x, b), point(x, c)
    wa, wb, wc, _ = closest_on_triangle(p, pa, pb, pc)
    r = apart(p, pa, pb, pc, wa, wb, wc)
    second, third = wb, wc
    if dot(r, r) >= d0 * d0:
        return 0.0, 0.0, second, third
    energy, pressed = _part(x, force, nodes, wa, wb, wc, d0, k)
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
            more, push = _part(x, force, nodes, wa, wb, wc, d0, -k * share)
            energy, pressed = energy + more, pressed + push
        share = tables.shared_corner[tables.triangles[t, side]]
        if share > 0.0:
            wa, wb, wc = _one(side, 0), _one(side, 1), _one(side, 2)
            more, push = _part(x, force, nodes, wa, wb, wc, d0, k * share)
            energy, pressed = energy + more, pressed + push
    return energy, pressed, second, third


@inner_scalar
def _on_side(s, side, first, second):
    """Region of the point at fraction s of a side between two corners."""
    return first if s <= 0.0 else (second if s >= 1.0 else side)


@inner
def weigh_triangle(corners, which, weights, moves):
    """Set weights (4,) and moves (2, 4) for the distance of a vertex from a part of a triangle.

    corners : (4, 3) of the vertex and the triangle.
    which : 0 for the triangle, 1 to 3 for its sides, 4 to 6 for its corners.

    Returns the number of parameters over which the distance is minimal; see `distance_hessian`.
    """
    p, a, b, c = point(corners, 0), point(corners, 1), point(corners, 2), point(corners, 3)
    if which == 0:
        wa, wb, wc, region = closest_on_triangle(p, a, b, c)
    elif which == 1:
        s = closest_on_segment(p, a, b)
        wa, wb, wc, region = 1.0 - s, s, 0.0, _on_side(s, SIDE_AB, CORNER_A, CORNER_B)
    elif which == 2:
        s = closest_on_segment(p, b, c)
        wa, wb, wc, region = 0.0, 1.0 - s, s, _on_side(s, SIDE_BC, CORNER_B, CORNER_C)
    elif which == 3:
        s = closest_on_segment(p, c, a)
        wa, wb, wc, region = s, 0.0, 1.0 - s, _on_side(s, SIDE_CA, CORNER_C, CORNER_A)
    else:
        wa, wb, wc, region = _one(which, 4), _one(which, 5), _one(which, 6), CORNER_A
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
    for axis in range(3):
        corners[0, axis] = x[v, axis]
        for i in range(3):
            corners[1 + i, axis] = x[tables.triangles[t, i], axis]
    for which in range(PARTS):
        k = tables.stiffness * share_of(tables, t, which)
        free = weigh_triangle(corners, which, weights, moves)
        energy += add_second(corners, weights, moves, free, d0, k, out, slope)
        if which == 0 and energy == 0.0:
            return 0.0
    return energy
