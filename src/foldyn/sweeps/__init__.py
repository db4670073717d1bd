"""Sweeps: a case file computed for many values of its keys; pools and stored evaluations."""

from __future__ import annotations

from foldyn.facade import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
