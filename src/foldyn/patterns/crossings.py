"""Panels that pass through each other.

Two triangles cross where a side of one pierces the other. Touching is no crossing: a corner or a
side that they share, or layers that lie upon each other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

INSIDE = 1e-6  # of a side, and of a triangle: how far within both a crossing lies
BLOCK = 1000  # triangles that are compared with all others at once


def crossing_panels(points: NDArray, triangles: NDArray, panels: NDArray) -> NDArray[np.int64]:
    """Pairs of panels (k, 2), the lower first, that cross each other.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Coordinates (m).
    triangles : ndarray of int, shape (m, 3)
        Triangles into which panels are cut.
    panels : ndarray of int, shape (m,)
        The panel of each. Triangles of one panel are not compared.
    """
    first, second = _near(points[triangles], panels)
    shared = (triangles[first][:, :, None] == triangles[second][:, None, :]).sum(axis=(1, 2))
    apart = shared < 2  # panels at a crease touch along it
    first, second = first[apart], second[apart]
    one, other = points[triangles[first]], points[triangles[second]]
    crossed = _pierces(one, other) | _pierces(other, one)
    pairs = np.sort(np.stack([panels[first], panels[second]], axis=1)[crossed], axis=1)
    return np.unique(pairs, axis=0)


def _near(corners: NDArray, panels: NDArray) -> tuple[NDArray, NDArray]:
    """Numbers of triangles (k,), (k,) of different panels whose bounding boxes meet."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    found = []
    for start in range(0, len(corners), BLOCK):
        rows = slice(start, start + BLOCK)
        meet = panels[rows, None] < panels[None, :]
        for axis in range(3):
            meet &= low[rows, None, axis] <= high[None, :, axis]
            meet &= low[None, :, axis] <= high[rows, None, axis]
        one, other = np.nonzero(meet)
        found.append((one + start, other))
    return np.concatenate([a for a, _ in found]), np.concatenate([b for _, b in found])


def _pierces(one: NDArray, other: NDArray) -> NDArray[np.bool_]:
    """Whether a side of triangles `one` (k, 3, 3) passes through the inside of `other`."""
    base, e1, e2 = other[:, 0], other[:, 1] - other[:, 0], other[:, 2] - other[:, 0]
    normal = np.cross(e1, e2)
    size = np.linalg.norm(normal, axis=1)
    height = np.einsum("kci,ki->kc", one - base[:, None], normal)
    result = np.zeros(len(one), bool)
    for a in range(3):
        b = (a + 1) % 3
        drop = height[:, a] - height[:, b]
        steep = np.abs(drop) > INSIDE * size**1.5  # otherwise it lies in the plane
        along = height[:, a] / np.where(steep, drop, 1.0)
        hit = one[:, a] + along[:, None] * (one[:, b] - one[:, a]) - base
        u = np.einsum("ki,ki->k", np.cross(hit, e2), normal) / size**2
        v = np.einsum("ki,ki->k", np.cross(e1, hit), normal) / size**2
        within = (along > INSIDE) & (along < 1.0 - INSIDE)
        result |= steep & within & (u > INSIDE) & (v > INSIDE) & (u + v < 1.0 - INSIDE)
    return result
