"""DXF crease patterns: the kind of a line follows from its layer, or else from its color.

A layer defines the kind by a word in its name: mountain, valley, cut, border (boundary, outline,
contour), facet (flat, aux), fold (crease, hinge; without a letter); or by the name M, V, C, B, F or
U. The library ezdxf reads the format.
"""

from __future__ import annotations

import io
import logging
import re
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError, optional
from foldyn.formats.chords import Chords
from foldyn.formats.drawing import METERS, Drawing, count, read_number
from foldyn.formats.line_colors import RGB, color_doubts, letter_of
from foldyn.formats.lines import MOST_LINES, too_many
from foldyn.formats.svg import NAMES, PER_METER
from foldyn.formats.writers import flat_points, letters, warn_of_angles
from foldyn.input_files import DEEPEST
from foldyn.patterns import Pattern
from foldyn.values import LONGEST, shortened

_LAYERS = (
    ("M", re.compile(r"mountain|^m$")),
    ("V", re.compile(r"valley|^v$")),
    ("C", re.compile(r"cut|^c$")),
    ("B", re.compile(r"border|boundary|outline|contour|^b$")),
    ("F", re.compile(r"facet|flat|aux|^f$")),
    ("U", re.compile(r"fold|crease|hinge|^u$")),
)
_DRAWN = ("LINE", "LWPOLYLINE", "POLYLINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE")
_MOST_INSERTED = 10_000
_UNITS = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m", 7: "km", 12: "nm", 13: "um", 21: "ft"}
"""Units by their number in $INSUNITS (DXF reference, header section)."""
_COLOR_NUMBERS = {"B": 7, "M": 1, "V": 5, "F": 2, "U": 6, "C": 3}
"""AutoCAD color number of each layer that is written: black or white, red, blue, yellow, magenta,
green."""


def read(text: str) -> Drawing:
    """Lines of a DXF file (ASCII).

    Parameters
    ----------
    text : str
        The file's content.

    Returns
    -------
    Drawing
        In the file's unit ($INSUNITS), of the model space, blocks included. Curves are chords
        within 1e-3 of the drawing's size. Layers that are off or frozen are left out.

    Raises
    ------
    InputError
        The text is not DXF or has no lines, or ezdxf is not installed.
    """
    document = _document(ezdxf(), text)
    with _reading("entities"):
        entities, skipped = _entities(document)
    paths = [(entity, path) for entity in entities for path in _paths(entity)]
    with _reading("lines"):
        controls = [
            np.array([(v.x, v.y, v.z) for v in path.control_vertices()]) for _, path in paths
        ]
    boxes = [box for box in controls if len(box)]
    if not boxes:
        raise InputError(": there are none that can be read; give a crease pattern", "lines")
    if not (np.abs(np.concatenate(boxes)) <= LONGEST).all():
        raise InputError(f": coordinates must be finite, and at most {LONGEST:g}", "lines")
    colors: Counter[tuple[RGB, RGB | None]] = Counter()
    chords, curved = Chords(boxes), 0
    for entity, path in paths:
        with _reading(_place(entity)):
            letter = _letter(entity, document, colors)
            along = _along(entity, path, chords.tolerance)
        if letter is not None:
            chords.add(along, letter, _place(entity))
            curved += path.has_curves
    return chords.drawing(
        curved, np.nan, skipped,
        meters=METERS.get(_UNITS.get(document.header.get("$INSUNITS", 0), "")), assumed=1e-3,
        doubts=tuple(color_doubts(colors)),
    )  # fmt: skip


def _document(library: Any, text: str) -> Any:
    _check_numbers(text)
    logger, handler = logging.getLogger("ezdxf"), logging.NullHandler()
    logger.addHandler(handler)  # otherwise ezdxf logs to standard error
    try:
        with _reading("is not a DXF file"):
            return library.read(io.StringIO(text))
    finally:
        logger.removeHandler(handler)


def _check_numbers(text: str) -> None:
    """Refuse coordinates that only Python reads as numbers, such as 1_000."""
    if text.isascii() and "_" not in text:
        return
    lines = text.splitlines()
    for number, (code, value) in enumerate(zip(lines[::2], lines[1::2], strict=False)):
        if code.strip().isdecimal() and 10 <= int(code) < 60:
            read_number(value.strip(), f"line {2 * number + 2}", "must be a number")


@contextmanager
def _reading(place: str) -> Iterator[None]:
    """Within the block, refuse what ezdxf cannot read; damaged files can raise any error."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        said = shortened(f"{type(error).__name__} {error}")
        raise InputError(f": cannot be read: {said}", place) from None


def _entities(document: Any) -> tuple[list[Any], list[str]]:
    """Line entities, including entities in blocks, and remarks on other entities."""
    from ezdxf.disassemble import recursive_decompose

    layers = [layer for layer in document.layers if layer.is_off() or layer.is_frozen()]
    hidden = {layer.dxf.name.lower() for layer in layers}
    kept, others = [], Counter[str]()
    space = document.modelspace()
    if _inserted(space, document, {}, 0) > _MOST_INSERTED:
        raise too_many("the entities of blocks")
    if len(space) > MOST_LINES:
        raise too_many("the entities")
    for entity in recursive_decompose(space):
        kind = entity.dxftype()
        if entity.dxf.get("layer", "0").lower() in hidden or entity.dxf.get("invisible", 0):
            others["hidden"] += 1
        elif kind in _DRAWN:
            kept.append(entity)
        else:
            others[kind] += 1
    if not others:
        return kept, []
    said = ", ".join(count(number, kind) for kind, number in sorted(others.items())[:6])
    return kept, [f"left out {said}"]


def _inserted(layout: Any, document: Any, known: dict[str, int], depth: int) -> int:
    """Number of entities that the blocks of a layout expand to."""
    total = 0
    for insert in layout.query("INSERT"):
        name = str(insert.dxf.get("name", "")).lower()
        if name in document.blocks:
            if name not in known:
                if depth == DEEPEST:
                    raise InputError(f": nested deeper than {DEEPEST} levels", "blocks")
                block = document.blocks.get(name)
                known[name] = len(block) + _inserted(block, document, known, depth + 1)
            total += max(1, insert.mcount) * (1 + known[name])
    return total


def _paths(entity: Any) -> Iterator[Any]:
    """Path of an entity; meshes have none."""
    from ezdxf.path import make_path

    with _reading(_place(entity)), suppress(TypeError):
        yield make_path(entity)


def _place(entity: Any) -> str:
    return f"{entity.dxftype()} {entity.dxf.handle if entity.dxf.hasattr('handle') else ''}".strip()


def _along(entity: Any, path: Any, tolerance: float) -> NDArray[np.float64]:
    """Points (k, 3) along a path; for circles and arcs they lie on the curve."""
    if path.has_curves and tolerance:
        exact = entity.dxftype() in ("ARC", "CIRCLE") and entity.dxf.radius > tolerance
        found = islice((entity if exact else path).flattening(tolerance), MOST_LINES + 2)
    else:
        found = path.control_vertices()
    return np.array([(v.x, v.y, v.z) for v in found]).reshape(-1, 3)


def _letter(entity: Any, document: Any, colors: Counter[tuple[RGB, RGB | None]]) -> str | None:
    """Letter of a line from its layer, else from its color; None for a white line."""
    name = str(entity.dxf.get("layer", "0"))
    for letter, pattern in _LAYERS:
        if pattern.search(name.lower()):
            return letter
    return letter_of(_color(entity, document, name), colors)


def _color(entity: Any, document: Any, layer: str) -> RGB:
    """Color of a line, or else of its layer; color index 7 is black on white paper."""
    from ezdxf.colors import aci2rgb

    holders = [entity]
    if layer in document.layers:
        holders.append(document.layers.get(layer))
    for holder in holders:
        if holder.rgb is not None:
            return holder.rgb
        index = abs(int(holder.dxf.get("color", 256)))
        if index in (0, 7):
            return 0, 0, 0
        if index < 256:
            return aci2rgb(index)
    return 0, 0, 0


def write(pattern: Pattern) -> str:
    """Text of a DXF file (R2010): a layer for each kind of line, "MOUNTAIN" and so on.

    Parameters
    ----------
    pattern : Pattern
        A flat pattern.

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
    document = ezdxf().new("R2010", units=4)  # mm
    space = document.modelspace()
    edges = letters(pattern)
    for letter in _COLOR_NUMBERS:
        if any(edge[1] == letter for edge in edges):
            document.layers.add(NAMES[letter].upper(), color=_COLOR_NUMBERS[letter])
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
