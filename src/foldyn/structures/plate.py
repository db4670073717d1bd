"""Stiffness of bends and folds that makes panels bend as thin plates: `calibration="plate"`.

With G = E t^3 / (12 (1 - nu^2)) and A the area of a panel:

spoke of a quad (N5B8)      (1 - nu) G A (1/Dp^2 + 1/Dq^2) s, whole spoke; Dp, Dq the diagonals,
                            s = (A/(W H))^e, W and H the means of opposite edges;
spoke of a larger polygon   4 (1 - nu) G A p / sum (h1^2 + h2^2), h1 and h2 the angles by which its
                            spokes turn in the two curvatures without mean, of size 1; p of
                            `POLYGON`, because a plate that only its corners bend is softer;
diagonal (N4B5)             2 (1 - nu) G A s / D^2, A the area of its two triangles;
fold of length Lf           1/kf' = 1/kf + sum over its two panels of c A/(G Lf^2), but for panels
                            that are rigid;
weld of length Lf           1/k = sum over its two panels of c A/(G Lf^2), a crease that does not
                            turn; in triangles c = 2/3, which is a third of their height: the sheet
                            between the middles of two panels.

All four spokes of a quad are alike. The twist of a parallelogram, with its corners at +w and -w in
turn, then has the stiffness 32 (1 - nu) G s/A, which without s is that of a plate whose edges stay
straight, and a panel gives way at its center to the moments of its creases about as a plate does,
which bends about its shorter diagonal. s stands for the edges of skew panels that do not stay
straight; c for what a crease's moment bends beside it. Both depend on which edges are free.
Derivation and errors: docs/fidelity.md.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from foldyn.patterns import Pattern
from foldyn.patterns.topology import around, edge_of
from foldyn.structures.mesh import Mesh, double_areas, lengths
from foldyn.structures.sheet import Sheet

COMPLIANCE, ALONE = 0.12, 0.19  # c of panels of more than three corners; of quads with one crease
TRIANGLE = (0.22, 0.6)  # c of triangles without a free edge, and with one or two
MIDDLE = 2.0 / 3.0  # c of triangles at a weld
POLYGON = (0.77, 0.87, 0.91, 0.93)  # p of regular polygons of 5, 6, 7 and more corners (the shell)
SKEW = (0.18, 0.5, 0.63, 0.84, 3.0)  # e with 0, 1, 2 (opposite), 3, 4 edges free
OBTUSE, ACUTE = 0.7, 1.2  # e with two creases that meet at an obtuse or at an acute corner


def bend_stiffness(mesh: Mesh, pattern: Pattern, sheet: Sheet) -> NDArray:
    """Stiffness of each whole bend (N m/rad), in the mesh's order."""
    bends = np.empty(len(mesh.inner))
    kinds, kind = sheet.kinds(len(pattern.faces))
    twists = np.array([(1.0 - own.poissons_ratio) * own.bending_modulus for own in kinds])[kind]
    first = np.searchsorted(mesh.inner_panel, np.arange(len(pattern.faces) + 1))
    free = _free_edges(pattern)
    for panel, face in enumerate(pattern.faces):
        rows, twist = slice(first[panel], first[panel + 1]), float(twists[panel])
        x = pattern.vertices[list(face)]
        skew = 1.0
        if len(x) == 4:
            skew = _skew(x, float(pattern.face_areas[panel]), _creased(face, free))
        if mesh.centers[panel] < 0:
            area = _wings(mesh.nodes, mesh.bends[rows])
            length = lengths(mesh.nodes, mesh.inner[rows])
            bends[rows] = 2.0 * twist * area * skew / length**2
        elif len(x) == 4:
            per_diagonal2 = 1.0 / ((x[:2] - x[2:]) ** 2).sum(axis=1)
            bends[rows] = twist * pattern.face_areas[panel] * per_diagonal2.sum() * skew
        else:
            turns = _twisted(x - mesh.nodes[mesh.centers[panel]])
            soft = POLYGON[min(len(x), 8) - 5]
            bends[rows] = 4.0 * twist * pattern.face_areas[panel] * soft / turns
    return bends


def fold_stiffness(
    crease: NDArray, pattern: Pattern, sheet: Sheet, rigid: str | Sequence[int] | None = None
) -> NDArray:
    """Stiffness of whole folds (nf,), N m/rad, from that of the creases alone.

    Each fold acts in series with the two panels that its moment bends; rigid ones do not.
    """
    share = _given_way(pattern, sheet)
    stiff = range(len(share)) if isinstance(rigid, str) else rigid or ()
    share[list(stiff)] = 0.0
    length = lengths(pattern.vertices, pattern.creases)
    return crease / (1.0 + crease * share[pattern.crease_faces].sum(axis=1) / length**2)


def _given_way(pattern: Pattern, sheet: Sheet) -> NDArray:
    """Turn c A/G (np,), m2/(N m), of panels at an edge of length 1 under a moment of 1."""
    free = _free_edges(pattern)
    share = np.array([_compliance(_creased(face, free)) for face in pattern.faces])
    return share * pattern.face_areas / _modulus(pattern, sheet)


def weld_stiffness(pattern: Pattern, sheet: Sheet) -> NDArray:
    """Stiffness of whole welds (nw,), N m/rad: that of the panels on both sides in series."""
    share = _given_way(pattern, sheet)
    flat = np.array([len(face) == 3 for face in pattern.faces])
    share[flat] = (MIDDLE * pattern.face_areas / _modulus(pattern, sheet))[flat]
    return lengths(pattern.vertices, pattern.welds) ** 2 / share[pattern.weld_faces].sum(axis=1)


def _modulus(pattern: Pattern, sheet: Sheet) -> NDArray:
    return sheet.values("bending_modulus", len(pattern.faces))


def _free_edges(pattern: Pattern) -> set[tuple[int, ...]]:
    return set(map(tuple, pattern.boundary.tolist()))


def _creased(face: tuple[int, ...], free: set[tuple[int, ...]]) -> list[bool]:
    """Whether each edge of a panel is a crease."""
    return [edge_of(a, b) not in free for a, b in around(face)]


def _compliance(creased: list[bool]) -> float:
    """Return c of a panel whose edges are creases or free."""
    if len(creased) == 3:
        return TRIANGLE[not all(creased)]
    return ALONE if len(creased) == 4 and sum(creased) == 1 else COMPLIANCE


def _skew(x: NDArray, area: float, creased: list[bool]) -> float:
    """Return s of a quadrilateral with the corners x (4, 3): 1 of a rectangle."""
    edge = np.roll(x, -1, axis=0) - x
    length = np.linalg.norm(edge, axis=1)
    means = 0.25 * (length[0] + length[2]) * (length[1] + length[3])
    between = [k for k in range(4) if creased[k] and creased[k - 1]]  # corners
    if sum(creased) == 2 and between:
        obtuse = edge[between[0]] @ edge[between[0] - 1] > 0.0
        power = OBTUSE if obtuse else ACUTE
    else:
        power = SKEW[4 - sum(creased)]
    return float((area / means) ** power)


def _wings(x: NDArray, bends: NDArray) -> NDArray:
    """Area (nh,) of the two triangles of each bend (axis j, k, wings i, l)."""
    left, right = double_areas(x, bends[:, [0, 1, 2]]), double_areas(x, bends[:, [1, 0, 3]])
    return 0.5 * (np.linalg.norm(left, axis=1) + np.linalg.norm(right, axis=1))


def _twisted(spokes: NDArray) -> float:
    """Sum of the squared turns (m^2) of spokes (m, 3) in the curvatures diag(1, -1) and off it."""
    _, _, axes = np.linalg.svd(spokes - spokes.mean(axis=0))
    x, y = (spokes @ axes[:2].T).T
    total = 0.0
    for height in (0.5 * (x**2 - y**2), x * y):
        tilt = _slopes(x, y, height)
        turn = tilt - np.roll(tilt, 1, axis=0)
        total += float((turn**2).sum())
    return total


def _slopes(x: NDArray, y: NDArray, height: NDArray) -> NDArray:
    """Gradient (m, 2) of the heights (m,) over each triangle (center, corner, next corner)."""
    after = [np.roll(value, -1) for value in (x, y, height)]
    cross = x * after[1] - y * after[0]
    along = (height * after[1] - after[2] * y) / cross
    across = (after[2] * x - height * after[0]) / cross
    return np.column_stack([along, across])
