"""Cases: supports, links, loads, histories, damping, states."""

from foldyn.facade import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
