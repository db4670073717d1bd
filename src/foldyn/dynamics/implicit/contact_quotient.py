"""The potential of contact between two distances: the quotient of the differences.

Between x0 and x1, with y = 1 - x and z = 1/x, f = y^3 z^4 has

    f[x0, x1] = y^3[x0, x1] z1^4 + y0^3 z^4[x0, x1],    y^3[x0, x1] = -(y0^2 + y0 y1 + y1^2),
    z^4[x0, x1] = -z0 z1 (z0^3 + z0^2 z1 + z0 z1^2 + z1^3),

sums of terms of one sign: no digits are lost, however near x0 and x1 are.
"""

from __future__ import annotations

from foldyn.jit.compiled import inner
from foldyn.mechanics.contact.potential import barrier


@inner
def quotient(x0, x1):
    """The quotient (f(x1) - f(x0)) / (x1 - x0), and its derivative with respect to x1.

    f is zero above 1, see `mechanics.contact.potential`; not finite where x0 or x1 is not positive.
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
