"""The Miura-ori: a sheet of equal parallelograms."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from foldyn.patterns import arguments
from foldyn.patterns.pattern import Pattern


def miura(
    cells: Sequence[int] = (1, 1),
    a: float = 1.0,
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

    Raises
    ------
    InputError
        An argument of the wrong type or out of range.
    """
    nx, ny = arguments.cell_counts("miura", cells)
    a = arguments.length("miura", "a", a)
    b = arguments.length("miura", "b", b)
    gamma = math.radians(arguments.panel_angle("miura", panel_angle))
    dihedral = arguments.fold_dihedral("miura", dihedral, flat_allowed=True)
    tilt = math.radians(180.0 - dihedral) / 2
    # cos of the tilt as sin of half the dihedral keeps its digits when nearly closed.
    t = math.sin(math.radians(dihedral) / 2) * math.tan(gamma)
    s = b * t / math.hypot(1.0, t)
    v = b / math.hypot(1.0, t)
    h = a * math.sin(gamma) * math.sin(tilt)
    length = a * math.sqrt(1.0 - (math.sin(tilt) * math.sin(gamma)) ** 2)
    i, j = np.meshgrid(np.arange(2 * nx + 1), np.arange(2 * ny + 1), indexing="ij")
    vertices = np.stack([s * i, length * j + v * (i % 2), h * (j % 2)], axis=-1)
    return Pattern(vertices.reshape(-1, 3), arguments.grid_faces(2 * nx, 2 * ny), name="miura")
