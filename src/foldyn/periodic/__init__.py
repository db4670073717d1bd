"""Nonlinear vibration: periodic motions, their stability, and how they change."""

from foldyn.periodic.motion import periodic_motion
from foldyn.periodic.normal_modes import backbone
from foldyn.periodic.response import response_curve

__all__ = ["backbone", "periodic_motion", "response_curve"]
