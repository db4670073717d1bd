"""Which parts of a sheet's edges the panels in front of them hide."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from foldyn.plots.scene import View

SAMPLES = 24  # pieces per edge: the ends of a hidden part are found to 1/24 of the edge
_CHUNK = 4_000_000  # point-triangle pairs tested at a time (about 100 MB)


def hidden_points(
    points: NDArray[np.float64],
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int64],
    view: View,
    size: float,
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
    step = max(1, _CHUNK // max(len(a), 1))
    for start in range(0, len(points), step):
        d = eyes[start : start + step, None, :] - a
        s = (d[..., 0] * v[:, 1] - d[..., 1] * v[:, 0]) / area
        t = (u[:, 0] * d[..., 1] - u[:, 1] * d[..., 0]) / area
        inside = (s > 1e-9) & (t > 1e-9) & (s + t < 1.0 - 1e-9)
        before = s * u[:, 2] + t * v[:, 2] - d[..., 2] > 1e-3 * size
        hidden[start : start + step] = (inside & before).any(axis=1)
    return hidden


def split_edges(
    edges: NDArray[np.int64],
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int64],
    view: View,
    size: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Cut edges (k, 2) into segments in sight and segments hidden by panels.

    Returns
    -------
    visible, hidden : ndarray, shape (m, 2, 3)
        Neighboring pieces of an edge with equal visibility are joined.
    """
    if len(edges) == 0:
        return np.zeros((0, 2, 3)), np.zeros((0, 2, 3))
    start, end = vertices[edges[:, 0]], vertices[edges[:, 1]]
    middle = (np.arange(SAMPLES) + 0.5)[:, None] / SAMPLES
    points = start[:, None] * (1.0 - middle) + end[:, None] * middle
    behind = hidden_points(points.reshape(-1, 3), vertices, triangles, view, size)
    parts: tuple[list, list] = ([], [])
    for p, q, row in zip(start, end, behind.reshape(-1, SAMPLES), strict=True):
        cuts = [0, *(np.flatnonzero(row[1:] != row[:-1]) + 1).tolist(), SAMPLES]
        for low, high in pairwise(cuts):
            ends = [p + (q - p) * (cut / SAMPLES) for cut in (low, high)]
            parts[int(row[low])].append(ends)
    visible, hidden = (np.array(part).reshape(-1, 2, 3) for part in parts)
    return visible, hidden
