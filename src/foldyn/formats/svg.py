"""SVG crease patterns in the colors of Origami Simulator (A. Ghassaei, "Design tips").

Red is a mountain, blue a valley, black the outline, yellow a flat crease, green a cut, magenta a
hinge without a letter; the opacity of a mountain or valley is its fold angle divided by 180
degrees. The attributes data-assignment and data-foldAngle (letters and degrees) take precedence. y
points down in an SVG and up in a pattern, so that the drawing shows the sheet from its front.

Patterns are written at true size. The legend is text, so that neither cutters nor readers of crease
patterns mistake it for lines.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from html import escape
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.formats import svg_shapes
from foldyn.formats.chords import Chords
from foldyn.formats.drawing import Drawing, count
from foldyn.formats.line_colors import COLORS, RGB, color_doubts, letter_of
from foldyn.formats.lines import MOST_LINES, too_many
from foldyn.formats.svg_shapes import Curve, Placing, after, length, numbers
from foldyn.formats.svg_styles import Rules, Style, declared, rules_of, styled
from foldyn.formats.writers import flat_points, letters
from foldyn.formats.xml_text import DEEPEST, from_xml, local
from foldyn.patterns import Pattern
from foldyn.patterns.palette import CREASE_NAMES
from foldyn.values import LONGEST

_GROUPS = ("svg", "g", "a", "switch")
_NOT_DRAWN = ("text", "image", "foreignObject")
_STATED = ("mm", "cm", "in", "pt", "pc")
FAINT = "opacities are fold angles over 180 degrees"
# programs such as Inkscape write this value everywhere
OPAQUE = "all lines have opacity 1: creases fold to 180 degrees unless --to says otherwise"


@dataclass(frozen=True)
class _Frame:
    """Extent of the drawing: its view in user units, and the size of a user unit."""

    view: tuple[float, float]
    pixels: float = 1.0  # pixels per user unit
    physical: bool = False
    stretch: float = 1.0  # ratio of y to x


@dataclass
class _Lines:
    """Lines collected from the elements."""

    rules: Rules
    names: dict[str, Element]
    view: tuple[float, float]
    curves: list[tuple[Curve, Placing, Style, str]] = field(default_factory=list)
    counts: Counter[str] = field(default_factory=Counter)
    visited: int = 0


def read(text: str) -> Drawing:
    """Lines of an SVG file.

    Parameters
    ----------
    text : str
        The file's content.

    Returns
    -------
    Drawing
        In user units of the file, y up. Curves are chords within 1e-3 of the drawing's size. Hidden
        elements and text are left out.

    Raises
    ------
    InputError
        The text is not SVG, is unsafe to read, or has no lines; the message names the place.
    """
    root = from_xml(text, "an SVG file")
    if local(root) != "svg":
        raise InputError(f"is not an SVG file: its first element is <{local(root)[:40]}>")
    frame = _frame(root)
    rules, left = rules_of("".join(e.text or "" for e in root.iter() if local(e) == "style"))
    lines = _Lines(rules, {e.get("id", ""): e for e in root.iter()}, frame.view)
    upward = np.array([[1.0, 0.0, 0.0], [0.0, -frame.stretch, 0.0]])
    with np.errstate(over="ignore", invalid="ignore"):  # all positions are checked at the end
        _walk(root, upward, Style(), lines, 0)
        boxes = [placed(curve.frame, here) for curve, here, _, _ in lines.curves]
    told = f"{count(left, 'style rule')} with selectors other than tag, class and id"
    doubts = [told] if left else []
    titles = [e.text or "" for e in root if local(e) == "title"]
    return _drawing(lines, boxes, frame, doubts, " ".join("".join(titles[:1]).split())[:200])


def _frame(root: Element) -> _Frame:
    box = numbers(root.get("viewBox", ""))
    sizes = {key: (root.get(key) or "").strip() for key in ("width", "height")}
    physical = any(size[-2:].lower() in _STATED for size in sizes.values())
    pixels = [
        0.0 if "%" in size else length(size, 0.0, f"svg.{key}") for key, size in sizes.items()
    ]
    if len(box) != 4 or not (box[2] > 0 and box[3] > 0):
        return _Frame((pixels[0] or 100.0, pixels[1] or 100.0), 1.0, physical)
    view = box[2], box[3]
    ratios = [p / b for p, b in zip(pixels, view, strict=True) if p > 0]
    if not ratios:
        return _Frame(view)
    aspect = root.get("preserveAspectRatio", "")
    if "none" in aspect and len(ratios) == 2:
        return _Frame(view, ratios[0], physical, ratios[1] / ratios[0])
    return _Frame(view, max(ratios) if "slice" in aspect else min(ratios), physical)


def _walk(element: Element, outer: Placing, inherited: Style, lines: _Lines, depth: int) -> None:
    """Collect the lines of an element and its children."""
    lines.visited += 1
    if lines.visited > MOST_LINES:
        raise too_many("the elements of the drawing")
    if depth > DEEPEST:
        raise InputError(f": elements are used within each other more than {DEEPEST} deep", "use")
    name = local(element)
    identity = element.get("id", "")[:40]
    if identity == "legend" or name not in (*_GROUPS, *svg_shapes.SHAPES, *_NOT_DRAWN, "use"):
        return
    lines.counts[name] += 1
    if name in _NOT_DRAWN:
        return
    place = f'{name} "{identity}"' if identity else f"{name} {lines.counts[name]}"
    given = declared(element, lines.rules, place)
    style = styled(given, inherited, place)
    if style is None:
        return
    here = outer
    if "transform" in given:
        here = after(outer, svg_shapes.placed_by(given, place))
    if name in svg_shapes.SHAPES:
        if style.shown:
            found = svg_shapes.curves(element, lines.view, place)
            lines.curves += [(curve, here, style, place) for curve in found]
            if len(lines.curves) > MOST_LINES:
                raise too_many("the lines")
        return
    inside: Iterable[Element] = element
    if name == "use" or (name == "svg" and depth):
        x = length(element.get("x"), lines.view[0], f"{place}.x")
        y = length(element.get("y"), lines.view[1], f"{place}.y")
        if x or y:
            here = after(here, np.array([[1.0, 0.0, x], [0.0, 1.0, y]]))
    if name == "use":
        target = lines.names.get(_link(element)[1:]) if _link(element)[:1] == "#" else None
        if target is None:
            lines.counts["lost"] += 1
            return
        inside = target if local(target) == "symbol" else (target,)
    for child in inside:
        _walk(child, here, style, lines, depth + 1)


def _link(element: Element) -> str:
    return element.get("href") or element.get("{http://www.w3.org/1999/xlink}href") or ""


def _drawing(
    lines: _Lines, boxes: list[NDArray[np.float64]], frame: _Frame, doubts: list[str], title: str
) -> Drawing:
    if not lines.curves:
        raise InputError(
            ": there are none to be seen; give crease lines a stroke (red mountains, blue valleys, "
            "a black outline), or "
            "attributes data-assignment",
            "lines",
        )
    for box, (*_, place) in zip(boxes, lines.curves, strict=True):
        if not (np.abs(box) <= LONGEST).all():
            raise InputError(f": coordinates must be finite, and at most {LONGEST:g}", place)
    chords = Chords(boxes)
    opacities: list[float] = []
    stated: list[float] = []
    taken: Counter[tuple[RGB, RGB | None]] = Counter()
    for (curve, here, style, place), box in zip(lines.curves, boxes, strict=True):
        letter = style.letter or letter_of(style.color or (0, 0, 0), taken)
        if letter is None:
            continue
        if curve.straight or not chords.tolerance:
            along = box[[0, -1]]
        else:
            growth = float(np.linalg.svd(here[:, :2], compute_uv=False)[0])
            along = placed(curve.points(chords.tolerance / (growth or 1.0)), here)
        number = chords.add(along, letter, place)
        faint = style.stated and np.isnan(style.angle)
        opacities += [style.opacity * style.own if faint else np.nan] * number
        stated += [style.angle] * number
    angles, said = _fold_angles(np.array(chords.letters), np.array(opacities))
    angles = np.where(np.isnan(stated), angles, stated)
    return chords.drawing(
        sum(not curve.straight for curve, *_ in lines.curves),
        angles,
        _skipped(lines.counts),
        meters=frame.pixels * svg_shapes.PIXEL if frame.physical else None,
        assumed=frame.pixels * svg_shapes.PIXEL,
        unit="px" if frame.pixels == 1.0 else "unit",
        name=title,
        assumptions=said,
        doubts=(*doubts, *color_doubts(taken)),
    )


def placed(points: NDArray[np.float64], here: Placing) -> NDArray[np.float64]:
    """Points (k, 2) in the drawing."""
    return points @ here[:, :2].T + here[:, 2]


def _fold_angles(letters: NDArray, opacities: NDArray) -> tuple[NDArray, tuple[str, ...]]:
    """Fold angles (degrees) from opacities, and the assumptions made.

    If any mountain or valley is not opaque, creases without an opacity fold completely.
    """
    folds = np.isin(letters, ("M", "V"))
    stated = folds & np.isfinite(opacities)
    if not stated.any():
        return np.full(len(letters), np.nan), ()
    faint = bool((opacities[stated] < 1.0).any())
    if faint:
        opacities = np.where(folds & ~stated, 1.0, opacities)
    angles = np.where(folds, 180.0 * opacities, np.nan)
    return np.where(letters == "M", -angles, angles), (FAINT if faint else OPAQUE,)


def _skipped(counts: Counter[str]) -> list[str]:
    skipped = [count(counts[name], name) for name in _NOT_DRAWN if counts[name]]
    if counts["lost"]:
        skipped.append(count(counts["lost"], "reference") + " to what is not in the file")
    return [f"left out {', '.join(skipped)}"] if skipped else []


PER_METER = 1e3  # mm
PAINT = {letter: "#{:02x}{:02x}{:02x}".format(*rgb) for rgb, (letter, _) in COLORS.items()}
NAMES = {**CREASE_NAMES, "F": "facet", "B": "boundary", "C": "cut"}
FAINTEST = 1e-6
"""Opacity of a crease with fold angle 0: a line of opacity 0 would be invisible."""
_DARKER = {"F": "#b8a000", "C": "#00a000"}  # colors of words, which must be readable on white


def write(pattern: Pattern) -> str:
    """Text of an SVG file, in millimeters at true size, with y upwards as in the pattern.

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
        The pattern is folded.
    """
    points = PER_METER * flat_points(pattern, "SVG")
    points = np.stack([points[:, 0], 0.0 - points[:, 1]], axis=1)
    left, top = points.min(axis=0).tolist()
    width, height = np.ptp(points, axis=0).tolist()
    size = max(width, height)
    margin, pen = 0.03 * size, size / 500.0
    page = width + 2.0 * margin
    type_size = min(0.03 * size, page / 35.0)  # the longest line of the legend takes 33 em
    edges = letters(pattern)
    words = _legend(pattern, edges)
    line_height = 1.4 * type_size
    total = height + 2.0 * margin + (len(words) + 0.5) * line_height
    # boundary last, to cover the ends of creases
    edges.sort(key=lambda edge: "FUVMCB".index(edge[1]))
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{page!r}mm" height="{total!r}mm" '
        f'viewBox="{left - margin!r} {top - margin!r} {page!r} {total!r}">',
        *([f"<title>{escape(pattern.name, quote=False)}</title>"] if pattern.name else []),
        f'<g id="creases" fill="none" stroke-width="{pen:.4g}" stroke-linecap="round">',
    ]
    for (a, b), letter, angle in edges:
        (x1, y1), (x2, y2) = points[a].tolist(), points[b].tolist()
        share = max(abs(angle) / np.pi, FAINTEST)
        opacity = "" if np.isnan(angle) else f' stroke-opacity="{share!r}"'
        lines.append(
            f'<line x1="{x1!r}" y1="{y1!r}" x2="{x2!r}" y2="{y2!r}" '
            f'stroke="{PAINT[letter]}"{opacity if letter in "MV" else ""}/>'
        )
    lines += ["</g>", f'<g id="legend" font-family="sans-serif" font-size="{type_size:.4g}">']
    for k, text in enumerate(words):
        y = top + height + margin + (k + 1) * line_height
        lines.append(f'<text x="{left:.6g}" y="{y:.6g}">{text}</text>')
    return "\n".join([*lines, "</g>", "</svg>"]) + "\n"


def _legend(pattern: Pattern, edges: list) -> list[str]:
    """Lines of the legend: line kinds in their colors, the meaning of opacity, the size."""
    used = [letter for letter in "BMVFUC" if any(edge[1] == letter for edge in edges)]
    kinds = "  ".join(
        f'<tspan fill="{_DARKER.get(letter, PAINT[letter])}">{NAMES[letter]}</tspan>'
        for letter in used
    )
    driven = [abs(edge[2]) for edge in edges if edge[1] in "MV" and not np.isnan(edge[2])]
    width, height = (PER_METER * np.ptp(pattern.vertices[:, :2], axis=0)).tolist()
    size = f"{width:.6g} x {height:.6g} mm"
    if driven:
        size += "; opacity is the fold angle, 180\N{DEGREE SIGN} where opaque"
    return [kinds, size]
