"""Signals: analysis of measured or computed records, given as arrays; independent of origami."""

from __future__ import annotations

from foldyn.facade import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
