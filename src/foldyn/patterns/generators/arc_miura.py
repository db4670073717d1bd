"""The arc-Miura sheet, which curves as it folds."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from foldyn.errors import InputError, within
from foldyn.patterns.generators.arguments import (
    acute,
    cell_counts,
    check_turn,
    fold_dihedral,
    sizes,
)
from foldyn.patterns.generators.grid import indices, opposite, sheet
from foldyn.patterns.generators.miura import miura_letters
from foldyn.patterns.pattern import Pattern


def arc_miura(
    cells: Sequence[int] = (2, 4),
    a: float = 1.0,
    *,
    b: float = 1.0,
    panel_angle: float = 60.0,
    second_angle: float = 75.0,
    dihedral: float = 90.0,
) -> Pattern:
    """Arc-Miura sheet: a Miura-ori with two alternating zigzag angles, which folds to an arc.

    Vertex (i, j), i along x and j along y, is number i (2 cells[1] + 1) + j, as in `miura`.
    Zigzags with even j have the angle g1 and edges of length b; zigzags with odd j have the angle
    g2 and edges of length b sin g1/sin g2. The panels are trapezoids.

    The other creases form polygonal lines in planes of constant x, one for each i. A line with
    even i turns by d1 at even j and by -d2 at odd j. A line with odd i is the same line, with its
    corners shifted along their bisectors by v1 at even j and by v2 at odd j. With the tilt
    f = (180 - dihedral)/2, the planes are s = b sin g1/sqrt(1 + cos^2 g1 tan^2 f) apart, and with
    k = s cos g1 tan f: tan(d1/2) = k/(b cos g1), tan(d2/2) = k/(b sin g1 cot g2),
    v1 = sqrt(k^2 + (b cos g1)^2), and v2 likewise.

    Parameters
    ----------
    cells : sequence of two int
        Unit cells along x and along the arc, y where it begins.
    a : float
        Mean length of the two parallel edges of a panel (m).
    b : float
        Length of the panel edges along the zigzags with j even (m).
    panel_angle, second_angle : float
        Angles g1 and g2 (degrees, between 0 and 90) of the zigzags with j even and odd. Equal
        ones give a Miura-ori.
    dihedral : float
        Angle between the panels across the zigzags with j even, valleys (degrees, above 0, 180
        is flat).

    Returns
    -------
    Pattern
        (2 cells[0] + 1)(2 cells[1] + 1) vertices and 4 cells[0] cells[1] faces, front to +z at
        the beginning of the arc. Families: "zigzag" and "straight", as in `miura`.

    Raises
    ------
    InputError
        An argument of the wrong type or out of range; panels without length, or a sheet that
        rolls up by more than a full turn.

    Notes
    -----
    J. M. Gattas, W. Wu, Z. You, Miura-base rigid origami: parameterizations of first-level
    derivative and piecewise geometries, J. Mech. Des. 135, 2013. Each vertex is a flat-foldable
    Miura-ori vertex, so the sheet folds rigidly, with one degree of freedom.
    """
    with within("arc_miura: "):
        nx, ny = cell_counts(cells, 4)
        a, b = sizes(a, b)
        g1, g2 = acute("panel_angle", panel_angle), acute("second_angle", second_angle)
        dihedral = fold_dihedral(dihedral)
        along = b * math.cos(g1), b * math.sin(g1) / math.tan(g2)
        change = along[1] - along[0]  # in length of the straight edges, row to row
        if abs(change) >= 2.0 * a:
            raise InputError(
                f" = {a:g}: panels with these angles have no length; must be above "
                f"{abs(change) / 2.0:g} m",
                "a",
            )
        flat = dihedral == 180.0
        slope = 0.0 if flat else math.tan(math.radians(180.0 - dihedral) / 2)
        s = b * math.sin(g1) / math.hypot(1.0, math.cos(g1) * slope)
        k = s * math.cos(g1) * slope
        turns = [2.0 * math.atan2(k, each) for each in along]
        check_turn("cells[1]", ny, math.degrees(turns[0] - turns[1]), "cells")
    odd = np.arange(2 * ny + 1) % 2
    turn = np.where(odd, -turns[1], turns[0])
    # direction (rad) of the straight edge after each corner, and of the bisector there
    leaving = np.cumsum(turn) - 0.5 * turns[0]
    bisector = leaving - 0.5 * turn
    lengths = np.where(odd, a + 0.5 * change, a - 0.5 * change)[:-1]
    corner = np.concatenate([[0.0], (lengths * np.exp(1j * leaving[:-1])).cumsum()])
    shift = np.hypot(k, np.where(odd, along[1], along[0])) * np.exp(1j * bisector)
    i, _ = indices(2 * nx, 2 * ny)
    place = corner + np.where(i % 2, shift, 0.0)
    letters = miura_letters(2 * nx, 2 * ny) if flat else None
    places = [s * i, np.real(place), np.imag(place)]
    return sheet("arc miura", places, ("zigzag", "straight"), letters, opposite(2 * nx, 2 * ny))
