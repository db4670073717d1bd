"""The eggbox: equal parallelograms that stand up as pyramids."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from foldyn.patterns import arguments
from foldyn.patterns.pattern import Pattern


def eggbox(
    cells: Sequence[int] = (1, 1),
    a: float = 1.0,
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
        is odd; so too along y with i.

    Returns
    -------
    Pattern
        (2 cells[0] + 1)(2 cells[1] + 1) vertices and 4 cells[0] cells[1] faces, front to +z.

    Raises
    ------
    InputError
        An argument of the wrong type or out of range.
    """
    nx, ny = arguments.cell_counts("eggbox", cells)
    a = arguments.length("eggbox", "a", a)
    b = arguments.length("eggbox", "b", b)
    gamma = math.radians(arguments.panel_angle("eggbox", panel_angle))
    half = math.radians(arguments.fold_dihedral("eggbox", dihedral, flat_allowed=False)) / 2
    cos_y = math.hypot(math.cos(gamma), math.sin(gamma) * math.cos(half))
    h1, h2 = a * cos_y, b * math.cos(gamma) / cos_y
    # The roots of the contract's formulas, taken by hand: nothing cancels.
    length = a * math.sin(gamma) * math.sin(half)
    s = b * math.sin(gamma) * math.cos(half) / cos_y
    i, j = np.meshgrid(np.arange(2 * nx + 1), np.arange(2 * ny + 1), indexing="ij")
    vertices = np.stack([s * i, length * j, h1 * (j % 2) + h2 * (i % 2)], axis=-1)
    return Pattern(vertices.reshape(-1, 3), arguments.grid_faces(2 * nx, 2 * ny), name="eggbox")
