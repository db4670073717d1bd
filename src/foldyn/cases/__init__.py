"""Cases: supports, links, loads, histories, damping, states."""

from foldyn.cases import waveforms
from foldyn.cases.history import Formula
from foldyn.facade import lazy

Formula.table = waveforms.table

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
