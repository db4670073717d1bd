"""Ogden law with exponents (5, 1), as in MERLIN2.

S / E_y = (lambda^3 - 1/lambda) / 4,  W / E_y = [(lambda^5 - 1)/5 - (lambda - 1)] / 4
(Liu and Paulino, Proc. R. Soc. A 473, 2017). The formulas are written in e = lambda - 1 so that
nothing cancels near e = 0; otherwise the energy of a nearly unstretched bar would lose five digits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from foldyn.jit.compiled import scalar
from foldyn.materials.formulas import BarFormulas
from foldyn.materials.law import BarLaw

CODE = 1


@scalar
def energy(e):
    """W / E_y."""
    return 0.25 * e * e * (2.0 + e * (2.0 + e * (1.0 + 0.2 * e)))


@scalar
def stress(e):
    """S / E_y."""
    return 0.25 * e * (4.0 + e * (6.0 + e * (4.0 + e))) / (1.0 + e)


@scalar
def stress_of_excess(x):
    """S / E_y for x = lambda^2 - 1, for kernels: one root and one division."""
    return 0.25 * x * (2.0 + x) / math.sqrt(1.0 + x)


@scalar
def slope(e):
    """(dS/dE) / E_y = (3 lambda + lambda^-3) / 4."""
    stretch = 1.0 + e
    return 0.25 * (3.0 * stretch + 1.0 / (stretch * stretch * stretch))


@dataclass(frozen=True)
class Ogden(BarLaw):
    """Hyperelastic bar law that stiffens in tension and softens in compression (MERLIN2)."""

    formulas = (BarFormulas(CODE, energy, stress, slope),)
    name: str = "ogden"
