"""Patterns: the geometry of origami structures at rest, and generators of common patterns."""

from __future__ import annotations

from foldyn.facade import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
