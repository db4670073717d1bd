"""Linear laws: for a bar linear in Green strain (St. Venant-Kirchhoff), for a hinge in angle."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner_scalar
from foldyn.materials.formulas import BarFormulas, HingeFormulas
from foldyn.materials.law import BarLaw, HingeLaw

CODE = 0


@inner_scalar
def bar_energy(e):
    """W / E_y = E^2 / 2 with E = e + e^2/2."""
    green = e + 0.5 * e * e
    return 0.5 * green * green


@inner_scalar
def bar_stress(e):
    """S / E_y = E."""
    return e + 0.5 * e * e


@inner_scalar
def bar_slope(e):
    """(dS/dE) / E_y."""
    return 1.0


@inner_scalar
def hinge_energy(turn):
    """Energy / k."""
    return 0.5 * turn**2


@inner_scalar
def hinge_moment(turn):
    """Moment / k."""
    return turn


@inner_scalar
def hinge_slope(turn):
    """Slope of the moment / k."""
    return 1.0


@dataclass(frozen=True)
class LinearBar(BarLaw):
    """Bar law with stress proportional to Green strain."""

    formulas = (BarFormulas(CODE, bar_energy, bar_stress, bar_slope),)
    name: str = "linear"


@dataclass(frozen=True)
class LinearHinge(HingeLaw):
    """Hinge law with moment proportional to the change of the dihedral."""

    formulas = (HingeFormulas(CODE, hinge_energy, hinge_moment, hinge_slope),)
    linear_between = (-math.inf, math.inf)
    name: str = "linear"

    def least_slope(self, rest: NDArray, stiffness: NDArray, length: NDArray) -> NDArray:
        """See `HingeLaw`."""
        return np.ones(len(rest))
