"""Scalar laws: stress of a bar, moment of a hinge, their slopes and energies."""

import foldyn.jit  # noqa: F401 - starts Numba, before anything is imported from it
from foldyn.materials.custom import CustomBarLaw, CustomHingeLaw
from foldyn.materials.enhanced_linear import EnhancedLinear
from foldyn.materials.law import BarLaw, HingeLaw
from foldyn.materials.linear import LinearBar, LinearHinge
from foldyn.materials.ogden import Ogden
from foldyn.materials.registry import BAR_LAWS, HINGE_LAWS, bar_law, hinge_law
from foldyn.materials.superlinear import Superlinear

__all__ = [
    "BAR_LAWS",
    "HINGE_LAWS",
    "BarLaw",
    "CustomBarLaw",
    "CustomHingeLaw",
    "EnhancedLinear",
    "HingeLaw",
    "LinearBar",
    "LinearHinge",
    "Ogden",
    "Superlinear",
    "bar_law",
    "hinge_law",
]
