"""Dynamics: integrators, critical step, energy audit, initial states."""

import foldyn.jit  # noqa: F401  # looks at the environment before Numba does
from foldyn.facade import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
