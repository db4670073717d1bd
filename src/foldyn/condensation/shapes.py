"""Shapes of the edges of a superelement, and how many of them each level has.

At the place q = 0 ... 1 of an edge, displacements are linear between its ends plus

    (1 - z^2) P_k(z),    z = 2 q - 1,   or   z = z(q), log-stretched near the ends,

with P_k the Legendre polynomials. Stretched shapes resolve forces in the plane, which concentrate
at vertices; plain shapes resolve bending. Displacements across the edge have both kinds,
displacements along it only stretched ones. The turn of the sheet about an edge is a sum of
P_k(2 q - 1).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

STRETCHED, PLAIN = True, False
ALONG = tuple((STRETCHED, k) for k in range(9))
"""Shapes of displacements along an edge; a level has the first of them."""
ACROSS = (
    (STRETCHED, 0), (STRETCHED, 1), (PLAIN, 0), (PLAIN, 1), (STRETCHED, 2), (STRETCHED, 3),
    (PLAIN, 2), (PLAIN, 3), (STRETCHED, 4), (STRETCHED, 5), (STRETCHED, 6), (PLAIN, 4),
    (STRETCHED, 7), (PLAIN, 5), (STRETCHED, 8), (PLAIN, 6), (STRETCHED, 9), (PLAIN, 7),
)  # fmt: skip
"""Shapes of displacements across an edge, in the plane of the panel and normal to it."""


class Level(NamedTuple):
    """Numbers of shapes of a superelement."""

    along: int  # displacements along each edge
    across: int  # displacements in each of the two directions across it
    turns: int  # turns of the sheet about each edge
    inner: int  # vibrations of the panel with its edges held

    @property
    def on_edge(self) -> tuple[int, int, int]:
        """Numbers of shapes of an edge in its three directions."""
        return self.along, self.across, self.across


LEVELS = (
    Level(2, 4, 3, 1), Level(4, 6, 5, 2), Level(4, 8, 6, 3), Level(6, 8, 8, 3), Level(6, 10, 10, 6)
)  # fmt: skip
"""Levels 1 to 5; each contains the lower ones."""
HIGHEST = LEVELS[-1]
FOR_STRESSES = Level(9, 18, 16, 6)
"""Shapes with which stresses near corners converge, and the stiffness of thin repeated sheets."""
FOR_BUCKLING = HIGHEST._replace(turns=FOR_STRESSES.turns)
"""Shapes for load factors: panels bend sharply at creases that bulge near vertices."""
SHAPES = (ALONG, ACROSS, ACROSS)


def bows(
    place: NDArray, cut_off: NDArray | float, axis: int, count: int | None = None
) -> NDArray[np.float64]:
    """Shapes (p, s) of the displacements in a direction at places (p,) of an edge.

    Parameters
    ----------
    place : (p,)
        From 0 to 1.
    cut_off : float or (p,)
        Distance from the ends, relative to the length of the edge, below which places are not
        stretched; of one edge, or of an edge for each place.
    axis : {0, 1, 2}
        0 is along the edge.
    count : int, optional
        Number s of the shapes; all by default.
    """
    plain, far = 2.0 * place - 1.0, np.log1p(1.0 / cut_off)
    stretched = (np.log1p(place / cut_off) - np.log1p((1.0 - place) / cut_off)) / far
    columns = []
    for kind, degree in SHAPES[axis][:count]:
        z = stretched if kind == STRETCHED else plain
        columns.append((1.0 - z * z) * legendre.legval(z, np.eye(degree + 1)[degree]))
    return np.stack(columns, axis=1)


def turns(place: NDArray, count: int) -> NDArray[np.float64]:
    """Shapes (p, count) of the turn of the sheet at places (p,) of an edge."""
    return np.array(legendre.legvander(2.0 * place - 1.0, count - 1), float)
