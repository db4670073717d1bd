"""Structures: a pattern as bars and hinges with stiffness and mass."""

from foldyn.facade import eager

__dir__, __all__ = eager(__name__, __file__)
