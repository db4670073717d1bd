"""Small vibrations about an equilibrium: modes and frequency response."""

from foldyn.facade import eager

__dir__, __all__ = eager(__name__, __file__)
