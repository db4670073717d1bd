"""Patterns: the geometry of origami structures at rest, and generators of common ones."""

from __future__ import annotations

from collections.abc import Callable

from foldyn.patterns.eggbox import eggbox
from foldyn.patterns.kresling import kresling
from foldyn.patterns.miura import miura
from foldyn.patterns.pattern import Pattern
from foldyn.patterns.simple_fold import simple_fold

GENERATORS: dict[str, Callable[..., Pattern]] = {
    "simple_fold": simple_fold,
    "miura": miura,
    "eggbox": eggbox,
    "kresling": kresling,
}
"""Generators by the name that case files use (`[pattern] kind`)."""

__all__ = ["GENERATORS", "Pattern", "eggbox", "kresling", "miura", "simple_fold"]
