"""Dynamics: integrators, critical step, energy audit, initial states."""

from foldyn.dynamics.critical_step import critical_step, largest_frequency
from foldyn.dynamics.driver import prepare, simulate
from foldyn.dynamics.initial import initial_state
from foldyn.dynamics.methods import METHODS, compiled
from foldyn.dynamics.motion import Motion
from foldyn.dynamics.progress import Progress

__all__ = [
    "METHODS",
    "Motion",
    "Progress",
    "compiled",
    "critical_step",
    "initial_state",
    "largest_frequency",
    "prepare",
    "simulate",
]
