"""The potential of contact: k d0^2 f(d/d0) below the distance d0, f(x) = (1 - x)^3 / x^4.

f is twice continuously differentiable at x = 1, where it ends, and diverges as surfaces meet.
Potentials of this kind are from Li et al., Incremental Potential Contact, ACM Trans. Graph. 39,
2020, who use -(x - 1)^2 ln x. With this logarithm, the energy stays below 1000 k d0^2 at any
distance that floats can distinguish from 0; the power x^-4 absorbs the energy of a snap while a
tenth of d0 is left.

Between x0 and x1, with y = 1 - x and z = 1/x, f = y^3 z^4 has the difference quotient

    f[x0, x1] = y^3[x0, x1] z1^4 + y0^3 z^4[x0, x1],    y^3[x0, x1] = -(y0^2 + y0 y1 + y1^2),
    z^4[x0, x1] = -z0 z1 (z0^3 + z0^2 z1 + z0 z1^2 + z1^3).

These are sums of terms of equal sign, so no digits are lost, however close x0 and x1 are.

The second derivative needs the Hessian of the distance. With r = sum w_i x_i, minimized over the
free parameters a of the weights, the distance d = |r| obeys, by the implicit function theorem,

    Hess(d^2 / 2) = w_i w_j I - h_i' (J J')^-1 h_j,    h_i = w_i J + dw_i/da r',    J = dr/da,

which is exact if the closest point remains on the same feature.
"""

from __future__ import annotations

import math

import numpy as np

from foldyn.jit.compiled import inner, inner_scalar

STIFFNESS = 0.03
"""Of E t: the stiffness k (N/m) of contact, unless it is given."""


@inner_scalar
def barrier(x):
    """f and its first two derivatives at x < 1; infinite after surfaces have crossed."""
    if x <= 0.0:
        return math.inf, -math.inf, math.inf
    y, i = 1.0 - x, 1.0 / x
    power = i * i * i * i
    return (
        y * y * y * power,
        -y * y * power * (3.0 + 4.0 * y * i),
        y * power * (6.0 + y * i * (24.0 + 20.0 * y * i)),
    )


@inner
def difference_quotient(x0, x1):
    """The quotient (f(x1) - f(x0)) / (x1 - x0), and its derivative with respect to x1.

    f is zero above 1; the result is not finite unless x0 and x1 are positive.
    """
    if x0 >= 1.0 and x1 >= 1.0:
        return 0.0, 0.0
    apart = x1 - x0
    if x1 >= 1.0:
        f = barrier(x0)[0]
        return -f / apart, f / (apart * apart)
    if x0 >= 1.0:
        f, f1, _ = barrier(x1)
        value = f / apart
        return value, (f1 - value) / apart
    if x0 <= 0.0 or x1 <= 0.0:
        f = barrier(min(x0, x1))[0]
        return -f, f
    y0, y1, z0, z1 = 1.0 - x0, 1.0 - x1, 1.0 / x0, 1.0 / x1
    cubes, power, both = -(y0 * y0 + y0 * y1 + y1 * y1), z1 * z1 * z1 * z1, z0 * z1
    powers = -both * (z0 * z0 * z0 + z1 * (z0 * z0 + z1 * (z0 + z1)))
    slope = (y0 + 2.0 * y1) * power - 4.0 * power * z1 * cubes
    rest = z0 * z0 * z0 + z1 * (2.0 * z0 * z0 + z1 * (3.0 * z0 + 4.0 * z1))
    slope += y0 * y0 * y0 * both * z1 * rest
    return cubes * power + y0 * y0 * y0 * powers, slope


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
    with respect to the `free` parameters over which the distance is minimized.
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
