"""Seams: boundary edges in one place that are not joined, where a crease was probably meant.

A crease is an edge of two panels, named by the same two vertices. Two vertices in the same place
are two all the same: panels that meet there only look joined. That is so on purpose along a cut,
which is told by a letter. Where panels lie upon each other at the edges, as in a flat-folded state,
they are layers and no seam.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from foldyn.patterns.topology import Faces, edge_lookup

Edge = tuple[int, int]

SAME_PLACE = 1e-9  # of the pattern's size
LAYERS = 1e-6  # rad: panels that leave their edges at less than that lie upon each other


def seams(
    vertices: NDArray[np.float64],
    faces: Faces,
    normals: NDArray[np.float64],
    boundary: NDArray[np.int64],
) -> list[tuple[Edge, Edge]]:
    """Pairs of boundary edges whose ends lie in the same places and whose panels do not.

    Parameters
    ----------
    vertices : ndarray, shape (n, 3)
        Coordinates (m).
    faces : tuple of tuple of int
        Consistently wound.
    normals : ndarray, shape (m, 3)
        Unit normals of the faces.
    boundary : ndarray of int, shape (nb, 2)
        Edges of one face.
    """
    place = _places(vertices, boundary)
    ends = np.sort(place[boundary], axis=1)
    _, group, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    doubled = np.flatnonzero(count[group.ravel()] > 1)
    if not len(doubled):
        return []
    inward = _inward(vertices, faces, normals, boundary, doubled)
    found: list[tuple[Edge, Edge]] = []
    first: dict[int, int] = {}
    for k in doubled.tolist():
        other = first.setdefault(int(group.ravel()[k]), k)
        if np.linalg.norm(inward[k] - inward[other]) > LAYERS:
            found.append((_pair(boundary[other]), _pair(boundary[k])))
    return found


def _pair(edge: NDArray[np.int64]) -> Edge:
    return int(edge[0]), int(edge[1])


def _places(vertices: NDArray[np.float64], boundary: NDArray[np.int64]) -> NDArray[np.int64]:
    """Number of the place of each vertex (n,), the same for those of the boundary that coincide."""
    rim = np.unique(boundary)
    points, where = np.unique(vertices[rim], axis=0, return_inverse=True)
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    pairs = cKDTree(points).query_pairs(SAME_PLACE * size, output_type="ndarray")
    near = coo_array((np.ones(len(pairs)), tuple(pairs.T)), (len(points), len(points)))
    places = np.arange(len(vertices)) + len(points)
    places[rim] = connected_components(near, directed=False)[1][where.ravel()]
    return places


def _inward(
    vertices: NDArray[np.float64],
    faces: Faces,
    normals: NDArray[np.float64],
    boundary: NDArray[np.int64],
    chosen: NDArray[np.int64],
) -> dict[int, NDArray[np.float64]]:
    """Unit vectors from the chosen boundary edges into their panels, across the edge."""
    row = edge_lookup(boundary[chosen])
    found = {}
    for number, face in enumerate(faces):
        for a, b in zip(face, (*face[1:], face[0]), strict=True):
            k = row.get((min(a, b), max(a, b)))
            if k is not None:
                inward = np.cross(normals[number], vertices[b] - vertices[a])
                found[int(chosen[k])] = inward / np.linalg.norm(inward)
    return found
