"""The Kresling pattern: a twisted tower of triangles."""

from __future__ import annotations

import numpy as np

from foldyn.patterns import arguments
from foldyn.patterns.pattern import Pattern


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

    A positive `twist` turns the upper ring counter-clockwise seen from above, that is to the
    right for someone who looks at the tower from outside::

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
    sides = arguments.count("kresling", "sides", sides, 3)
    storeys = arguments.count("kresling", "storeys", storeys, 1)
    fields = f"sides = {sides}, storeys = {storeys}"
    arguments.check_size("kresling", fields, (storeys + 1) * sides)
    radius = arguments.length("kresling", "radius", radius)
    height = arguments.length("kresling", "height", height)
    remedy = f": beyond, the panels of a tower with {sides} sides pass through its axis"
    highest = 180.0 - 360.0 / sides
    twist = arguments.number("kresling", "twist", twist, -180.0, highest, "degrees", remedy)
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
