"""Pattern files: one module for each format, chosen by extension from a registry."""

from __future__ import annotations

from foldyn.formats.files import FORMATS, Format, read_pattern, write_pattern

__all__ = ["FORMATS", "Format", "read_pattern", "write_pattern"]
