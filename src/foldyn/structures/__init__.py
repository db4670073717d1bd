"""Structures: a pattern as bars and hinges with stiffness and mass."""

from foldyn.structures.discretize import discretize
from foldyn.structures.laminate import Laminate
from foldyn.structures.mass import MASS_RULES
from foldyn.structures.sheet import Sheet
from foldyn.structures.structure import ModelOptions, Structure, hinge_angles

__all__ = [
    "MASS_RULES",
    "Laminate",
    "ModelOptions",
    "Sheet",
    "Structure",
    "discretize",
    "hinge_angles",
]
