"""Compiled mechanics of bars and hinges: energy, internal force, tangent."""

from foldyn.facade import eager

__dir__, __all__ = eager(__name__, __file__)
