"""The potential of contact: k d0^2 f(d/d0) below the distance d0, f(x) = (1 - x)^3 / x^4.

f is twice continuously differentiable at x = 1, where it ends, and diverges as surfaces meet.
Potentials of this kind: Li et al., Incremental Potential Contact, ACM Trans. Graph. 39, 2020, there
-(x - 1)^2 ln x. The logarithm stores no more than some k d0^2 at any distance that floats
distinguish from 0; the power x^-4 absorbs the energy of a snap with a tenth of d0 left.

Between x0 and x1, with y = 1 - x and z = 1/x, f = y^3 z^4 has the difference quotient

    f[x0, x1] = y^3[x0, x1] z1^4 + y0^3 z^4[x0, x1],    y^3[x0, x1] = -(y0^2 + y0 y1 + y1^2),
    z^4[x0, x1] = -z0 z1 (z0^3 + z0^2 z1 + z0 z1^2 + z1^3),

sums of terms of equal sign: no digits are lost, however close x0 and x1 are.
"""

from __future__ import annotations

import math

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
