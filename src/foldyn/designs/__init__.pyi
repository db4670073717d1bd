# Public names and where they live; loaded when they are first used (facade.py)

from foldyn.designs.methods import METHODS as METHODS
from foldyn.designs.result import Design as Design, End as End
from foldyn.designs.run_design import Course as Course, design as design
