"""Pattern files: one module for each format, chosen by extension from a registry."""

from __future__ import annotations

from foldyn.facade import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
