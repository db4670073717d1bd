"""Superlinear moment law of MERLIN2's bends: M = k sgn(d) |d|^(4/3), d = theta - theta0.

Its slope is zero at rest: the tangent stiffness of a flat panel is singular there.
Source: Filipov et al., Int. J. Solids Struct. 124, 2017; Liu and Paulino (MERLIN2).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from foldyn.materials.compiled import scalar
from foldyn.materials.law import HingeLaw


@scalar
def energy(theta, rest):
    """Energy / k = 3/7 |d|^(7/3)."""
    d = abs(theta - rest)
    return 3.0 / 7.0 * d * d * np.cbrt(d)


@scalar
def moment(theta, rest):
    """Moment / k."""
    d = theta - rest
    return abs(d) * np.cbrt(d)


@scalar
def slope(theta, rest):
    """Slope / k = 4/3 |d|^(1/3)."""
    return 4.0 / 3.0 * np.cbrt(abs(theta - rest))


@dataclass(frozen=True)
class Superlinear(HingeLaw):
    """Bend law with exponent 4/3: no stiffness at rest, stiffer as the panel bends."""

    code: ClassVar[int] = 1
    name: str = "superlinear"
