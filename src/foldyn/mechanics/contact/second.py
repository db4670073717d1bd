"""The second derivative of a potential of a distance that is minimal over some weights.

With r = sum w_i x_i, minimized over the free parameters a of the weights, the distance d = |r|
obeys, by the implicit function theorem,

    Hess(d^2 / 2) = w_i w_j I - h_i' (J J')^-1 h_j,    h_i = w_i J + dw_i/da r',    J = dr/da,

which is exact where the closest point stays on the same part.
"""

from __future__ import annotations

import math

import numpy as np

from foldyn.jit.compiled import kernel
from foldyn.mechanics.contact.potential import barrier


@kernel
def add_second(corners, weights, moves, free, d0, k, out, slope):
    """Add the derivatives of k d0^2 f(d/d0): the second to out (12, 12), the first to slope (12,).

    corners : (4, 3) positions; weights : (4,) of r; moves : (2, 4) derivatives of the weights by
    the `free` parameters over which the distance is minimal. Returns the energy (J).
    """
    r = np.zeros(3)
    for i in range(4):
        for c in range(3):
            r[c] += weights[i] * corners[i, c]
    d = math.sqrt(r[0] ** 2 + r[1] ** 2 + r[2] ** 2)
    if d >= d0 or k == 0.0:
        return 0.0
    f, f1, f2 = barrier(d / d0)
    first = k * d0 * f1 / d
    second = (k * f2 - first) / (d * d)
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
        along = weights[i // 3] * r[i % 3]
        slope[i] += first * along
        for j in range(12):
            value = second * along * weights[j // 3] * r[j % 3]
            if i % 3 == j % 3:
                value += first * weights[i // 3] * weights[j // 3]
            for p in range(free):
                for q in range(free):
                    value -= first * h[p, i] * inverse[p, q] * h[q, j]
            out[i, j] += value
    return k * d0 * d0 * f
