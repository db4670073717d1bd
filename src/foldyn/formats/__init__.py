"""Pattern files: one module a format, found by extension through a registry."""

from __future__ import annotations

from foldyn.formats.files import FORMATS, Format, read_pattern, write_pattern

__all__ = ["FORMATS", "Format", "read_pattern", "write_pattern"]
