"""Generators of common patterns."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError, within
from foldyn.memory import check_memory
from foldyn.patterns.pattern import Pattern
from foldyn.values import length, number, show, whole

PER_VERTEX = 2200.0
"""Bytes a vertex of a pattern as it is made: 1800 measured with 10,000 and 40,000 vertices."""


def simple_fold(a: float = 1.0, b: float = 1.0, dihedral: float = 60.0) -> Pattern:
    r"""Two rectangles that meet in one crease: an inverted V on the ground, a mountain.

    Vertices 0, 1 are at x = 0, vertices 2, 3 on the ridge (x = w, z = h), vertices 4, 5 at
    x = 2 w, the odd ones at y = b, with w = a sin(dihedral/2) and h = a cos(dihedral/2)::

               2,3
               /\
              /  \    h         z
             /    \             |
          0,1      4,5          +-- x

    Parameters
    ----------
    a : float
        Width of a panel, across the crease (m).
    b : float
        Length of the crease (m).
    dihedral : float
        Angle between the panels on the ground side (degrees, above 0, 180 is flat). Seen from
        the front (above) the crease is a mountain, so `Pattern.dihedrals` is 360 minus this.

    Returns
    -------
    Pattern
        6 vertices, 2 faces, 1 crease.

    Raises
    ------
    InputError
        An argument of the wrong type or out of range.
    """
    with within("simple_fold: "):
        a, b = length("a", a), length("b", b)
        dihedral = _fold_dihedral(dihedral, flat_allowed=True)
    w = a * math.sin(math.radians(dihedral) / 2)
    h = a * math.cos(math.radians(dihedral) / 2) if dihedral < 180 else 0.0
    vertices = np.array([[x, y, z] for x, z in ((0, 0), (w, h), (2 * w, 0)) for y in (0, b)])
    return Pattern(vertices, ((0, 2, 3, 1), (2, 4, 5, 3)), name="simple fold")


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
    with within("miura: "):
        cells, a, b, gamma = _grid_arguments(cells, a, b, panel_angle)
        dihedral = _fold_dihedral(dihedral, flat_allowed=True)
    tilt = math.radians(180.0 - dihedral) / 2
    # cos of the tilt as sin of half the dihedral keeps its digits when nearly closed.
    t = math.sin(math.radians(dihedral) / 2) * math.tan(gamma)
    s = b * t / math.hypot(1.0, t)
    v = b / math.hypot(1.0, t)
    h = a * math.sin(gamma) * math.sin(tilt)
    along_y = a * math.sqrt(1.0 - (math.sin(tilt) * math.sin(gamma)) ** 2)
    return _grid("miura", cells, lambda i, j: [s * i, along_y * j + v * (i % 2), h * (j % 2)])


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
    with within("eggbox: "):
        cells, a, b, gamma = _grid_arguments(cells, a, b, panel_angle)
        half = math.radians(_fold_dihedral(dihedral, flat_allowed=False)) / 2
    cos_y = math.hypot(math.cos(gamma), math.sin(gamma) * math.cos(half))
    h1, h2 = a * cos_y, b * math.cos(gamma) / cos_y
    # the roots of the docstring's formulas, taken by hand so that nothing cancels
    along_y = a * math.sin(gamma) * math.sin(half)
    s = b * math.sin(gamma) * math.cos(half) / cos_y
    return _grid("eggbox", cells, lambda i, j: [s * i, along_y * j, h1 * (j % 2) + h2 * (i % 2)])


def kresling(
    sides: int = 6,
    radius: float = 1.0,
    height: float = 0.9,
    twist: float = 30.0,
    storeys: int = 1,
) -> Pattern:
    r"""Kresling tower of `storeys` twisted storeys, open at both ends.

    Vertex m of ring r is number r sides + m, rings from the bottom up, at the angle
    m 360/sides + r twist (counter-clockwise seen from above, from the x axis) and the height
    r height. Panel m between two rings is cut by the diagonal from bottom m to top m+1 into
    two triangles: (bottom m, bottom m+1, top m+1) and (bottom m, top m+1, top m). The front is
    the outside.

    A positive `twist` turns the upper ring counter-clockwise seen from above, that is, to the
    right for someone looking at the tower from outside::

           twist < 0              twist = 0              twist > 0

        m ______ m+1           m ______ m+1              m ______ m+1     top
          \     |\              |    .'|                 /    _.-/
           \    | \             |  .'  |                /  _.'  /
            \   |  \            |.'    |               / .'    /
             \__|___\           |______|              /.'_____/
             m      m+1        m        m+1          m        m+1         bottom

    A positive twist makes the diagonals longer than the other slanted edges (bottom m to top m):
    the diagonals are then valleys and the others mountains. At 0 each pair of triangles is a flat
    rectangle. Between 0 and -360/sides all slanted edges are mountains (an antiprism at
    -180/sides), and below -360/sides the two families change their roles.

    Parameters
    ----------
    sides : int
        Corners of a ring, at least 3.
    radius : float
        Circumradius of the rings (m).
    height : float
        Height of a storey (m).
    twist : float
        Turn of each ring against the one below (degrees, between -180 and 180 - 360/sides; at
        these limits all slanted edges of a family meet on the axis).
    storeys : int
        Number of storeys, at least 1.

    Returns
    -------
    Pattern
        (storeys + 1) sides vertices and 2 storeys sides faces.

    Raises
    ------
    InputError
        An argument of the wrong type or out of range.
    """
    with within("kresling: "):
        sides, storeys = whole("sides", sides, least=3), whole("storeys", storeys, least=1)
        _check_size(f"sides = {sides}, storeys = {storeys}", (storeys + 1) * sides)
        radius, height = length("radius", radius), length("height", height)
        remedy = f": beyond, the panels of a tower with {sides} sides pass through its axis"
        twist = _angle("twist", twist, -180.0, 180.0 - 360.0 / sides, remedy)
    ring, corner = np.divmod(np.arange((storeys + 1) * sides), sides)
    angle = np.radians(corner * (360.0 / sides) + ring * twist)
    vertices = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height * ring])
    faces: list[tuple[int, int, int]] = []
    for r in range(storeys):
        for m in range(sides):
            bottom, bottom_next = r * sides + m, r * sides + (m + 1) % sides
            top, top_next = bottom + sides, bottom_next + sides
            faces += [(bottom, bottom_next, top_next), (bottom, top_next, top)]
    return Pattern(vertices, faces, name="kresling")


def _angle(name: str, value: Any, low: float, high: float, remedy: str) -> float:
    """Return an angle (degrees) strictly between `low` and `high`; messages end with `remedy`."""
    angle = number(name, value, unit="degrees")
    if not low < angle < high:
        raise InputError(f" = {value}: must be between {low:g} and {high:g} degrees{remedy}.", name)
    return angle


def _fold_dihedral(value: Any, *, flat_allowed: bool) -> float:
    """Return the smaller angle of a fold (degrees), between 0 and 180, 180 only if allowed."""
    if flat_allowed and isinstance(value, Real) and value == 180:
        return 180.0
    remedy = (
        ", or 180 (flat)" if flat_allowed else " (at both of which the sheet closes to a line)"
    ) + "; it is the smaller angle of the fold, for valleys and mountains alike"
    return _angle("dihedral", value, 0.0, 180.0, remedy)


def _check_size(fields: str, vertices: int) -> None:
    """Refuse a pattern that memory cannot hold, before it is made.

    fields : names and values of the arguments that make it large.
    """
    size = f"a pattern of {vertices:.3g} vertices"
    check_memory(fields, size, PER_VERTEX * vertices, "take fewer")


def _grid_arguments(
    cells: Any, a: Any, b: Any, panel_angle: Any
) -> tuple[tuple[int, int], float, float, float]:
    """Return the arguments of a sheet of parallelograms, the angle in radians."""
    try:
        if isinstance(cells, (str, bytes)):
            raise TypeError
        along_x, along_y = cells
    except (TypeError, ValueError):
        raise InputError(
            f" = {show(cells)}: must be two integers, the unit cells along x and y.", "cells"
        ) from None
    nx, ny = whole("cells[0]", along_x, least=1), whole("cells[1]", along_y, least=1)
    _check_size(f"cells = {show([nx, ny])}", (2 * nx + 1) * (2 * ny + 1))
    a, b = length("a", a), length("b", b)
    remedy = "; it is the acute corner of the panel, so give 180 minus an obtuse one"
    return (nx, ny), a, b, math.radians(_angle("panel_angle", panel_angle, 0.0, 90.0, remedy))


def _grid(
    name: str, cells: tuple[int, int], place: Callable[[NDArray, NDArray], list[NDArray]]
) -> Pattern:
    """Sheet of 2 x 2 quadrilaterals in each unit cell, front to +z, panels along x first.

    Vertex (i, j) is number i (2 cells[1] + 1) + j; `place` gives the three coordinates of all.
    """
    rows, columns = 2 * cells[0], 2 * cells[1]
    i, j = np.meshgrid(np.arange(rows + 1), np.arange(columns + 1), indexing="ij")
    step = columns + 1
    faces = [
        (m * step + n, (m + 1) * step + n, (m + 1) * step + n + 1, m * step + n + 1)
        for n in range(columns)
        for m in range(rows)
    ]
    return Pattern(np.stack(place(i, j), axis=-1).reshape(-1, 3), faces, name=name)
