"""Superlinear moment law of MERLIN2's bends: M = k sgn(d) |d|^(4/3), d = theta - theta0.

The slope is zero at rest, so the tangent stiffness of a flat panel is singular there.
Source: Filipov et al., Int. J. Solids Struct. 124, 2017; Liu and Paulino (MERLIN2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import scalar
from foldyn.jit.eights import choose, per_cube_root
from foldyn.materials.formulas import HingeFormulas
from foldyn.materials.law import HingeLaw

CODE = 1


@scalar
def energy(turn):
    """Energy / k = 3/7 |d|^(7/3)."""
    d = abs(turn)
    return 3.0 / 7.0 * d * d * np.cbrt(d)


@scalar
def moment(turn):
    """Moment / k.

    Loops over it vectorize, as it has no branches: (d y)(|d| y) with y = |d|^(-1/3), from a guess
    (3 % off) and two steps of order 4; exact to 3 ulp.
    """
    # for smaller turns y^3 would overflow; the moment is zero
    a = choose(abs(turn) > 1e-200, abs(turn), 1e-200)
    y = per_cube_root(a)
    r = 1.0 - a * y * y * y
    y = y + y * r * (1.0 / 3.0 + r * (2.0 / 9.0 + r * (14.0 / 81.0)))
    r = 1.0 - a * y * y * y
    y = y + y * r * (1.0 / 3.0 + r * (2.0 / 9.0 + r * (14.0 / 81.0)))
    return (turn * y) * (abs(turn) * y)


@scalar
def slope(turn):
    """Slope / k = 4/3 |d|^(1/3)."""
    return 4.0 / 3.0 * np.cbrt(abs(turn))


@dataclass(frozen=True)
class Superlinear(HingeLaw):
    """Bend law with exponent 4/3: no stiffness at rest, and stiffer as the panel bends."""

    formulas = (HingeFormulas(CODE, energy, moment, slope),)
    name: str = "superlinear"

    def reach(self, theta: NDArray, rest: NDArray, parameters: NDArray) -> NDArray:
        """Distance from the rest angle; see `HingeLaw`."""
        return np.abs(theta - rest)
