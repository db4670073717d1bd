"""Gaps between boundary elements, which the flow in them must resolve."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.compiled import kernel
from foldyn.mechanics.contact.distances import point, vertex_distance

APART = 0.25  # least distance of panels without a common corner, relative to the element size
JOINED = 0.01  # the same for panels with a common corner, from which both grids diverge


class Gap(NamedTuple):
    """Place where a surface comes too close to itself."""

    one: int  # triangle
    other: int
    distance: float  # m
    size: float  # local element size, m


def narrow_gap(
    points: NDArray, triangles: NDArray, panel: NDArray, joined: sparse.csr_array
) -> Gap | None:
    """Find the gap between two panels that is farthest below its limit; None if all are above.

    Parameters
    ----------
    points : ndarray, shape (p, 3)
    triangles : ndarray of int, shape (t, 3)
    panel : ndarray of int, shape (t,)
    joined : sparse array, shape (panels, panels)
        Nonzero for panels that share a corner.
    """
    from scipy.spatial import cKDTree

    corners = points[triangles]
    centers = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centers[:, None], axis=2).max(axis=1)
    reach = (1.0 + APART) * float(radii.max())
    pairs = cKDTree(centers).query_pairs(reach, output_type="ndarray").astype(np.int64)
    pairs = pairs[panel[pairs[:, 0]] != panel[pairs[:, 1]]]
    near = np.linalg.norm(centers[pairs[:, 0]] - centers[pairs[:, 1]], axis=1)
    pairs = pairs[near <= (1.0 + APART) * radii[pairs].max(axis=1)]
    if not len(pairs):
        return None
    limits = np.where(joined[panel[pairs[:, 0]], panel[pairs[:, 1]]] != 0, JOINED, APART)
    twice = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.sqrt(np.linalg.norm(twice, axis=1))
    at, distance = _narrowest(points, triangles, centers, pairs, np.asarray(limits), sizes)
    if at < 0:
        return None
    one, other = pairs[at]
    return Gap(int(one), int(other), float(distance), float(sizes[pairs[at]].max()))


@kernel
def _narrowest(points, triangles, centers, pairs, limits, sizes):
    """Pair of triangles without common corner that is farthest below its limit, or -1."""
    worst, at, distance = 1.0, -1, 0.0
    for k in range(len(pairs)):
        for turn in range(2):
            i, j = pairs[k, turn], pairs[k, 1 - turn]
            shared = False
            for a in range(3):
                for b in range(3):
                    shared = shared or triangles[i, a] == triangles[j, b]
            if shared:
                continue
            a, b, c = triangles[j]
            pa, pb, pc = point(points, a), point(points, b), point(points, c)
            gap = vertex_distance(point(centers, i), pa, pb, pc)
            over = gap / (limits[k] * max(sizes[i], sizes[j]))
            if over < worst:
                worst, at, distance = over, k, gap
    return at, distance
