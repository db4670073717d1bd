"""Pattern files: one module for each format, chosen by extension from a registry."""

from __future__ import annotations

from foldyn.formats.building import Built
from foldyn.formats.diagnosis import Diagnosis
from foldyn.formats.drawing import Drawing
from foldyn.formats.files import FORMATS, Format, diagnose, read_pattern, write_pattern
from foldyn.formats.frames import Frame

__all__ = [
    "FORMATS",
    "Built",
    "Diagnosis",
    "Drawing",
    "Format",
    "Frame",
    "diagnose",
    "read_pattern",
    "write_pattern",
]
