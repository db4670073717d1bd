"""The waterbomb tessellation, folded symmetrically."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import within
from foldyn.patterns.generators.arguments import cell_counts, check_turn, fold_dihedral, sizes
from foldyn.patterns.generators.assembly import assembled
from foldyn.patterns.pattern import Pattern
from foldyn.patterns.topology import Edge

LETTERS = {"diagonal": "V", "row": "V", "middle": "M", "side": "M"}


def waterbomb(
    cells: Sequence[int] = (4, 5),
    a: float = 1.0,
    b: float = 1.0,
    dihedral: float = 60.0,
) -> Pattern:
    """Waterbomb tessellation: rows of waterbomb bases, each shifted by half a base to the last.

    A base is a rectangle with creases from its center to its corners (valleys) and to the middles
    of its lower and upper edge (mountains). The grid points on the edges of the rows, `2 cells[0] +
    1` a row from x = 0 at distances b/2, are numbered first, row by row along y, then the centers,
    row by row. Odd rows begin and end with half a base.

    Symmetric folding has one degree of freedom. The middle of the side of a base is at the
    distance X = b/2 sin(dihedral/2) along x from the center and at the height
    Z = b/2 cos(dihedral/2) above it; the creases to the middles of the edges rise by the angle r,
    tan(r/2) = 2 Z/a. Each row turns by 180 - 2 r degrees against the last, about x: the sheet
    is a tube where r < 90, lies in a plane where r = 90, and curves the other way beyond.

    Parameters
    ----------
    cells : sequence of two int
        Bases along x, and rows along y.
    a, b : float
        Lengths of a base along y and along x (m).
    dihedral : float
        Angle across the sides of bases, from row to row (degrees, above 0, 180 is flat). Close to
        flat the rows fold back upon each other: no symmetric motion leads from the flat sheet to
        the folded ones with all creases opening at once.

    Returns
    -------
    Pattern
        Front to +z in the first row. Families: "diagonal" and "row", the creases between rows
        (valleys); "middle", from centers to the middles of edges, and "side", between the bases
        of a row (mountains).

    Raises
    ------
    InputError
        An argument of the wrong type or out of range; a sheet that rolls up by more than a full
        turn.

    Notes
    -----
    Y. Chen, H. Feng, J. Ma, R. Peng, Z. You, Symmetric waterbomb origami, Proc. R. Soc. A 472,
    2016; R. Imada, T. Tachi, Geometry and kinematics of cylindrical waterbomb tessellation,
    J. Mech. Robot. 14, 2022.
    """
    with within("waterbomb: "):
        nx, ny = cell_counts(cells, 4)
        a, b = sizes(a, b)
        dihedral = fold_dihedral(dihedral)
        half = math.radians(dihedral) / 2
        if dihedral == 180.0:
            width, points, middles = b / 2, *_flat(ny, a)
        else:
            width = b / 2 * math.sin(half)
            depth = b / 2 * math.cos(half)
            rise = 2.0 * math.atan2(2.0 * depth, a)
            turn = 180.0 - 2.0 * math.degrees(rise)
            check_turn("cells[1]", ny, turn, ny, "rows")
            points, middles = _folded(ny, a, depth, rise)
    line = 2 * nx + 1
    vertices = [(width * k, *points[row, k % 2]) for row in range(ny + 1) for k in range(line)]
    faces: list[tuple[int, ...]] = []
    families: dict[str, list[Edge]] = {"diagonal": [], "middle": [], "side": [], "row": []}
    for row, middle in enumerate(middles):
        low, high = row * line, (row + 1) * line
        for column in range(1 - row % 2, line, 2):
            center = len(vertices)
            vertices.append((width * column, *middle))
            families["middle"] += [(low + column, center), (high + column, center)]
            if column > 0:
                left = column - 1
                faces += [
                    (center, high + left, low + left),
                    (center, low + left, low + column),
                    (center, high + column, high + left),
                ]
                families["diagonal"] += [(low + left, center), (high + left, center)]
            if column < line - 1:
                right = column + 1
                faces += [
                    (center, low + column, low + right),
                    (center, low + right, high + right),
                    (center, high + right, high + column),
                ]
                families["diagonal"] += [(low + right, center), (high + right, center)]
                families["side"].append((low + right, high + right))
        if row:
            families["row"] += [(low + left, low + left + 1) for left in range(line - 1)]
    return assembled("waterbomb", vertices, faces, families, LETTERS)


def _flat(rows: int, a: float) -> tuple[NDArray, NDArray]:
    """Places (y, z), m, of points by line and parity (rows + 1, 2, 2), and of centers (rows, 2)."""
    lines = a * np.arange(rows + 1)
    points = np.stack([lines, 0.0 * lines], axis=1)
    return np.stack([points, points], axis=1), np.stack([lines[:-1] + a / 2, 0.0 * lines[1:]], 1)


def _folded(rows: int, a: float, depth: float, rise: float) -> tuple[NDArray, NDArray]:
    """As `_flat`; a base's corners lie above its center by `depth`, its middles rise by `rise`."""
    corner, middle = a / 2 + 1j * depth, a / 2 * np.exp(1j * rise)  # upper; y + i z
    points = np.empty((rows + 1, 2), dtype=complex)
    centers = np.empty(rows, dtype=complex)
    place, turn = a / 2 - 1j * depth, 1.0 + 0j  # of the row: its center, its direction
    for row in range(rows):
        own = [corner, middle] if row % 2 == 0 else [middle, corner]  # of even and odd columns
        lower = [-point.conjugate() for point in own]
        if row:  # where this row has middles the last one has corners
            turn = (points[row, 1] - points[row, 0]) / (lower[1] - lower[0])
            place = points[row, 0] - turn * lower[0]
        else:
            points[0] = [place + turn * point for point in lower]
        points[row + 1] = [place + turn * point for point in own]
        centers[row] = place
    return _planes(points), _planes(centers)


def _planes(points: NDArray) -> NDArray[np.float64]:
    return np.stack([points.real, points.imag], axis=-1)
