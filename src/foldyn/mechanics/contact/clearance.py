"""Clearance: least distance between panels without common vertex, and its location."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.compiled import inner, kernel
from foldyn.mechanics.contact.distances import (
    apart,
    between,
    closest_of_segments,
    closest_on_triangle,
    dot,
    point,
)
from foldyn.mechanics.crossings import crossing_panels

NEIGHBORS = 32  # number of nearest triangle centers for a first bound
TIE = 2e-9  # pairs of points tie if their squared distances differ by at most this share
MOST = 64  # largest number of tied pairs that are reported


class Clearance(NamedTuple):
    """Closest points of two panels; the distance is the norm of a weighted sum of four nodes.

    Attributes
    ----------
    distance : float
        m; 0 if panels cross, inf if every two panels share a vertex.
    nodes, weights : ndarray, shape (k, 4)
        The vector between both points is the weighted sum of the nodal positions, for each pair at
        this distance.
    """

    distance: float
    nodes: NDArray[np.int64]
    weights: NDArray[np.float64]


def clearance(points: NDArray, triangles: NDArray, panels: NDArray) -> Clearance:
    """Least distance between two panels that share no node.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Positions of all nodes (m).
    triangles : ndarray of int, shape (m, 3)
        Triangles into which panels are cut.
    panels : ndarray of int, shape (m,)
        The panel of each triangle.
    """
    x = np.ascontiguousarray(points, float)
    rows, owners = np.asarray(triangles, np.int64), np.asarray(panels, np.int64)
    members = sparse.csr_array((np.ones(rows.size), (np.repeat(owners, 3), rows.ravel())))
    meet = (members @ members.T).tocsr()
    nodes, weights = np.zeros((MOST, 4), np.int64), np.zeros((MOST, 4))
    pairs = _near(x[rows], owners, meet)
    crossing = crossing_panels(x, rows, owners)
    if len(crossing) and (_entries(meet, *crossing.T) == 0.0).any():
        return Clearance(0.0, nodes[:0], weights[:0])
    best, count = _closest(x, rows, pairs, nodes, weights)
    return Clearance(float(best), nodes[:count], weights[:count])


def _near(corners: NDArray, panels: NDArray, meet: sparse.csr_array) -> NDArray[np.int64]:
    """Triangle pairs (k, 2) of panels that do not meet, including the closest ones."""
    from scipy.spatial import cKDTree

    center = corners.mean(axis=1)
    radius = float(np.linalg.norm(corners - center[:, None], axis=2).max())
    tree = cKDTree(center)
    far, beside = tree.query(center, min(NEIGHBORS, len(center)))
    far, beside = far.reshape(len(center), -1), beside.reshape(len(center), -1)
    free = _entries(meet, np.repeat(panels, far.shape[1]), panels[beside].ravel()) == 0.0
    bound = np.min(far.ravel(), where=free, initial=np.inf)
    reach = bound + 2.0 * radius if np.isfinite(bound) else np.inf
    pairs = tree.query_pairs(reach, output_type="ndarray").astype(np.int64)
    return pairs[_entries(meet, *panels[pairs].T) == 0.0]


def _entries(matrix: sparse.csr_array, rows: NDArray, columns: NDArray) -> NDArray:
    return np.asarray(matrix[rows, columns]).ravel()


@kernel
def _closest(x, triangles, pairs, nodes, weights):
    """Least distance of some pairs of triangles, and how many pairs of points have it.

    Writes the nodes and weights of these pairs to the last two arguments, in any order.
    """
    best, count = np.inf, 0
    for k in range(len(pairs)):
        for turn in range(2):
            i, j = pairs[k, turn], pairs[k, 1 - turn]
            a, b, c = triangles[j]
            pa, pb, pc = point(x, a), point(x, b), point(x, c)
            for corner in range(3):
                v = triangles[i, corner]
                p = point(x, v)
                wa, wb, wc, _ = closest_on_triangle(p, pa, pb, pc)
                r = apart(p, pa, pb, pc, wa, wb, wc)
                found = (v, a, b, c), (1.0, -wa, -wb, -wc)
                best, count = _kept(dot(r, r), found, best, count, nodes, weights)
        for one in range(3):
            a, b = triangles[pairs[k, 0], one], triangles[pairs[k, 0], (one + 1) % 3]
            pa, pb = point(x, a), point(x, b)
            for other in range(3):
                c, d = triangles[pairs[k, 1], other], triangles[pairs[k, 1], (other + 1) % 3]
                pc, pd = point(x, c), point(x, d)
                s, t, _ = closest_of_segments(pa, pb, pc, pd)
                r = between(pa, pb, pc, pd, s, t)
                found = (a, b, c, d), (1.0 - s, s, t - 1.0, -t)
                best, count = _kept(dot(r, r), found, best, count, nodes, weights)
    return np.sqrt(best), count


@inner
def _kept(square, found, best, count, nodes, weights):
    """Record a pair of points if it ties with the closest pairs; a closer pair replaces them.

    Returns the square of the least distance, and the number of pairs.
    """
    if square < (1.0 - TIE) * best:
        count = 0
    best = min(best, square)
    if square <= (1.0 + TIE) * best and count < MOST:
        for k in range(4):
            nodes[count, k], weights[count, k] = found[0][k], found[1][k]
        count += 1
    return best, count
