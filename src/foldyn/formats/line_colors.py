"""Letters of lines by color: colors of Origami Simulator; other colors count as the nearest.

Source: A. Ghassaei, E. Demaine, N. Gershenfeld, Fast, interactive origami simulation using GPU
computation, Origami 7 (2018), and the notes on SVG of origamisimulator.org.
"""

from __future__ import annotations

import colorsys
from collections import Counter
from collections.abc import Mapping

from foldyn.formats.drawing import count

RGB = tuple[int, int, int]

COLORS: dict[RGB, tuple[str, str]] = {
    (0, 0, 0): ("B", "black, outline"),
    (255, 0, 0): ("M", "red, mountain"),
    (0, 0, 255): ("V", "blue, valley"),
    (255, 255, 0): ("F", "yellow, flat"),
    (0, 255, 0): ("C", "green, cut"),
    (255, 0, 255): ("U", "magenta, hinge"),
}
"""Letter and name of each color."""
_HUES = (  # upper end (degrees) of the range of hues that count as each color
    (30, (255, 0, 0)),
    (90, (255, 255, 0)),
    (165, (0, 255, 0)),
    (200, (255, 255, 0)),  # cyan, the auxiliary lines of other programs
    (270, (0, 0, 255)),
    (330, (255, 0, 255)),
    (360, (255, 0, 0)),
)
_GRAY = 0.15  # difference of components below which a color counts as gray
_DARK, _WHITE = 0.4, 0.95
_MOST_COLORS = 10  # largest number of colors that are reported individually


def nearest(rgb: RGB) -> RGB | None:
    """Color of `COLORS` nearest to another by hue; None for white, which is not drawn.

    Dark gray counts as black, light gray and cyan as yellow (flat).
    """
    if rgb in COLORS:
        return rgb
    red, green, blue = (component / 255 for component in rgb)
    if max(red, green, blue) - min(red, green, blue) < _GRAY:
        gray = (red + green + blue) / 3
        return (0, 0, 0) if gray < _DARK else (255, 255, 0) if gray < _WHITE else None
    hue = 360 * colorsys.rgb_to_hsv(red, green, blue)[0]
    return next(color for most, color in _HUES if hue <= most)


def letter_of(color: RGB, taken: Counter[tuple[RGB, RGB | None]]) -> str | None:
    """Letter of a line by its color, None if white; the color is counted in `taken`."""
    to = nearest(color)
    taken[color, to] += 1
    return None if to is None else COLORS[to][0]


def color_doubts(taken: Mapping[tuple[RGB, RGB | None], int]) -> list[str]:
    """Doubts about colors that are not in `COLORS`, with the number of lines of each."""
    doubts = []
    for (color, to), number in taken.items():
        if color != to:
            name = "white, not drawn" if to is None else COLORS[to][1]
            doubts.append(
                f"color #{color[0]:02x}{color[1]:02x}{color[2]:02x} of {count(number, 'line')} is "
                f"taken for {name}"
            )
    left = len(doubts) - _MOST_COLORS
    return [*doubts[:_MOST_COLORS], f"{left} more colors"] if left > 0 else doubts
