"""Patterns: the geometry of origami structures at rest, and generators of common ones."""

from __future__ import annotations

from collections.abc import Callable

from foldyn.patterns.boards import Boards
from foldyn.patterns.facets import welded
from foldyn.patterns.generators import eggbox, kresling, miura, simple_fold
from foldyn.patterns.pattern import Pattern
from foldyn.patterns.thick import thicken

GENERATORS: dict[str, Callable[..., Pattern]] = {
    generator.__name__: generator for generator in (simple_fold, miura, eggbox, kresling)
}
"""Generators by the name that case files use (`[pattern] kind`)."""

__all__ = [
    "GENERATORS",
    "Boards",
    "Pattern",
    "eggbox",
    "kresling",
    "miura",
    "simple_fold",
    "thicken",
    "welded",
]
