"""Folding: from a flat or partly folded pattern to a folded one, free of stress."""

from foldyn.statics.folding.folding import Folding, fold

__all__ = ["Folding", "fold"]
