"""Many analyses: a case file at many values of its keys, with the shared pool and evaluations."""

from __future__ import annotations

from foldyn.facade import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
