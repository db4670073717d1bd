"""Pattern files: one module per format, selected from a registry by extension."""

from __future__ import annotations

from foldyn.facade import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
