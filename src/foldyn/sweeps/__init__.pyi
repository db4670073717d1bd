# Public names and where they live; loaded when they are first used (facade.py)

from foldyn.sweeps.measure import Measure as Measure
from foldyn.sweeps.measures import MEASURES as MEASURES
from foldyn.sweeps.run_sweep import Course as Course, sweep as sweep
