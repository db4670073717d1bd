"""Structures: a pattern as bars and hinges with stiffness and mass."""

from foldyn.structures.discretize import discretize
from foldyn.structures.mass import MASS_RULES
from foldyn.structures.mesh import hinge_angles
from foldyn.structures.ply import Ply
from foldyn.structures.presets import PRESETS
from foldyn.structures.sheet import Laminate, PanelSheet, Sheet
from foldyn.structures.strip import Strip
from foldyn.structures.structure import ModelOptions, Structure

__all__ = [
    "MASS_RULES",
    "PRESETS",
    "Laminate",
    "ModelOptions",
    "PanelSheet",
    "Ply",
    "Sheet",
    "Strip",
    "Structure",
    "discretize",
    "hinge_angles",
]
