"""Shapes of SVG as polylines; curves become chords."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.formats.chords import arc_chords, bezier
from foldyn.formats.xml_text import local
from foldyn.values import show

PIXEL = 0.0254 / 96
"""Length of a CSS pixel (m)."""
_UNITS = {"": 1.0, "px": 1.0, "in": 96.0, "cm": 96 / 2.54, "mm": 96 / 25.4, "q": 96 / 101.6,
          "pt": 96 / 72, "pc": 16.0}  # fmt: skip
_DIGITS = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_LENGTH = re.compile(rf"({_DIGITS})\s*([A-Za-z%]*)", re.ASCII)
_NUMBER = re.compile(_DIGITS, re.ASCII)
_FUNCTION = re.compile(
    r"\s*(matrix|translate[XY]?|scale[XY]?|rotate|skew[XY]?)\s*\(([^()]*)\)[\s,]*"
)
_ANGLES = {"": 1.0, "deg": 1.0, "grad": 0.9, "rad": math.degrees(1.0), "turn": 360.0}
_LONGEST = 2000  # largest length of a transform, in characters
SHAPES = ("line", "polyline", "polygon", "rect", "circle", "ellipse", "path")
Placing = NDArray[np.float64]
"""Affine map (2, 3) from the coordinates of an element to coordinates of the drawing."""


@dataclass(frozen=True)
class Curve:
    """A piece of a shape: its ends, and the curve between them.

    Attributes
    ----------
    frame : ndarray, shape (k, 2)
        Points that bound the piece; the first and last are its ends.
    points : callable
        Maps a tolerance to points (k, 2) along the piece, ends included.
    straight : bool
        Whether the piece is a straight line.
    """

    frame: NDArray[np.float64]
    points: Callable[[float], NDArray[np.float64]]
    straight: bool


def length(text: str | None, whole: float, place: str, default: float = 0.0) -> float:
    """Length in pixels; percentages refer to `whole`."""
    if text is None or text.strip() in ("", "auto"):
        return default
    match = _LENGTH.fullmatch(text.strip()[:_LONGEST])
    unit = match[2].lower() if match else None
    if match is None or unit not in (*_UNITS, "%"):
        raise InputError(f" = {show(text)}: give a length, such as 12, 12px or 5mm", place)
    value = float(match[1])
    return value * whole / 100 if unit == "%" else value * _UNITS[str(unit)]


def numbers(text: str) -> list[float]:
    """Numbers of a list, whatever separates them."""
    return [float(word) for word in _NUMBER.findall(text)]


def _is_plain(text: str) -> bool:
    """Whether other programs read all numbers of a text as Python does."""
    return text.isascii() and "_" not in text


def placing(text: str, place: str) -> Placing:
    """Affine map of a `transform`, given as an attribute or in CSS."""
    from svgelements import Matrix

    text, plain, end = text.strip(), [], 0
    if text in ("", "none"):
        return np.eye(3)[:2]
    try:
        while end < len(text) <= _LONGEST and (match := _FUNCTION.match(text, end)):
            plain.append(_without_units(match[1], match[2]))
            end = match.end()
        if end < len(text) or not _is_plain(text):
            raise ValueError
        m = Matrix(" ".join(plain))
        found = np.array([[m.a, m.c, m.e], [m.b, m.d, m.f]], dtype=np.float64)
    except (ValueError, TypeError, KeyError, IndexError, OverflowError, AttributeError):
        raise InputError(
            f" = {show(text)}: is no transform of the plane by numbers, lengths and angles, as "
            "rotate(30deg) translate(5px, 2mm); write it so, or apply it to the coordinates",
            f"{place}.transform",
        ) from None
    if not np.isfinite(found).all():
        raise InputError(f" = {show(text)}: must be finite", f"{place}.transform")
    return found


def _without_units(name: str, arguments: str) -> str:
    """Convert a transform function to degrees and pixels, and to attribute names."""
    if _LENGTH.sub("", arguments).strip(" \t\r\n,"):
        raise ValueError(arguments)
    kind, axis, values = name.rstrip("XY"), name[-1], []
    for k, (digits, unit) in enumerate(_LENGTH.findall(arguments)):
        if (kind == "rotate" and k == 0) or kind == "skew":
            factor = _ANGLES[unit.lower()]
        elif kind == "scale":
            factor = {"": 1.0, "%": 0.01}[unit]
        else:
            factor = 1.0 if kind == "matrix" and not unit else _UNITS[unit.lower()]
        values.append(float(digits) * factor)
    if name == "skew":
        x, y = (math.tan(math.radians(value)) for value in (*values, 0.0)[:2])
        return f"matrix(1 {y!r} {x!r} 1 0 0)"
    if kind in ("translate", "scale") and axis in "XY":
        (value,), other = values, float(kind == "scale")
        values, name = [value, other] if axis == "X" else [other, value], kind
    return f"{name}({' '.join(map(repr, values))})"


def placed_by(given: Mapping[str, str], place: str) -> Placing:
    """Affine map of the `transform` of an element, about its `transform-origin`."""
    here = placing(given["transform"], place)
    words = ["0" if w in ("left", "top") else w for w in given.get("transform-origin", "").split()]
    if given.get("transform-box", "view-box") != "view-box" or "%" in "".join(words):
        raise InputError(
            ": is not read where it depends on the box of the element; give the origin as lengths, "
            "as 5px 5px, or apply the transform to the coordinates",
            f"{place}.transform-origin",
        )
    x, y = (length(word, 0.0, f"{place}.transform-origin") for word in [*words, "0", "0"][:2])
    back = np.array([[1.0, 0.0, -x], [0.0, 1.0, -y]])
    return after(after(np.array([[1.0, 0.0, x], [0.0, 1.0, y]]), here), back)


def after(outer: Placing, inner: Placing) -> Placing:
    """Compose maps, `inner` first."""
    return outer @ np.vstack((inner, (0.0, 0.0, 1.0)))


def curves(element: Element, whole: tuple[float, float], place: str) -> list[Curve]:
    """Pieces of a shape in its own coordinates.

    Raises
    ------
    InputError
        The attributes describe no shape; the message names the place.
    """
    from svgelements import Ellipse, Path, Rect

    name = local(element)

    def side(key: str, axis: int, default: float = 0.0) -> float:
        size = whole[axis] if axis < 2 else float(np.hypot(*whole) / np.sqrt(2.0))
        return length(element.get(key), size, f"{place}.{key}", default)

    if name == "line":
        return _polyline([(side("x1", 0), side("y1", 1)), (side("x2", 0), side("y2", 1))])
    if name in ("polyline", "polygon"):
        text = element.get("points", "")
        if not _is_plain(text):
            raise InputError(f" = {show(text)}: give pairs of numbers", f"{place}.points")
        given = numbers(text)
        points = [(given[k], given[k + 1]) for k in range(0, len(given) - 1, 2)]
        return _polyline(points + points[:1] if name == "polygon" else points)
    if name == "rect":
        x, y, w, h = side("x", 0), side("y", 1), side("width", 0), side("height", 1)
        rx = side("rx", 0, side("ry", 1))
        ry = side("ry", 1, rx)
        round_ = min(max(rx, 0.0), w / 2), min(max(ry, 0.0), h / 2)
        return list(_segments(Path(Rect(x, y, w, h, *round_)))) if w > 0 and h > 0 else []
    if name in ("circle", "ellipse"):
        r = side("r", 2)
        rx, ry = (r, r) if name == "circle" else (side("rx", 0), side("ry", 1))
        shape = Ellipse(side("cx", 0), side("cy", 1), rx, ry)
        return list(_segments(Path(shape))) if rx > 0 and ry > 0 else []
    return list(_path(element.get("d", ""), f"{place}.d"))


def _polyline(points: list[tuple[float, float]]) -> list[Curve]:
    return [_line(np.array(pair)) for pair in pairwise(points)]


def _line(ends: NDArray[np.float64]) -> Curve:
    return Curve(ends, lambda _: ends, True)


def _path(text: str, place: str) -> Iterator[Curve]:
    from svgelements import Path

    if text.strip() in ("", "none"):
        return
    try:
        if text.strip()[0] not in "Mm" or not _is_plain(text):
            raise ValueError
        yield from _segments(Path(text))
    except (ValueError, TypeError, IndexError, OverflowError, ZeroDivisionError, AttributeError):
        raise InputError(f" = {show(text)}: is no path", place) from None


def _segments(path: Any) -> Iterator[Curve]:
    """Pieces of a path.

    Raises
    ------
    ValueError
        The path has no start or no end.
    """
    from svgelements import Arc, Close, CubicBezier, Move, QuadraticBezier

    for segment in path:
        start, end = segment.start, segment.end
        if isinstance(segment, Move) or (isinstance(segment, Close) and None in (start, end)):
            continue
        if start is None or end is None:
            raise ValueError
        if isinstance(segment, CubicBezier):
            yield _bezier(start, segment.control1, segment.control2, end)
        elif isinstance(segment, QuadraticBezier):
            yield _bezier(start, segment.control, end)
        elif isinstance(segment, Arc) and segment.sweep:
            yield _arc(segment)
        else:
            yield _line(np.array([(start.x, start.y), (end.x, end.y)]))


def _bezier(*points: Any) -> Curve:
    control = np.array([(point.x, point.y) for point in points])
    return Curve(control, lambda tolerance: bezier(control, tolerance), False)


def _arc(segment: Any) -> Curve:
    ends = np.array([(segment.start.x, segment.start.y), (segment.end.x, segment.end.y)])

    def along(count: int) -> NDArray[np.float64]:
        inner = [segment.point(k / count) for k in range(1, count)]
        return np.array([ends[0], *((point.x, point.y) for point in inner), ends[1]])

    def points(tolerance: float) -> NDArray[np.float64]:
        radius = max(float(segment.rx), float(segment.ry))
        return along(arc_chords(radius, float(segment.sweep), tolerance))

    return Curve(along(4), points, False)
