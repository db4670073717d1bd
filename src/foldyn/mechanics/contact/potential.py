"""The potential of contact: k d0^2 f(d/d0) below the distance d0, f(x) = (1 - x)^3 / x^4.

f is twice continuously differentiable where it ends, x = 1, and grows without bound where surfaces
meet. Potentials of this kind: Li et al., Incremental Potential Contact, ACM Trans. Graph. 39,
2020, there -(x - 1)^2 ln x. That logarithm holds no more than some k d0^2 at any distance that
floats can tell from 0; the power x^-4 has taken up a snap's energy while a tenth of d0 is left.
"""

from __future__ import annotations

import math

from foldyn.jit.compiled import inner_scalar

STIFFNESS = 0.03
"""Of E t: the stiffness k (N/m) of contact, unless it is given."""


@inner_scalar
def barrier(x):
    """f and its first two derivatives at x < 1; infinite where surfaces have passed each other."""
    if x <= 0.0:
        return math.inf, -math.inf, math.inf
    y, i = 1.0 - x, 1.0 / x
    power = i * i * i * i
    return (
        y * y * y * power,
        -y * y * power * (3.0 + 4.0 * y * i),
        y * power * (6.0 + y * i * (24.0 + 20.0 * y * i)),
    )
