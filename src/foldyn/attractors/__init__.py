"""Where long motions end: sweeps, jumps, Poincare sections, exponents, basins of attraction."""

from foldyn.facade import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
