"""The Kresling tower."""

from __future__ import annotations

import numpy as np

from foldyn.errors import within
from foldyn.patterns.generators.arguments import angle_between, check_size
from foldyn.patterns.generators.assembly import assembled
from foldyn.patterns.pattern import Pattern
from foldyn.values import flag, length, whole


def kresling(
    sides: int = 6,
    radius: float = 1.0,
    *,
    height: float = 0.9,
    twist: float = 30.0,
    storeys: int = 1,
    alternating: bool = False,
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
    -180/sides, and a Yoshimura cylinder is a tower of these), and below -360/sides the two
    families change their roles.

    With `alternating` every second storey is the mirror image of the storey below: it turns back
    by the twist, and its panels are cut by the diagonal from bottom m+1 to top m. When the tower is
    compressed, neighboring storeys turn in opposite directions, and its ends need not turn.

    Parameters
    ----------
    sides : int
        Corners of a ring, at least 3.
    radius : float
        Circumradius of the rings (m).
    height : float
        Height of a storey (m).
    twist : float
        Turn of each ring relative to the ring below (degrees, between -180 and 180 - 360/sides;
        at these limits all slanted edges of a family meet on the axis).
    storeys : int
        Number of storeys, at least 1.
    alternating : bool
        Whether every second storey is a mirror image.

    Returns
    -------
    Pattern
        (storeys + 1) sides vertices and 2 storeys sides faces. Families: "diagonal" and "side"
        are the slanted edges, "ring" the edges between storeys.

    Raises
    ------
    InputError
        An argument of the wrong type or out of range.

    Notes
    -----
    B. Kresling, Natural twist buckling in shells, IASS-IACM, 2008; storeys of both hands:
    N. Kidambi, K. W. Wang, Dynamics of Kresling origami deployment, Phys. Rev. E 101, 2020.
    """
    with within("kresling: "):
        sides, storeys = whole("sides", sides, least=3), whole("storeys", storeys, least=1)
        check_size(f"sides = {sides}, storeys = {storeys}", (storeys + 1) * sides)
        radius, height = length("radius", radius), length("height", height)
        remedy = f": beyond, the panels of a tower with {sides} sides pass through its axis"
        twist = angle_between("twist", twist, -180.0, 180.0 - 360.0 / sides, remedy)
        alternating = flag("alternating", alternating)
    ring, corner = np.divmod(np.arange((storeys + 1) * sides), sides)
    turns = ring % 2 if alternating else ring
    angle = np.radians(corner * (360.0 / sides) + turns * twist)
    vertices = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height * ring])
    faces: list[tuple[int, int, int]] = []
    families: dict[str, list[tuple[int, int]]] = {"diagonal": [], "side": [], "ring": []}
    for r in range(storeys):
        mirrored = alternating and r % 2
        for m in range(sides):
            bottom, bottom_next = r * sides + m, r * sides + (m + 1) % sides
            top, top_next = bottom + sides, bottom_next + sides
            low, high = (bottom_next, top) if mirrored else (bottom, top_next)
            faces += [(bottom, bottom_next, high), (low, top_next, top)]
            families["diagonal"].append((low, high))
            families["side"].append((bottom, top))
            families["ring"].append((bottom, bottom_next))
    upward = [(m, storeys * sides + m) for m in range(sides)]
    periods = [] if alternating and storeys % 2 else [upward]
    return assembled("kresling", vertices, faces, families, periods=periods)
