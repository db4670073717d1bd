"""Dynamics: integrators, critical step, energy audit, initial states."""

from foldyn.dynamics.checkpoint import SECONDS, Keeping
from foldyn.dynamics.driver import prepare, simulate
from foldyn.dynamics.ensemble import simulate_many
from foldyn.dynamics.initial import initial_state
from foldyn.dynamics.methods import METHODS, compiled, critical_step
from foldyn.dynamics.motion import Motion
from foldyn.dynamics.progress import Progress
from foldyn.dynamics.stability import largest_frequency

__all__ = [
    "METHODS",
    "SECONDS",
    "Keeping",
    "Motion",
    "Progress",
    "compiled",
    "critical_step",
    "initial_state",
    "largest_frequency",
    "prepare",
    "simulate",
    "simulate_many",
]
