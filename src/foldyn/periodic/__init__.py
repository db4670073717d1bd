"""Nonlinear vibration: periodic motions, their stability, and how they change."""

from foldyn.facade import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
