"""Statics: equilibrium paths, their stability and branches, and energy landscapes."""

from foldyn.facade import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
