"""Tiling: finding the periods of a pattern, and gluing copies edge to edge."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns.topology import Faces, around, components, edge_lookup, edge_of

PARALLEL = 1e-3  # rad: periods within this angle have the same direction
MOST_EDGES = 600  # most boundary edges in a search for periods


class Glued(NamedTuple):
    """Several sheets glued into one.

    Attributes
    ----------
    vertices : ndarray, shape (n, 3)
        Coordinates (m).
    numbers : list of ndarray of int
        For each sheet, the new numbers of its vertices.
    joined : int
        Number of glued pairs of edges.
    """

    vertices: NDArray[np.float64]
    numbers: list[NDArray[np.int64]]
    joined: int


def half_edges(faces: Faces, boundary: NDArray) -> NDArray[np.int64]:
    """Boundary edges (m, 2) in the direction of their face's winding."""
    rim = edge_lookup(boundary)
    found = [(a, b) for face in faces for a, b in around(face) if edge_of(a, b) in rim]
    return np.array(found, dtype=np.int64).reshape(-1, 2)


def glue(vertices: Sequence[NDArray], edges: Sequence[NDArray], tolerance: float) -> Glued:
    """Join sheets along coincident boundary edges.

    Only the ends of coincident edges are merged, so that cuts within a sheet stay open.

    Parameters
    ----------
    vertices : sequence of ndarray, shape (n, 3)
        Coordinates (m) of each sheet.
    edges : sequence of ndarray of int, shape (m, 2)
        Boundary edges of each sheet.
    tolerance : float
        Distance (m) that counts as zero.

    Returns
    -------
    Glued
        The sheet, with the vertices of the first sheet first; merged vertices keep their position
        in the earliest sheet.
    """
    from scipy.spatial import cKDTree

    starts = np.cumsum([0, *(len(each) for each in vertices)])
    points = np.concatenate(list(vertices))
    rim = np.concatenate([part + start for part, start in zip(edges, starts, strict=False)])
    owner = np.repeat(np.arange(len(edges)), [len(part) for part in edges])
    ends = points[rim].reshape(-1, 6)
    tree, same, joined = cKDTree(ends), [], 0
    for other, flip in ((points[rim[:, ::-1]].reshape(-1, 6), True), (ends, False)):
        for e, matches in enumerate(tree.query_ball_tree(cKDTree(other), tolerance * np.sqrt(2.0))):
            for f in matches:
                if owner[e] < owner[f]:
                    same += zip(rim[e], rim[f][::-1] if flip else rim[f], strict=True)
                    joined += 1
    label = components(same, len(points))
    _, first = np.unique(label, return_index=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    number = rank[label]
    numbers = [number[start:end] for start, end in pairwise(starts)]
    return Glued(points[np.sort(first)], numbers, joined)


def periods(vertices: NDArray, edges: NDArray, tolerance: float) -> NDArray[np.float64]:
    """Two translations (2, 3), m, that place copies of a sheet edge to edge.

    The translations map the longest parts of the boundary onto other parts of the boundary that run
    in the opposite direction, as the edges of two panels do at a crease.

    Parameters
    ----------
    vertices : ndarray, shape (n, 3)
        Coordinates (m).
    edges : ndarray of int, shape (m, 2)
        Boundary edges in the direction of their face's winding.
    tolerance : float
        Distance (m) that counts as zero.

    Returns
    -------
    ndarray, shape (2, 3)
        Translations, first the one with the direction closer to the x axis; each towards positive
        coordinates.

    Raises
    ------
    InputError
        Fewer than two translations are found.
    """
    found: list[NDArray] = []
    if len(edges) <= MOST_EDGES:
        lengths = np.linalg.norm(np.diff(vertices[edges], axis=1)[:, 0], axis=1)
        left = lengths.copy()  # lengths of boundary edges; 0 once a period has matched the edge
        steps = _translations(vertices, edges, tolerance)
        while steps and len(found) < 2:
            step, brought = max(steps, key=lambda each: (_rounded(left[each[1]].sum(), lengths),
                                                         -np.linalg.norm(each[0])))  # fmt: skip
            if left[brought].sum() == 0.0:
                break
            found.append(step)
            left[brought] = 0.0
            steps = [each for each in steps if _angle(each[0], step) > PARALLEL]
    if len(found) < 2:
        raise InputError(
            f": found {len(found)} of the two translations from one copy of the pattern to the "
            "next; give them, as in periods=[(0.1, 0, 0), (0, 0.1, 0)]",
            "periods",
        )
    along = [abs(step[0]) / np.linalg.norm(step) for step in found]
    return np.stack(found if along[0] >= along[1] else found[::-1])


def _rounded(length: float, lengths: NDArray) -> float:
    """Share of the boundary, rounded so that equal shares compare equal."""
    return round(float(length / lengths.sum()), 6)


def _translations(
    vertices: NDArray, edges: NDArray, tolerance: float
) -> list[tuple[NDArray, NDArray]]:
    """Translations that map boundary edges onto others, each with the edges that it matches."""
    from scipy.spatial import cKDTree

    a, b = vertices[edges[:, 0]], vertices[edges[:, 1]]
    way = b - a
    near = cKDTree(way).query_ball_tree(cKDTree(-way), 2.0 * tolerance)
    one = np.repeat(np.arange(len(edges)), [len(others) for others in near])
    two = np.array([f for others in near for f in others], dtype=np.int64)
    shifts = b[two] - a[one]
    largest = np.take_along_axis(shifts, np.abs(shifts).argmax(axis=1)[:, None], axis=1)
    far = np.linalg.norm(shifts, axis=1) > 10.0 * tolerance
    shifts = np.where(largest < 0.0, -shifts, shifts)[far]
    one, two = one[far], two[far]
    pairs = cKDTree(shifts).query_pairs(4.0 * tolerance, output_type="ndarray")
    group = components(pairs, len(shifts))
    order = np.argsort(group, kind="stable")
    return [
        (shifts[members].mean(axis=0), np.unique([one[members], two[members]]))
        for members in np.split(order, np.flatnonzero(np.diff(group[order])) + 1)
        if len(members)
    ]


def _angle(one: NDArray, two: NDArray) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(one, two)), abs(one @ two)))
