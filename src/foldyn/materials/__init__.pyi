# Public names and where they live; loaded when they are first used (facade.py)

from foldyn.materials.custom import CustomBarLaw as CustomBarLaw, CustomHingeLaw as CustomHingeLaw
from foldyn.materials.enhanced_linear import EnhancedLinear as EnhancedLinear
from foldyn.materials.eyring import Eyring as Eyring
from foldyn.materials.inelastic_law import MemoryLaw as MemoryLaw
from foldyn.materials.law import BarLaw as BarLaw, HingeLaw as HingeLaw
from foldyn.materials.linear import LinearBar as LinearBar, LinearHinge as LinearHinge
from foldyn.materials.ogden import Ogden as Ogden
from foldyn.materials.plastic import Plastic as Plastic
from foldyn.materials.plate_superlinear import PlateSuperlinear as PlateSuperlinear
from foldyn.materials.prony import Prony as Prony
from foldyn.materials.superlinear import Superlinear as Superlinear
from foldyn.materials.registry import (
    BAR_LAWS as BAR_LAWS,
    HINGE_LAWS as HINGE_LAWS,
    bar_law as bar_law,
    hinge_law as hinge_law,
)
