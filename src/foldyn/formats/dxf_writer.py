"""DXF crease patterns as they are written: lines on layers by assignment, in millimeters."""

from __future__ import annotations

import io
from typing import Any

from foldyn.errors import optional
from foldyn.formats.svg_writer import NAMES, PER_METER
from foldyn.formats.writers import flat_points, letters, warn_of_angles
from foldyn.patterns import Pattern

COLORS = {"B": 7, "M": 1, "V": 5, "F": 2, "U": 6, "C": 3}
"""Color index of AutoCAD of each layer: black or white, red, blue, yellow, magenta, green."""

MILLIMETERS = 4
"""Number of the unit in $INSUNITS."""


def write(pattern: Pattern) -> str:
    """Text of a DXF file (R2010): a layer for each kind of line, "MOUNTAIN" and so on.

    Parameters
    ----------
    pattern : Pattern
        A flat one.

    Returns
    -------
    str

    Raises
    ------
    InputError
        The pattern is folded, or ezdxf is not installed.
    """
    warn_of_angles(pattern, "DXF")
    points = (PER_METER * flat_points(pattern, "DXF")).tolist()
    library = ezdxf()
    document = library.new("R2010", units=MILLIMETERS)
    space = document.modelspace()
    edges = letters(pattern)
    for letter in COLORS:
        if any(edge[1] == letter for edge in edges):
            document.layers.add(NAMES[letter].upper(), color=COLORS[letter])
    for (a, b), letter, _ in edges:
        space.add_line(points[a], points[b], dxfattribs={"layer": NAMES[letter].upper()})
    text = io.StringIO()
    document.write(text)
    return text.getvalue()


def ezdxf() -> Any:
    """Return the module `ezdxf`, an optional dependency.

    Raises
    ------
    InputError
        It is not installed.
    """
    return optional("ezdxf", "DXF files need ezdxf", "ezdxf (or foldyn[dxf])")
