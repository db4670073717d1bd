# Public names and where they live; loaded when they are first used (facade.py)

from foldyn.dynamics.checkpoint import SECONDS as SECONDS, Keeping as Keeping
from foldyn.dynamics.driver import prepare as prepare, simulate as simulate
from foldyn.dynamics.ensemble import simulate_many as simulate_many
from foldyn.dynamics.initial import initial_state as initial_state
from foldyn.dynamics.methods import (
    METHODS as METHODS,
    compiled as compiled,
    critical_step as critical_step,
)
from foldyn.dynamics.motion import Motion as Motion
from foldyn.dynamics.progress import Progress as Progress
from foldyn.dynamics.stability import largest_frequency as largest_frequency
