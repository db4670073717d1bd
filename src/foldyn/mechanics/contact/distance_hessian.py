"""Second derivative of a potential of a distance that is minimal over some weights.

With r = sum w_i x_i, minimized over the free parameters a of the weights, the distance d = |r|
obeys, by the implicit function theorem,

    Hess(d^2 / 2) = w_i w_j I - h_i' (J J')^-1 h_j,    h_i = w_i J + dw_i/da r',    J = dr/da,

which is exact if the closest point remains on the same feature.
"""

from __future__ import annotations

import math

import numpy as np

from foldyn.jit.compiled import inner
from foldyn.mechanics.contact.potential import barrier


@inner
def apart_of(corners, weights, r):
    """Set r (3,) to the sum of w_i x_i over corners (4, 3), weights (4,); return its square."""
    for c in range(3):
        r[c] = 0.0
        for i in range(4):
            r[c] += weights[i] * corners[i, c]
    return r[0] ** 2 + r[1] ** 2 + r[2] ** 2


@inner
def half_square(corners, weights, moves, free, r, slope, second):
    """Set slope (12,) and second (12, 12) to the derivatives of d^2 / 2.

    corners : (4, 3) positions; weights : (4,) of r (3,); moves : (2, 4) derivatives of the weights
    by the `free` parameters over which the distance is minimal.
    """
    jacobian, inverse, h = np.zeros((2, 3)), np.zeros((2, 2)), np.zeros((2, 12))
    for p in range(free):
        for i in range(4):
            for c in range(3):
                jacobian[p, c] += moves[p, i] * corners[i, c]
    if free == 1:
        inverse[0, 0] = 1.0 / (jacobian[0] * jacobian[0]).sum()
    elif free == 2:
        aa, bb = (jacobian[0] * jacobian[0]).sum(), (jacobian[1] * jacobian[1]).sum()
        ab = (jacobian[0] * jacobian[1]).sum()
        area = aa * bb - ab * ab
        inverse[0, 0], inverse[1, 1] = bb / area, aa / area
        inverse[0, 1] = inverse[1, 0] = -ab / area
    for p in range(free):
        for i in range(12):
            h[p, i] = weights[i // 3] * jacobian[p, i % 3] + moves[p, i // 3] * r[i % 3]
    for i in range(12):
        slope[i] = weights[i // 3] * r[i % 3]
        for j in range(12):
            value = weights[i // 3] * weights[j // 3] if i % 3 == j % 3 else 0.0
            for p in range(free):
                for q in range(free):
                    value -= h[p, i] * inverse[p, q] * h[q, j]
            second[i, j] = value


@inner
def add_second(corners, weights, moves, free, d0, k, out, slope):
    """Add the derivatives of k d0^2 f(d/d0): the second to out (12, 12), the first to slope (12,).

    Other arguments: see `half_square`. Returns the energy (J).
    """
    r = np.empty(3)
    d = math.sqrt(apart_of(corners, weights, r))
    if d >= d0 or k == 0.0:
        return 0.0
    along, curved = np.empty(12), np.empty((12, 12))
    half_square(corners, weights, moves, free, r, along, curved)
    f, f1, f2 = barrier(d / d0)
    first = k * d0 * f1 / d
    second = (k * f2 - first) / (d * d)
    for i in range(12):
        slope[i] += first * along[i]
        for j in range(12):
            out[i, j] += first * curved[i, j] + second * along[i] * along[j]
    return k * d0 * d0 * f
