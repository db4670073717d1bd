"""The simple fold: two rectangles."""

from __future__ import annotations

import math

import numpy as np

from foldyn.errors import within
from foldyn.patterns.generators.arguments import fold_dihedral, sizes
from foldyn.patterns.pattern import Pattern


def simple_fold(a: float = 1.0, b: float = 1.0, *, dihedral: float = 60.0) -> Pattern:
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
        6 vertices, 2 faces, 1 crease, the family "ridge".

    Raises
    ------
    InputError
        An argument of the wrong type or out of range.
    """
    with within("simple_fold: "):
        a, b = sizes(a, b)
        dihedral = fold_dihedral(dihedral)
    w = a * math.sin(math.radians(dihedral) / 2)
    h = a * math.cos(math.radians(dihedral) / 2) if dihedral < 180 else 0.0
    vertices = np.array([[x, y, z] for x, z in ((0, 0), (w, h), (2 * w, 0)) for y in (0, b)])
    faces = ((0, 2, 3, 1), (2, 4, 5, 3))
    families, periods = {"ridge": [(2, 3)]}, [[(0, 4), (1, 5)]]
    return Pattern(vertices, faces, "M", "simple fold", families=families, periods=periods)
