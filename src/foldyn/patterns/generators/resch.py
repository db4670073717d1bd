"""Resch's triangular tessellation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import within
from foldyn.patterns.generators.arguments import cell_counts, check_turn, fold_dihedral
from foldyn.patterns.generators.assembly import assembled
from foldyn.patterns.pattern import Pattern
from foldyn.patterns.topology import Edge
from foldyn.values import length

# Distances of the middles of a star's sides and of its corners from its center, in sides a.
MIDDLE, TIP = 1.0 / math.sqrt(3.0), 2.0 / math.sqrt(3.0)
STEP = math.radians(10.0)  # step from one solution to the next
LETTERS = {"tile": "M", "tuck": "V", "star": "M"}
# Fold angles (rad) of the closed state.
CLOSED = {"tile": -math.pi / 2, "tuck": math.pi, "star": -math.pi / 3}


def resch(cells: Sequence[int] = (3, 3), a: float = 1.0, *, dihedral: float = 120.0) -> Pattern:
    """Resch's triangular tessellation: tiles that close up over tucked stars.

    The flat pattern has equilateral triangles of two sizes: tiles with sides a, and stars with
    sides 2 a between them. Creases from the center of a star to its corners (tucks) and to the
    midpoints of its sides cut it into six triangles. When the pattern is closed, the tiles cover
    the plane and hide the stars: the midpoints of a star's sides meet in one point, its center
    hangs a/sqrt(3) below this point, the tucks are closed, and the tiles stand at right angles to
    them.

    Between these two states the sheet rolls up to a cylinder about an axis along y, and flattens
    again: only at the two ends can all tiles be coplanar with correct lengths. All stars fold
    alike, and each is symmetric about a plane through the axis, which contains its tuck along y.
    With d the dihedral of this tuck, the midpoints of the adjacent sides are a/2 sin(d/2) from the
    plane. Three lengths then determine the inclination of the tuck, and the distance and angle
    between columns of stars; these are solved for, starting from the closed state.

    Parameters
    ----------
    cells : sequence of two int
        Columns of stars along x, and stars along y in each; every star comes with two tiles.
    a : float
        Side of a tile (m).
    dihedral : float
        Angle across the tucks along y (degrees): 180 is flat, 0 closed.

    Returns
    -------
    Pattern
        8 cells[0] cells[1] triangles, front to +z in the middle; the flat one has the angles to
        fold to. Families: "tile", the sides of tiles (mountains); "tuck", from the centers of stars
        to their corners (valleys); "star", from there to the middles of their sides (mountains).

    Raises
    ------
    InputError
        An argument of the wrong type or out of range; a sheet that rolls up by more than a full
        turn.

    Notes
    -----
    T. Tachi, Designing freeform origami tessellations by generalizing Resch's patterns,
    J. Mech. Des. 135, 2013. The sheet has many other degrees of freedom.
    """
    with within("resch: "):
        counts, a = cell_counts(cells, 7), length("a", a)
        closed = isinstance(dihedral, Real) and dihedral == 0
        star = Star.closed() if closed else Star.at(math.radians(fold_dihedral(dihedral)))
        check_turn("cells[0]", counts[0], math.degrees(star.turn), "columns of stars")
    found: dict[tuple[int, int, int], int] = {}
    vertices: list[tuple[float, ...]] = []

    def corner(m: int, n: int, k: int) -> int:
        """Vertex number of the middle of side k of star (m, n), or of its center for k = 3."""
        if (m, n, k) not in found:
            found[m, n, k] = len(vertices)
            vertices.append(tuple((a * star.place(m - (counts[0] - 1) / 2, n, k)).tolist()))
        return found[m, n, k]

    faces: list[tuple[int, ...]] = []
    families: dict[str, list[Edge]] = {"tile": [], "tuck": [], "star": []}
    for m in range(counts[0]):
        for n in range(-(m // 2), counts[1] - m // 2):  # keeps columns side by side
            center = corner(m, n, 3)
            middle = [corner(m, n, k) for k in range(3)]
            tips = [corner(m, n + 1, 2), corner(m - 1, n, 0), corner(m + 1, n - 1, 1)]
            for k in range(3):
                # around the star: middle, tip, next middle
                faces += [(center, middle[k], tips[k]), (center, tips[k], middle[k - 2])]
                families["tuck"].append((center, tips[k]))
                families["star"].append((center, middle[k]))
                families["tile"] += [(middle[k], tips[k]), (tips[k], middle[k - 2])]
            left, right = corner(m, n - 1, 1), corner(m, n - 1, 0)
            faces += [(tips[1], left, middle[2]), (middle[2], right, tips[2])]
            families["tile"] += [(left, middle[2]), (tips[1], left)]
            families["tile"] += [(right, middle[2]), (tips[2], right)]
    angles = CLOSED if dihedral == 180 else None
    steps = (counts[0], -(counts[0] // 2)), (0, counts[1])
    periods = []
    for i, j in steps:
        ahead = [(v, (m + i, n + j, k)) for (m, n, k), v in found.items()]
        periods.append([(v, found[place]) for v, place in ahead if place in found])
    return assembled("resch", vertices, faces, families, LETTERS, angles, periods=periods)


@dataclass(frozen=True)
class Star:
    """A star of tiles with sides 1, and the placement of its neighbors.

    Attributes
    ----------
    middles : ndarray, shape (4, 3)
        The middles of the sides at 30, 150 and 270 degrees, and the center, which is the origin.
    period : float
        Distance of stars along y.
    apart, turn : float
        Distance and angle (rad) of columns of stars.
    """

    middles: NDArray[np.float64]
    period: float
    apart: float
    turn: float

    @classmethod
    def of(cls, dihedral: float, incline: float, apart: float, turn: float) -> Star:
        """Make the star whose tuck along y has a dihedral (rad) and rises by an angle (rad)."""
        along = np.array([0.0, math.cos(incline), math.sin(incline)])
        front = np.array([0.0, -math.sin(incline), math.cos(incline)])
        side = MIDDLE / 2 * along + math.sin((math.pi - dihedral) / 2) / 2 * front
        across = np.array([math.sin(dihedral / 2) / 2, 0.0, 0.0])
        # the tip of the tuck is the middle of a side of the next star, at its height
        rise = TIP * along[2]
        last = np.array([0.0, -math.sqrt(max(MIDDLE**2 - rise**2, 0.0)), rise])
        middles = np.array([side + across, side - across, last, np.zeros(3)])
        return cls(middles, TIP * along[1] - last[1], apart, turn)

    @classmethod
    def closed(cls) -> Star:
        """All tucks closed."""
        middles = np.array([[0.0, 0.0, MIDDLE]] * 3 + [[0.0] * 3])
        return cls(middles, 1.0, math.sqrt(3.0) / 2, 0.0)

    @classmethod
    def at(cls, dihedral: float) -> Star:
        """Star whose tuck along y has the given dihedral (rad)."""
        from scipy.optimize import root

        if dihedral == math.pi:
            return cls.of(dihedral, 0.0, 1.5, 0.0)
        solution = np.array([math.pi / 6, math.sqrt(3.0) / 2, 0.0])
        steps = math.ceil(dihedral / STEP)
        for step in range(steps):
            here = dihedral * (step + 1) / steps
            solution = root(lambda x, d=here: cls.of(d, *x).gaps, solution, tol=1e-15).x
        return cls.of(dihedral, *solution)

    @property
    def gaps(self) -> NDArray[np.float64]:
        """Errors (3,) in the squared lengths from a tip in the next column."""
        side, _, last, center = self.middles
        tip = self.place(1, -1, 1)
        squares = [((tip - point) ** 2).sum() for point in (center, side, last)]
        return np.array(squares) - [TIP**2, 1.0, 1.0]

    def place(self, m: float, n: int, k: int) -> NDArray[np.float64]:
        """Position (3,) of middle k of star n in column m, or of its center for k = 3."""
        x, y, z = self.middles[k]
        c, s, half = math.cos(m * self.turn), math.sin(m * self.turn), self.turn / 2
        if half == 0.0:
            right, up = m * self.apart, 0.0
        else:  # angle of the column, about an axis at the depth apart/2 cot(half) below the centers
            radius = self.apart * math.cos(half) / (2.0 * math.sin(half))
            right, up = radius * s, -2.0 * radius * math.sin(m * half) ** 2
        return np.array([x * c + z * s + right, y + (m / 2 + n) * self.period, z * c - x * s + up])
