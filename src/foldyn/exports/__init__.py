"""Results in formats of other programs: one module for each format, chosen from a registry."""

from foldyn.exports.registry import EXPORTS, Export, export

__all__ = ["EXPORTS", "Export", "export"]
