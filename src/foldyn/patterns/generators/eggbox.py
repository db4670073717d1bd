"""The eggbox sheet."""

from __future__ import annotations

import math
from collections.abc import Sequence

from foldyn.errors import within
from foldyn.patterns.generators.arguments import acute, cell_counts, fold_dihedral, sizes
from foldyn.patterns.generators.grid import indices, opposite, sheet
from foldyn.patterns.pattern import Pattern


def eggbox(
    cells: Sequence[int] = (1, 1),
    a: float = 1.0,
    *,
    b: float = 1.0,
    panel_angle: float = 75.0,
    dihedral: float = 60.0,
) -> Pattern:
    """Eggbox sheet, its unit cells of 2 x 2 parallelograms along x and y.

    Vertex (i, j), i along x and j along y, is number i (2 cells[1] + 1) + j and lies at
    (s i, l j, h1 [j odd] + h2 [i odd]). With the panel angle g and the dihedral d:
    cos y = sqrt(cos^2 g + sin^2 g cos^2(d/2)), h1 = a cos y, h2 = b cos g/cos y, l = a sin y,
    s = b sqrt(1 - cos^2 g/cos^2 y). Panels run along x first. Unlike a Miura-ori it cannot be
    flattened: the corner angles around a peak add up to less than 360 degrees.

    Parameters
    ----------
    cells : sequence of two int
        Unit cells along x and y.
    a, b : float
        Lengths of the panel edges along y and along x (m).
    panel_angle : float
        Acute angle of the panels (degrees, between 0 and 90).
    dihedral : float
        Angle between the panels across the creases along x (degrees, between 0 and 180, at
        both of which the sheet closes to a line): valleys where j is even, mountains where it
        is odd; likewise along y with i.

    Returns
    -------
    Pattern
        (2 cells[0] + 1)(2 cells[1] + 1) vertices and 4 cells[0] cells[1] faces, front to +z.
        Families: "along_x" and "along_y".

    Raises
    ------
    InputError
        An argument of the wrong type or out of range.
    """
    with within("eggbox: "):
        nx, ny = cell_counts(cells, 4)
        a, b = sizes(a, b)
        gamma = acute("panel_angle", panel_angle)
        half = math.radians(fold_dihedral(dihedral, flat_allowed=False)) / 2
    cos_y = math.hypot(math.cos(gamma), math.sin(gamma) * math.cos(half))
    h1, h2 = a * cos_y, b * math.cos(gamma) / cos_y
    # the roots of the docstring's formulas, rewritten so that nothing cancels
    along_y = a * math.sin(gamma) * math.sin(half)
    s = b * math.sin(gamma) * math.cos(half) / cos_y
    i, j = indices(2 * nx, 2 * ny)
    places = [s * i, along_y * j, h1 * (j % 2) + h2 * (i % 2)]
    return sheet("eggbox", places, ("along_x", "along_y"), periods=opposite(2 * nx, 2 * ny))
