"""T-junctions: panel vertices inside an edge of a neighboring panel become its corners.

Programs that list polygons leave such edges undivided, so the panels on both sides share no edge.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from foldyn.formats.lines import MOST_PAIRS
from foldyn.formats.panels import Panels
from foldyn.patterns.topology import around, edge_of

ON_EDGE = 1e-5
"""Distance of a vertex from an edge that it lies on, relative to the size: digits of a file."""
UPON = 1e-2
"""Angle (rad) below which panels coincide: digits of a file too."""


def with_corners_on_edges(
    panels: Panels,
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    share: float = ON_EDGE,
) -> tuple[Panels, int]:
    """Add neighbors' vertices on panel edges as corners; also return how many were added.

    A boundary edge is divided at the ends of another panel's boundary edge that runs along its
    other side. Edges that the file calls boundary or cut are not divided, nor edges at which more
    than two panels would then meet. Nothing is done if too many vertices are near the edges.

    Parameters
    ----------
    panels : Panels
        With winding consistent with their normals.
    points : ndarray, shape (n, 3)
        Coordinates, also for flat panels.
    normals : ndarray, shape (m, 3)
        Unit normals of the panels.
    share : float
        Largest distance of a vertex from an edge that it lies on, relative to the size.
    """
    sides = panels.sides()
    rim = [
        (a, b, number)
        for number, face in enumerate(panels.faces)
        for a, b in around(face)
        if len(sides[edge_of(a, b)]) == 1 and panels.letters.get(edge_of(a, b)) not in ("B", "C")
    ]
    taken = Counter({edge: len(at) for edge, at in sides.items()})
    inside: dict[tuple[int, int], list[int]] = {}
    for a, b, panel, found in _divided(rim, points, normals, share):
        pieces = [edge_of(*piece) for piece in pairwise([a, *found, b])]
        own = set(found) & set(panels.faces[panel])
        if not own and all(taken[piece] < 2 for piece in pieces):
            taken.update(pieces)
            inside[a, b] = found
    faces = tuple(
        tuple(v for a, b in around(face) for v in (a, *inside.get((a, b), ())))
        for face in panels.faces
    )
    letters, angles = dict(panels.letters), dict(panels.angles)
    for (a, b), found in inside.items():
        letter, angle = letters.pop(edge_of(a, b), ""), angles.pop(edge_of(a, b), np.nan)
        for piece in pairwise([a, *found, b]):
            if letter and edge_of(*piece) not in letters:
                letters[edge_of(*piece)], angles[edge_of(*piece)] = letter, angle
    divided = replace(panels, faces=faces, letters=letters, angles=angles)
    return divided, sum(map(len, inside.values()))


def _divided(
    rim: list[tuple[int, int, int]], points: NDArray, normals: NDArray, share: float
) -> Iterator[tuple[int, int, int, list[int]]]:
    """Boundary edges (start, end, panel) with the points that divide them, in order."""
    rows = np.array(rim, dtype=np.int64).reshape(-1, 3)
    tolerance = share * float(np.linalg.norm(np.ptp(points, axis=0)))
    lengths = np.linalg.norm(points[rows[:, 1]] - points[rows[:, 0]], axis=1)
    rows, lengths = rows[lengths > tolerance], lengths[lengths > tolerance]
    if not len(rows):
        return
    ends, panel = rows[:, :2], rows[:, 2]
    along = (points[ends[:, 1]] - points[ends[:, 0]]) / lengths[:, None]
    inward = np.cross(normals[panel], along)
    at: dict[int, list[int]] = {}
    for k, end in np.ndenumerate(ends):
        at.setdefault(int(end), []).append(k[0])
    corners = np.array(sorted(at))
    tree, middles = cKDTree(points[corners]), points[ends].mean(axis=1)
    if tree.query_ball_point(middles, 0.5 * lengths, return_length=True).sum() > MOST_PAIRS:
        return

    def place(k: int, point: NDArray) -> tuple[NDArray, NDArray]:
        """Coordinates of points along an edge, and their distances from its line."""
        to = point - points[ends[k, 0]]
        far = to @ along[k]
        return far, np.linalg.norm(to - far[..., None] * along[k], axis=-1)

    def beside(k: int, other: int) -> bool:
        """Whether an edge runs along another, with its panel on the other side."""
        apart = np.linalg.norm(inward[k] - inward[other]) > UPON
        return panel[k] != panel[other] and bool(
            apart and (place(k, points[ends[other]])[1] < tolerance).all()
        )

    for k, near in enumerate(tree.query_ball_point(middles, 0.5 * lengths)):
        far, off = place(k, points[corners[near]])
        within = (off < tolerance) & (far > tolerance) & (far < lengths[k] - tolerance)
        order = np.flatnonzero(within)[np.argsort(far[within], kind="stable")]
        found: list[int] = []
        last = 0.0
        for corner, reached in zip(corners[near][order].tolist(), far[order].tolist(), strict=True):
            if reached > last + tolerance and any(beside(k, other) for other in at[corner]):
                found.append(corner)
                last = reached
        if found:
            yield int(ends[k, 0]), int(ends[k, 1]), int(panel[k]), found
