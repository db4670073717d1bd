"""The waterbomb tessellation, folded symmetrically."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import cast

from foldyn.errors import within
from foldyn.patterns.generators.arguments import cell_counts, check_turn, fold_dihedral, sizes
from foldyn.patterns.generators.assembly import assembled
from foldyn.patterns.pattern import Pattern
from foldyn.patterns.topology import Edge

LETTERS = {"diagonal": "V", "middle": "M", "side": "M", "row": "M"}


def waterbomb(
    cells: Sequence[int] = (4, 5), a: float = 1.0, *, b: float = 1.0, dihedral: float = 120.0
) -> Pattern:
    """Waterbomb tessellation: rows of waterbomb bases, each row shifted by half a base.

    A base is a rectangle with creases from its center to its corners (valleys) and to the middles
    of its lower and upper edge (mountains). The grid points on the edges of the rows come first in
    the numbering, row by row along y, `2 cells[0] + 1` in each at distances b/2 from x = 0 on; the
    centers follow, row by row. Odd rows begin and end with half a base.

    As it folds, the sheet rolls up to a cylinder about an axis along y, with the same shape in all
    rows. Let h = a/2, w = b/2, and z the distance along the axis from the center of a base to the
    midpoint of its upper edge (h when flat). A row has the length h + z along the axis. Half a base
    takes up the angle p, with sin^2(p/2) = z^2 (h - z)/((h + z) k) and k = w^2 - (h - z)^2. Grid
    points are R = sqrt(k)/(2 sin(p/2)) from the axis, centers R - sqrt(h^2 - z^2). The dihedral d
    satisfies cos(d/2) = sqrt((h - z)/(h + z)) (h + z + q z)/w with q = (w^2 - h^2 + z^2)/k, which
    is solved for z.

    Parameters
    ----------
    cells : sequence of two int
        Bases along x, and rows along y.
    a, b : float
        Lengths of a base along y and along x (m).
    dihedral : float
        Angle across the sides of bases, from row to row (degrees, at most 180, which is flat). It
        must be above 0 or, for b > a, above 2 arccos(a/b), at which the sheet is closed.

    Returns
    -------
    Pattern
        Front to +z in the middle, outside the cylinder. Families: "diagonal" (valleys);
        "middle", from centers to the middles of edges, "side", between the bases of a row, and
        "row", between rows (mountains).

    Raises
    ------
    InputError
        An argument of the wrong type or out of range; a sheet that rolls up by more than a full
        turn.

    Notes
    -----
    Other states with the same symmetry of the bases have rows of another shape (R. Imada,
    T. Tachi, Geometry and kinematics of cylindrical waterbomb tessellation, J. Mech. Robot. 14,
    2022: this is their cylinder solution). The sheet as such has many degrees of freedom:
    Y. Chen, H. Feng, J. Ma, R. Peng, Z. You, Symmetric waterbomb origami, Proc. R. Soc. A 472,
    2016.
    """
    with within("waterbomb: "):
        nx, ny = cell_counts(cells, 4)
        a, b = sizes(a, b)
        closed = 2.0 * math.degrees(math.acos(a / b)) if a < b else 0.0
        dihedral = fold_dihedral(dihedral, least=closed)
        height = a / 2 if dihedral == 180.0 else _height(math.radians(dihedral), a / 2, b / 2)
        bent, radius, depth = _rolled(height, a / 2, b / 2)
        check_turn("cells[0]", nx, 2.0 * math.degrees(bent), "bases")

    def place(column: int, y: float, inside: float) -> tuple[float, float, float]:
        """Position of a point in its column, at some depth inside the grid points' cylinder."""
        if bent == 0.0:
            return b / 2 * (column - nx), y, 0.0
        angle = bent * (column - nx)
        fall = 2.0 * radius * math.sin(angle / 2) ** 2
        return (radius - inside) * math.sin(angle), y, -fall - inside * math.cos(angle)

    row_length, rise = a / 2 + height, a / 2 - height
    line = 2 * nx + 1
    vertices = [
        place(k, row * row_length + rise * ((row + k) % 2), 0.0)
        for row in range(ny + 1)
        for k in range(line)
    ]
    faces: list[tuple[int, ...]] = []
    families: dict[str, list[Edge]] = {"diagonal": [], "middle": [], "side": [], "row": []}
    across = [(row * line, row * line + 2 * nx) for row in range(ny + 1)]
    upward = [(k, ny * line + k) for k in range(line)]
    for row in range(ny):
        low, high = row * line, (row + 1) * line
        for column in range(1 - row % 2, line, 2):
            center = len(vertices)
            vertices.append(place(column, row * row_length + a / 2, depth))
            families["middle"] += [(low + column, center), (high + column, center)]
            for side, order in ((column - 1, (1, 2, 0)), (column + 1, (0, 1, 2))):
                if not 0 <= side < line:
                    continue
                ring = (low + column, low + side, high + side, high + column)
                ring = ring if side > column else ring[::-1]
                faces += [(center, ring[k], ring[k + 1]) for k in order]
                families["diagonal"] += [(low + side, center), (high + side, center)]
                if side > column:
                    families["side"].append((low + side, high + side))
        if row % 2:  # its first and its last half base
            across.append((len(vertices) - nx - 1, len(vertices) - 1))
        if row:
            families["row"] += [(low + left, low + left + 1) for left in range(line - 1)]
    periods = [across] if ny % 2 else [across, upward]
    return assembled("waterbomb", vertices, faces, families, LETTERS, periods=periods)


def _height(dihedral: float, h: float, w: float) -> float:
    """Height (m) of a midpoint above the center along the axis, from sides' dihedral (rad)."""
    from scipy.optimize import brentq

    def short(z: float) -> float:
        q = (w * w - h * h + z * z) / (w * w - (h - z) ** 2) if z > 0.0 else 0.0
        return math.sqrt((h - z) / (h + z)) * (h + z + q * z) / w - math.cos(dihedral / 2)

    least = math.sqrt(max(h * h - w * w, 0.0))
    return float(cast(float, brentq(short, least, h, xtol=1e-15 * h, rtol=1e-15)))


def _rolled(z: float, h: float, w: float) -> tuple[float, float, float]:
    """Angle (rad) of half a base, radius (m) of the grid points, depth (m) of centers below it."""
    k = w * w - (h - z) ** 2
    half = z * math.sqrt((h - z) / ((h + z) * k))
    if half == 0.0:
        return 0.0, math.inf, 0.0
    return 2.0 * math.asin(half), math.sqrt(k) / (2.0 * half), math.sqrt(h * h - z * z)
