"""SVG writer: crease patterns at true size, in the colors of Origami Simulator.

Source of the colors: Origami Simulator (A. Ghassaei), "Design tips": mountains red, valleys blue,
boundary black, facets yellow, cuts green, undriven creases magenta; the opacity of a mountain or
valley is its fold angle, 180 degrees where it is opaque. The legend is text, which neither cutters
nor readers of crease patterns mistake for lines.
"""

from __future__ import annotations

from html import escape

import numpy as np

from foldyn.formats.line_colors import COLORS
from foldyn.formats.writers import flat_points, letters
from foldyn.patterns import Pattern

PER_METER = 1e3  # mm
PAINT = {letter: "#{:02x}{:02x}{:02x}".format(*rgb) for rgb, (letter, _) in COLORS.items()}
NAMES = {
    "B": "boundary",
    "M": "mountain",
    "V": "valley",
    "F": "facet",
    "U": "unassigned",
    "C": "cut",
}
FAINTEST = 1e-6
"""Opacity of a crease with fold angle 0, as a line without opacity is invisible."""
_DARKER = {"F": "#b8a000", "C": "#00a000"}  # of words, which must be read on white


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
    # boundary last, over the ends of the creases
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
