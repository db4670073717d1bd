"""A flat pattern folded panel by panel."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from foldyn.patterns.topology import Edge, around, edge_of


def folded(
    flat: NDArray[np.float64], faces: Sequence[Sequence[int]], angles: Mapping[Edge, float]
) -> NDArray[np.float64]:
    """Positions of the vertices when each crease is folded by its angle.

    The first panel stays fixed; each other panel follows the neighbor nearest to the first. The
    angles must close the panels around every vertex.

    Parameters
    ----------
    flat : ndarray, shape (n, 2)
        Coordinates (m).
    faces : sequence of sequences of int
        Connected, counter-clockwise.
    angles : mapping from (low, high)
        Fold angles (rad), valleys positive.

    Returns
    -------
    ndarray, shape (n, 3)
    """
    points = np.column_stack([flat, np.zeros(len(flat))])
    beside: dict[Edge, list[tuple[int, Edge]]] = {}
    for number, face in enumerate(faces):
        for a, b in around(face):
            beside.setdefault(edge_of(a, b), []).append((number, (a, b)))
    places = np.full(points.shape, np.nan)
    turns: dict[int, tuple[NDArray, NDArray]] = {0: (np.eye(3), np.zeros(3))}
    queue = deque([0])
    while queue:
        panel = queue.popleft()
        turn, shift = turns[panel]
        for vertex in faces[panel]:
            if np.isnan(places[vertex, 0]):
                places[vertex] = turn @ points[vertex] + shift
        for a, b in around(faces[panel]):
            for other, _ in beside[edge_of(a, b)]:
                if other not in turns:
                    own = _about(points[b] - points[a], -angles[edge_of(a, b)])
                    turns[other] = turn @ own, turn @ (points[a] - own @ points[a]) + shift
                    queue.append(other)
    return places


def _about(axis: NDArray, angle: float) -> NDArray[np.float64]:
    """Rotation matrix about an axis, counter-clockwise looking against it (rad)."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
