"""Nonlinear vibration: periodic motions, their stability, and how they change."""

from foldyn.periodic.motion import periodic_motion
from foldyn.periodic.response import response_curve

__all__ = ["periodic_motion", "response_curve"]
