# Public names and where they live; loaded with the package (facade.py)

from foldyn.structures.discretize import discretize as discretize
from foldyn.structures.mass import MASS_RULES as MASS_RULES
from foldyn.structures.mesh import hinge_angles as hinge_angles
from foldyn.structures.ply import Ply as Ply
from foldyn.structures.presets import PRESETS as PRESETS
from foldyn.structures.sheet import Laminate as Laminate, PanelSheet as PanelSheet, Sheet as Sheet
from foldyn.structures.strip import Strip as Strip
from foldyn.structures.structure import ModelOptions as ModelOptions, Structure as Structure
