"""Which parts of a sheet's edges the panels in front of them hide."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray

from foldyn.plots.scene import Indices, Points, View

SAMPLES = 24  # pieces per edge: the ends of hidden parts are found to about 1/24 of the edge
_CHUNK = 10_000  # points tested at once


def hidden_points(
    points: Points, vertices: Points, triangles: Indices, view: View, size: float
) -> NDArray[np.bool_]:
    """Which points (p, 3) lie behind a triangle as seen along the view.

    A point within a thousandth of `size` (m) of a triangle is not behind it, as edges lie in their
    own panels.
    """
    seen = vertices @ view.basis.T
    a, b, c = (seen[triangles[:, k]] for k in range(3))
    u, v = b - a, c - a
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    drawn = np.abs(area) > 1e-9 * size**2  # a triangle seen edge-on hides nothing
    a, u, v, area = a[drawn], u[drawn], v[drawn], area[drawn]
    eyes = points @ view.basis.T
    hidden = np.zeros(len(points), dtype=bool)
    for point, triangle in _near_pairs(eyes[:, :2], (a + np.stack([0 * u, u, v]))[..., :2]):
        d = eyes[point] - a[triangle]
        e, g = u[triangle], v[triangle]
        s = (d[:, 0] * g[:, 1] - d[:, 1] * g[:, 0]) / area[triangle]
        t = (e[:, 0] * d[:, 1] - e[:, 1] * d[:, 0]) / area[triangle]
        inside = (s > 1e-9) & (t > 1e-9) & (s + t < 1.0 - 1e-9)
        before = s * e[:, 2] + t * g[:, 2] - d[:, 2] > 1e-3 * size
        hidden[point[inside & before]] = True
    return hidden


def _near_pairs(points: Points, corners: Points) -> Iterator[tuple[Indices, Indices]]:
    """Yield all pairs of points (p, 2) and triangles (3, t, 2) that may overlap, in batches."""
    tree = shapely.STRtree(shapely.box(*corners.min(axis=0).T, *corners.max(axis=0).T))
    for start in range(0, len(points), _CHUNK):
        point, triangle = tree.query(shapely.points(points[start : start + _CHUNK]))
        yield start + point, triangle


def split_edges(
    edges: Indices, vertices: Points, triangles: Indices, view: View, size: float
) -> tuple[Points, Points]:
    """Split edges (k, p), which are polylines through nodes, into visible and hidden parts.

    Returns
    -------
    visible, hidden : ndarray, shape (m, q, 3)
        Neighboring pieces of an edge with equal visibility are joined. All parts have as many
        points as the longest: shorter ones stay at their last point.
    """
    if len(edges) == 0:
        return np.zeros((0, 2, 3)), np.zeros((0, 2, 3))
    lines = vertices[edges]
    each = max(2, SAMPLES // (edges.shape[1] - 1))  # samples between nodes
    middle = (np.arange(each) + 0.5)[:, None] / each
    points = lines[:, :-1, None] * (1.0 - middle) + lines[:, 1:, None] * middle
    behind = hidden_points(points.reshape(-1, 3), vertices, triangles, view, size)
    parts: tuple[list, list] = ([], [])
    for line, row in zip(lines, behind.reshape(len(edges), -1), strict=True):
        cuts = [0, *(np.flatnonzero(row[1:] != row[:-1]) + 1).tolist(), len(row)]
        for low, high in pairwise(cuts):
            inner = line[low // each + 1 : -(-high // each)]
            ends = [_point(line, cut / each) for cut in (low, high)]
            parts[int(row[low])].append(np.array([ends[0], *inner, ends[1]]))
    visible, hidden = (_together(part) for part in parts)
    return visible, hidden


def _point(line: Points, place: float) -> Points:
    """Point at a coordinate from 0 to p - 1 along a polyline (p, 3)."""
    k = min(int(place), len(line) - 2)
    return line[k] + (line[k + 1] - line[k]) * (place - k)


def _together(parts: list[Points]) -> Points:
    """Stack lines with different numbers of points in one array."""
    longest = max((len(part) for part in parts), default=2)
    same = [np.concatenate([part, part[-1:].repeat(longest - len(part), 0)]) for part in parts]
    return np.array(same).reshape(-1, longest, 3)
