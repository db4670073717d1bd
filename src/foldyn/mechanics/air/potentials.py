"""Integrals of 1/|x - y| over pairs of triangles, for vortex sheets of constant strength.

The integral over one triangle has a closed form at any point (Wilton, Rao, Glisson, Schaubert,
Al-Bundak and Butler 1984, IEEE Trans. Antennas Propag. 32, 276-281). Over the other triangle it is
integrated numerically, with 28 points for pairs that touch or are close. Distant pairs use three
points on each. The integral of a triangle over itself also has a closed form (Eibert and Hansen
1995, IEEE Trans. Antennas Propag. 43, 1499-1502).
"""

from __future__ import annotations

import math

import numpy as np

from foldyn.jit.compiled import inner, shared
from foldyn.mechanics.contact.distances import cross, dot, minus

# pairs use the closed form if the distance of their centers, divided by the sum of both radii, is
# less than this; neighbors in grids have a ratio of 2
NEAR = 2.0 + 1e-9
A1, B1, W1 = 0.797426985353087, 0.101286507323456, 0.125939180544827
A2, B2, W2 = 0.059715871789770, 0.470142064105115, 0.132394152788506
SEVEN = np.array([
    [1 / 3, 1 / 3, 1 / 3, 0.225],
    [A1, B1, B1, W1], [B1, A1, B1, W1], [B1, B1, A1, W1],
    [A2, B2, B2, W2], [B2, A2, B2, W2], [B2, B2, A2, W2],
])  # fmt: skip
"""Corner weights and shares of the area of a rule of degree 5 (Radon 1948)."""


def _finer(rule):
    """Apply the rule on the four subtriangles between corners and side midpoints."""
    corners = np.eye(3)
    middles = 0.5 * (corners + np.roll(corners, -1, axis=0))  # of the sides 01, 12, 20
    parts = [
        [corners[0], middles[0], middles[2]], [middles[0], corners[1], middles[1]],
        [middles[2], middles[1], corners[2]], [middles[1], middles[2], middles[0]],
    ]  # fmt: skip
    rows = [np.column_stack([rule[:, :3] @ np.array(p), 0.25 * rule[:, 3]]) for p in parts]
    return np.concatenate(rows)


CLOSE = _finer(SEVEN)


@inner
def potential(p, a, b, c, normal):
    """Integral of 1/|p - y| over the triangle a, b, c with unit normal, m."""
    height = dot(minus(p, a), normal)
    above = abs(height)
    total = 0.0
    for side in range(3):
        one, other = a, b
        if side == 1:
            one, other = b, c
        elif side == 2:
            one, other = c, a
        along = minus(other, one)
        length = math.sqrt(dot(along, along))
        along = along[0] / length, along[1] / length, along[2] / length
        outward = cross(along, normal)
        first, second = minus(one, p), minus(other, p)
        inside = dot(first, outward)  # distance of the side from the projection of p, in the plane
        begin, end = dot(first, along), dot(second, along)
        r1, r2 = math.sqrt(dot(first, first)), math.sqrt(dot(second, second))
        square = inside * inside + height * height
        if square <= 1e-24 * length * length:
            continue  # p lies on the line of the side
        if begin + end > 0.0:
            log = math.log((r2 + end) / (r1 + begin))
        else:
            log = math.log((r1 - begin) / (r2 - end))
        total += inside * log
        if above > 0.0:
            turn = math.atan(inside * end / (square + above * r2))
            turn -= math.atan(inside * begin / (square + above * r1))
            total -= above * turn
    return total


@inner
def itself(a, b, c, area):
    """Integral of 1/|x - y| with both points in one triangle, m3."""
    ab, bc, ca = minus(b, a), minus(c, b), minus(a, c)
    one, two, three = math.sqrt(dot(ab, ab)), math.sqrt(dot(bc, bc)), math.sqrt(dot(ca, ca))
    half = 0.5 * (one + two + three)
    total = math.log(1.0 - one / half) / one + math.log(1.0 - two / half) / two
    total += math.log(1.0 - three / half) / three
    return -4.0 / 3.0 * area * area * total


@inner
def _corner(corners, t, k):
    return corners[t, k, 0], corners[t, k, 1], corners[t, k, 2]


@inner
def _between(rule, row, a, b, c):
    x, y, z = rule[row, 0], rule[row, 1], rule[row, 2]
    return (
        x * a[0] + y * b[0] + z * c[0],
        x * a[1] + y * b[1] + z * c[1],
        x * a[2] + y * b[2] + z * c[2],
    )


@inner
def _over(corners, normals, areas, rule, one, other):
    """Integral (m3) of the potential of one triangle over another, by a quadrature rule."""
    a, b, c = _corner(corners, one, 0), _corner(corners, one, 1), _corner(corners, one, 2)
    d, e, f = _corner(corners, other, 0), _corner(corners, other, 1), _corner(corners, other, 2)
    normal = normals[one, 0], normals[one, 1], normals[one, 2]
    total = 0.0
    for row in range(rule.shape[0]):
        total += rule[row, 3] * potential(_between(rule, row, d, e, f), a, b, c, normal)
    return total * areas[other]


@shared
def inverse_distances(corners, normals, areas, centers, radii, points, rule, begin, out):
    """Rows of integrals of 1/|x - y| over pairs of triangles, m3, each pair once.

    Parameters
    ----------
    corners : (t, 3, 3)
    normals, areas, centers, radii : (t, 3), (t,), (t, 3), (t,)
        Radii of circles about the centers that contain the corners.
    points : (t, 3, 3)
        Three points per triangle with equal weights, exact for quadratic functions.
    rule : (k, 4)
        For close pairs: corner weights of the quadrature points, and their shares of the area.
    begin : int
        Triangle index of the first row.
    out : (rows, t)
        Integrals right of the diagonal, half the integrals on the diagonal, zeros left of it.
    """
    for row in range(out.shape[0]):
        a = begin + row
        out[row, :a] = 0.0
        one, two, three = _corner(corners, a, 0), _corner(corners, a, 1), _corner(corners, a, 2)
        out[row, a] = 0.5 * itself(one, two, three, areas[a])
        for b in range(a + 1, corners.shape[0]):
            x = centers[a, 0] - centers[b, 0]
            y = centers[a, 1] - centers[b, 1]
            z = centers[a, 2] - centers[b, 2]
            reach = NEAR * (radii[a] + radii[b])
            if x * x + y * y + z * z < reach * reach:
                total = _over(corners, normals, areas, rule, a, b)
                out[row, b] = 0.5 * (total + _over(corners, normals, areas, rule, b, a))
                continue
            total = 0.0
            for i in range(3):
                for j in range(3):
                    x = points[a, i, 0] - points[b, j, 0]
                    y = points[a, i, 1] - points[b, j, 1]
                    z = points[a, i, 2] - points[b, j, 2]
                    total += 1.0 / math.sqrt(x * x + y * y + z * z)
            out[row, b] = total / 9.0 * areas[a] * areas[b]
