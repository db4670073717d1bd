"""Resch's triangular tessellation."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from foldyn.errors import within
from foldyn.patterns.generators.arguments import cell_counts, flag
from foldyn.patterns.generators.assembly import assembled
from foldyn.patterns.pattern import Pattern
from foldyn.patterns.topology import Edge
from foldyn.values import length

LETTERS = {"tile": "M", "tuck": "V", "star": "M"}
CLOSED = {"tile": -math.pi / 2, "tuck": math.pi, "star": -math.pi / 3}
"""Fold angles (rad) of the folded state."""


def resch(cells: Sequence[int] = (3, 3), a: float = 1.0, folded: bool = False) -> Pattern:
    """Resch's triangular tessellation: tiles that close up over tucked stars.

    The flat pattern has equilateral triangles of two sizes: tiles with sides a, and stars with
    sides 2 a between them, each cut into six by creases from its center to its corners (tucks) and
    to the middles of its sides. Folded, the stars disappear behind the tiles, which cover the
    plane: the middles of a star's sides meet in one point, its center hangs a/sqrt(3) below it,
    the tucks are closed, and the tiles stand at right angles to them.

    Both states are exact. On the way between them the sheet bends as a whole, and no motion keeps
    it plane: with horizontal tiles only the two ends have all lengths right. The flat state has
    the angles to fold to (`Pattern.fold_angles`); a solver can fold it part of the way.

    Parameters
    ----------
    cells : sequence of two int
        Stars along two directions, at 30 and at 90 degrees to x; each brings two tiles with it.
    a : float
        Side of a tile (m).
    folded : bool
        Whether to give the folded state.

    Returns
    -------
    Pattern
        8 cells[0] cells[1] triangles, front to +z. Families: "tile", the sides of tiles
        (mountains); "tuck", from the centers of stars to their corners (valleys); "star", from
        there to the middles of their sides (mountains).

    Raises
    ------
    InputError
        An argument of the wrong type or out of range.

    Notes
    -----
    T. Tachi, Designing freeform origami tessellations by generalizing Resch's patterns,
    J. Mech. Des. 135, 2013.
    """
    with within("resch: "):
        counts, folded = cell_counts(cells, 7), flag("folded", folded)
        a = length("a", a)
    found: dict[tuple[int, int, int], int] = {}
    vertices: list[tuple[float, float, float]] = []

    def corner(m: int, n: int, k: int) -> int:
        """Number of the middle of side k of star (m, n), or of its center for k = 3."""
        if (m, n, k) not in found:
            found[m, n, k] = len(vertices)
            vertices.append(_place(m, n, k, a, folded))
        return found[m, n, k]

    faces: list[tuple[int, ...]] = []
    families: dict[str, list[Edge]] = {"tile": [], "tuck": [], "star": []}
    for m in range(counts[0]):
        for n in range(counts[1]):
            center = corner(m, n, 3)
            middle = [corner(m, n, k) for k in range(3)]
            tips = [corner(m, n + 1, 2), corner(m - 1, n, 0), corner(m + 1, n - 1, 1)]
            for k in range(3):
                # around the star: middle, tip, next middle
                faces += [(center, middle[k], tips[k]), (center, tips[k], middle[k - 2])]
                families["tuck"].append((center, tips[k]))
                families["star"].append((center, middle[k]))
                families["tile"] += [(middle[k], tips[k]), (tips[k], middle[k - 2])]
            left, right = corner(m, n - 1, 1), corner(m, n - 1, 0)
            faces += [(tips[1], left, middle[2]), (middle[2], right, tips[2])]
            families["tile"] += [(left, middle[2]), (tips[1], left)]
            families["tile"] += [(right, middle[2]), (tips[2], right)]
    families = {name: list(dict.fromkeys(pairs)) for name, pairs in families.items()}
    angles = None if folded else CLOSED
    return assembled("resch", vertices, faces, families, LETTERS, angles)


def _place(m: int, n: int, k: int, a: float, folded: bool) -> tuple[float, float, float]:
    """Place (m) of a star's center (k = 3), or of the middle of its side k.

    The sides' middles lie at 30, 150 and 270 degrees about the center, the tips at 90, 210, 330.
    """
    apart = a if folded else math.sqrt(3.0) * a  # between stars
    center = apart * (m * np.exp(1j * math.pi / 6) + n * 1j)
    if folded:
        return center.real, center.imag, -a / math.sqrt(3.0) if k == 3 else 0.0
    if k < 3:
        center += a / math.sqrt(3.0) * np.exp(1j * (math.pi / 6 + k * 2.0 * math.pi / 3))
    return center.real, center.imag, 0.0
