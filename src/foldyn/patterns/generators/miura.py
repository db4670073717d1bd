"""The Miura-ori sheet."""

from __future__ import annotations

import math
from collections.abc import Sequence

from foldyn.errors import within
from foldyn.patterns.generators.arguments import acute, cell_counts, fold_dihedral, sizes
from foldyn.patterns.generators.grid import indices, lines, opposite, sheet
from foldyn.patterns.pattern import Pattern
from foldyn.patterns.topology import Edge


def miura(
    cells: Sequence[int] = (1, 1),
    a: float = 1.0,
    *,
    b: float = 1.0,
    panel_angle: float = 60.0,
    dihedral: float = 60.0,
) -> Pattern:
    """Miura-ori sheet, its unit cells of 2 x 2 parallelograms along x and y.

    Vertex (i, j), i along x and j along y, is number i (2 cells[1] + 1) + j and lies at
    (s i, l j + v [i odd], h [j odd]). With the panel angle g and the tilt
    f = (180 - dihedral)/2 of a panel to the horizontal: t = cos f tan g,
    s = b t/sqrt(1 + t^2), l = a sqrt(1 - sin^2 f sin^2 g), v = b/sqrt(1 + t^2),
    h = a sin g sin f. Panels run along x first.

    Parameters
    ----------
    cells : sequence of two int
        Unit cells along x and y.
    a : float
        Length of the panel edges along y, in the planes of constant x (m).
    b : float
        Length of the panel edges along x, which zigzag at a constant height (m).
    panel_angle : float
        Acute angle of the panels (degrees, between 0 and 90).
    dihedral : float
        Angle between the panels across the zigzag creases, those along x with j constant
        (degrees, above 0, 180 is flat): valleys where j is even, mountains where it is odd.

    Returns
    -------
    Pattern
        (2 cells[0] + 1)(2 cells[1] + 1) vertices and 4 cells[0] cells[1] faces, front to +z.
        Families: "zigzag", the creases along x, and "straight", those along y, which alternate
        between valley and mountain.

    Raises
    ------
    InputError
        An argument of the wrong type or out of range.

    Notes
    -----
    The fold angles p of the straight and q of the zigzag creases (180 degrees less the dihedral)
    keep tan(p/2) = cos(panel_angle) tan(q/2): M. Schenk, S. D. Guest, Geometry of Miura-folded
    metamaterials, PNAS 110, 2013.
    """
    with within("miura: "):
        nx, ny = cell_counts(cells, 4)
        a, b = sizes(a, b)
        gamma = acute("panel_angle", panel_angle)
        dihedral = fold_dihedral(dihedral)
    tilt = math.radians(180.0 - dihedral) / 2
    # cos of the tilt as sin of half the dihedral stays accurate when nearly closed
    t = math.sin(math.radians(dihedral) / 2) * math.tan(gamma)
    s = b * t / math.hypot(1.0, t)
    v = b / math.hypot(1.0, t)
    h = a * math.sin(gamma) * math.sin(tilt)
    along_y = a * math.sqrt(1.0 - (math.sin(tilt) * math.sin(gamma)) ** 2)
    i, j = indices(2 * nx, 2 * ny)
    places = [s * i, along_y * j + v * (i % 2), h * (j % 2)]
    letters = miura_letters(2 * nx, 2 * ny) if dihedral == 180 else None
    return sheet("miura", places, ("zigzag", "straight"), letters, opposite(2 * nx, 2 * ny))


def miura_letters(columns: int, rows: int) -> dict[Edge, str]:
    """Assignments of the creases of a flat sheet."""
    zigzag, straight = lines(columns, rows)
    step = rows + 1
    return {pair: "M" if pair[0] % step % 2 else "V" for pair in zigzag} | {
        (low, high): "V" if (low // step + low % step) % 2 else "M" for low, high in straight
    }
