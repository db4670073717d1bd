"""Exact gradients of what Foldyn computes, with respect to a design's parameters."""

from __future__ import annotations

from foldyn.facade import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
