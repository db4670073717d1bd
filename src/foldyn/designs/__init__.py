"""Inverse design: parameters of a case that optimize a measure under constraints."""

from __future__ import annotations

from foldyn.facade import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
