"""Nonlinear vibration: periodic motions, their stability, and how they change."""

from foldyn.periodic.attraction import basins
from foldyn.periodic.chaos import lyapunov_exponent
from foldyn.periodic.motion import periodic_motion
from foldyn.periodic.normal_modes import backbone
from foldyn.periodic.response import response_curve
from foldyn.periodic.sections import poincare_section, stepped_sine

__all__ = [
    "backbone",
    "basins",
    "lyapunov_exponent",
    "periodic_motion",
    "poincare_section",
    "response_curve",
    "stepped_sine",
]
