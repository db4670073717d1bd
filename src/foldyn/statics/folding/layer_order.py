"""The layer order of a flat-folded sheet: found, or the reason why there is none."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csgraph

from foldyn.errors import ComputationError, InputError
from foldyn.patterns import Pattern
from foldyn.patterns.topology import around, edge_lookup, edge_of
from foldyn.patterns.transforms import FACE_ORDERS
from foldyn.statics.folding.layer_constraints import FlatState, layer_constraints
from foldyn.statics.folding.layers import CrossingError, ordered

Orders = Sequence[Sequence[int]]
EXACT = 1e-6  # of the size of the pattern: least tolerance of a flat state


def flat_state(pattern: Pattern, angles: NDArray, closed: float) -> FlatState | None:
    """A folded pattern as a flat state; None if it does not lie flat.

    angles : fold angles (nc,), rad. closed : least size of a closed fold; one as close to 0 counts
    as open.
    """
    size = np.abs(angles)
    if ((size > math.pi - closed) & (size < closed)).any() or not (size >= closed).any():
        return None
    points, near = _flattened(pattern)
    areas = []
    for face in pattern.faces:
        a, b = points[list(face)].T
        areas.append(float(a @ np.roll(b, -1) - b @ np.roll(a, -1)))
    signs = np.where(size >= closed, np.sign(angles), 0.0).astype(np.int64)
    return FlatState(points, np.array(areas) > 0.0, signs, near)


def _flattened(pattern: Pattern) -> tuple[NDArray, float]:
    """Vertices (n, 2), m, in the plane of a sheet, and the distance that counts as zero.

    Separate sheets that do not lie in one plane are placed side by side, each in its own plane.
    """
    edges = np.array([pair for face in pattern.faces for pair in around(face)])
    size = len(pattern.vertices)
    graph = sparse.coo_array((np.ones(len(edges)), edges.T), shape=(size, size))
    part = csgraph.connected_components(graph, directed=False)[1]
    used = np.unique(edges)
    sheets = [used[part[used] == k] for k in np.unique(part[used])]
    planes = [_in_plane(pattern.vertices[rows]) for rows in sheets]
    near = max(EXACT * pattern.size, 2.0 * max(thickness for _, thickness in planes))
    together, thickness = _in_plane(pattern.vertices[used])
    if thickness <= near:
        sheets, planes, near = [used], [(together, thickness)], max(near, 2.0 * thickness)
    points, start = np.zeros((size, 2)), 0.0
    for rows, (flat, _) in zip(sheets, planes, strict=True):
        points[rows] = flat - flat.min(axis=0) + [start, 0.0]
        start = points[rows, 0].max() + pattern.size
    return points, near


def _in_plane(x: NDArray) -> tuple[NDArray, float]:
    """Points x (k, 3) in their plane (k, 2), and their thickness across it."""
    middle = x - x.mean(axis=0)
    axes = np.linalg.svd(middle, full_matrices=False)[2]
    return middle @ axes[:2].T, float(np.ptp(middle @ axes[2]))


def with_layers(pattern: Pattern, angles: NDArray, closed: float, given: Orders) -> Pattern:
    """The pattern, with its layer order in its custom data if it lies flat.

    No order is stored if the search is given up. Arguments and errors are as in `flat_state` and
    `layer_order`.
    """
    state = flat_state(pattern, angles, closed)
    if state is None:
        return pattern
    try:
        orders = layer_order(pattern, state, given).tolist()
    except ComputationError:
        return pattern
    return pattern.changed(custom={**pattern.custom, FACE_ORDERS: orders})


def layer_order(pattern: Pattern, state: FlatState, given: Orders = ()) -> NDArray[np.int64]:
    """Layer order of overlapping panels: rows (f, g, s) as FOLD's faceOrders.

    s is 1 where panel f lies on the side of g to which the front of g faces, -1 on the other.
    `given` holds rows to satisfy.

    Raises
    ------
    InputError
        No order keeps the panels from passing through each other.
    ComputationError
        The search was given up.
    """
    constraints = layer_constraints(pattern, state)
    pairs = constraints.pairs
    row = edge_lookup(pairs)
    for f, g in pattern.crease_faces[state.signs != 0].tolist():
        if edge_of(f, g) not in row:
            raise ComputationError(
                f"no order of the layers was looked for: panels {f} and {g} lie upon each other, "
                f"but what counts as flat is as large as they are ({state.near:.3g} m)"
            )
    for f, g, side in given:
        if side and edge_of(f, g) in row:
            above = side if state.up[g] else -side
            constraints.products.append(((row[edge_of(f, g)],), above if f < g else -above))
    try:
        orders = ordered(constraints)
    except CrossingError as crossing:
        panels = np.unique(pairs[list(crossing.rows)]).tolist()
        raise InputError(
            ": lies flat when folded, but no order of its layers keeps panels from passing through "
            f"each other (found at panels {', '.join(map(str, panels))}); change assignments "
            "there, or fold it less",
            "pattern",
        ) from None
    above = np.where(state.up[pairs[:, 1]], orders, -orders)
    return np.column_stack([pairs, above])
