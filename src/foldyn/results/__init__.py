"""Results: datasets that contain their own case, in memory and in files."""

from foldyn.facade import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
