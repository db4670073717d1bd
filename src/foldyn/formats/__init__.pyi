# Public names and where they live; loaded when they are first used (facade.py)

from foldyn.formats.building import Built as Built
from foldyn.formats.diagnosis import Diagnosis as Diagnosis
from foldyn.formats.drawing import Drawing as Drawing
from foldyn.formats.files import (
    FORMATS as FORMATS,
    Format as Format,
    diagnose as diagnose,
    read_pattern as read_pattern,
    write_pattern as write_pattern,
)
from foldyn.patterns.frames import Frame as Frame
