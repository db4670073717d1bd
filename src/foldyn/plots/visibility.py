"""Which parts of a sheet's edges the panels in front of them hide."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from foldyn.plots.scene import Indices, Points, View

SAMPLES = 24  # pieces per edge: the ends of a hidden part are found to 1/24 of the edge, about
_CHUNK = 1_000_000  # point-triangle pairs tested at a time (about 100 MB)


def hidden_points(
    points: Points, vertices: Points, triangles: Indices, view: View, size: float
) -> NDArray[np.bool_]:
    """Tell which points (p, 3) lie behind a triangle as seen along the view.

    A point within a thousandth of `size` (m) of a triangle does not count as behind it: edges lie
    in their own panels.
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
    """Give all pairs of points (p, 2) and triangles (3, t, 2) that may overlap, some at a time.

    The screen is cut into about as many cells as there are triangles: only a triangle whose
    bounding box reaches into the cell of a point can hide it.
    """
    count = corners.shape[1]
    if not count or not len(points):
        return
    low, high = corners.min(axis=0), corners.max(axis=0)
    corner, across = low.min(axis=0), np.ptp(corners.reshape(-1, 2), axis=0)
    cells = max(1, round(np.sqrt(count)))
    scale = cells / np.where(across > 0.0, across, 1.0)

    def cell(places: Points) -> Indices:
        return np.clip(np.floor((places - corner) * scale), 0, cells - 1).astype(np.int64)

    first, last = cell(low), cell(high)
    width, height = (last - first + 1).T
    owner = np.repeat(np.arange(count), width * height)
    place = _ranks(width * height)
    row = first[owner, 0] + place % width[owner]
    column = first[owner, 1] + place // width[owner]
    order = np.argsort(row * cells + column, kind="stable")
    of_cell = owner[order]
    ends = np.cumsum(np.bincount(row * cells + column, minlength=cells**2))
    home = cell(points) @ np.array([cells, 1])
    many = np.diff(ends, prepend=0)[home]
    begin = ends[home] - many
    start = 0
    total = np.cumsum(many)
    while start < len(points):
        before = total[start - 1] if start else 0
        stop = max(start + 1, int(np.searchsorted(total, before + _CHUNK, side="right")))
        some = slice(start, stop)
        point = np.repeat(np.arange(start, stop), many[some])
        yield point, of_cell[begin[point] + _ranks(many[some])]
        start = stop


def _ranks(counts: Indices) -> Indices:
    """Return 0, 1, ..., count - 1 for each count, in a row."""
    return np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)


def split_edges(
    edges: Indices, vertices: Points, triangles: Indices, view: View, size: float
) -> tuple[Points, Points]:
    """Cut edges (k, p), each straight from node to node, into parts in sight and hidden ones.

    Returns
    -------
    visible, hidden : ndarray, shape (m, q, 3)
        Neighboring pieces of an edge with equal visibility are joined. All parts have as many
        points as the longest: shorter ones stay at their last point.
    """
    if len(edges) == 0:
        return np.zeros((0, 2, 3)), np.zeros((0, 2, 3))
    lines = vertices[edges]
    each = max(2, SAMPLES // (edges.shape[1] - 1))  # samples from node to node
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
    """Point at a place from 0 to p - 1 of a line (p, 3)."""
    k = min(int(place), len(line) - 2)
    return line[k] + (line[k + 1] - line[k]) * (place - k)


def _together(parts: list[Points]) -> Points:
    """Lines of different numbers of points in one array."""
    longest = max((len(part) for part in parts), default=2)
    same = [np.concatenate([part, part[-1:].repeat(longest - len(part), 0)]) for part in parts]
    return np.array(same).reshape(-1, longest, 3)
