"""Scalar laws: the stress of a bar, the moment of a hinge, and their slopes and energies."""

import foldyn.jit  # noqa: F401 - asks for what Numba needs before anything imports Numba
from foldyn.facade import lazy
from foldyn.materials import registry  # noqa: F401 - joins laws with their compiled formulas

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
