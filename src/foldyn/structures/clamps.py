"""Clamped edges: boundary edges along which a panel keeps its tangent in space.

In bars and hinges a clamp is a hinge between the triangle (j, k, i) at the edge and the triangle's
mirror image beyond the edge, in the same plane. The mirror image does not turn. With L the length
of the edge and h the distance of i from it, the stiffness of the hinge is

    k = 2 D L / h,    D = E t^3 / 12 (1 - nu^2).

This follows from a plate of width L in cylindrical bending, M = D L kappa. A chain of rigid pieces
of length h with hinges between them bends like the plate if each hinge gathers the curvature of the
half pieces on both of its sides, k = D L / h. A clamp has a half piece on one side only, so that
the same moment turns it by half the angle. In the scheme n5b8e the same hinge is an angle of the
panel's plate (`structures.edge_angles`).
"""

from __future__ import annotations

import operator
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.patterns.selection import given_as, select
from foldyn.patterns.topology import Edge, edge_lookup
from foldyn.values import show


def boundary_edges(
    given: str | Sequence[Sequence[int]], pattern: Pattern, field: str
) -> tuple[Edge, ...]:
    """Boundary edges (low, high) from pairs of vertices or a selection, given as `field`.

    A selection ("xmin") means the boundary edges with both ends in it.

    Raises
    ------
    InputError
        Not pairs of vertices, an edge that is not on the boundary or is listed twice, or a
        selection without a boundary edge.
    """
    if isinstance(given, str):
        with given_as(field):
            chosen = np.isin(pattern.boundary, select(pattern, given)).all(axis=1)
        if not chosen.any():
            why = f" = {show(given)}: selects no boundary edge, which needs both of its ends"
            raise InputError(why, field)
        return tuple((min(pair), max(pair)) for pair in pattern.boundary[chosen].tolist())
    boundary = edge_lookup(pattern.boundary)
    try:
        pairs = [tuple(sorted(operator.index(k) for k in edge)) for edge in given]
    except TypeError:
        pairs = f'pairs of vertices, as in {field}=[(0, 1), (1, 2)], or a selection such as "xmin"'
        raise InputError(f" = {show(given)}: give {pairs}", field) from None
    if inner := [pair for pair in pairs if pair not in boundary]:
        raise InputError(f": {inner[0]} is not a boundary edge of the pattern", field)
    if len(set(pairs)) < len(pairs):
        twice = next(pair for pair in pairs if pairs.count(pair) > 1)
        raise InputError(f": {twice} is listed twice", field)
    return tuple((pair[0], pair[1]) for pair in pairs)


def clamp_rows(edges: Sequence[Edge], triangles: NDArray) -> tuple[NDArray, NDArray]:
    """Triangle (c, 3) at each boundary edge, from the edge's first corner; its index (c,).

    edges : (low, high) vertices of each edge.
    triangles : (nt, 3).
    """
    if not edges:
        return np.zeros((0, 3), np.int64), np.zeros(0, np.int64)
    sides = triangles[:, [[0, 1, 2], [1, 2, 0], [2, 0, 1]]].reshape(-1, 3)
    weight = [int(triangles.max()) + 1, 1]
    number = np.sort(sides[:, :2], axis=1) @ weight
    order = np.argsort(number)
    place = order[np.searchsorted(number, np.array(edges) @ weight, sorter=order)]
    return sides[place], place // 3


def clamp_stiffness(x: NDArray, rows: NDArray, modulus: NDArray) -> NDArray:
    """Stiffness (c,), N m/rad, of clamped edges: the first sides of triangles (c, 3) of x (n, 3).

    modulus : D (c,), N m, of the panels of these triangles.
    """
    a, b, third = (x[rows[:, k]] for k in range(3))
    squared = ((b - a) ** 2).sum(axis=1)
    area = np.linalg.norm(np.cross(b - a, third - a), axis=1)  # L h
    return 2.0 * modulus * squared / area


def clamp_points(x: NDArray, rows: NDArray) -> NDArray:
    """Points (c, 4, 3) of the hinges at triangles (c, 3) of points x (n, 3), with virtual wings."""
    wings = np.array([opposite(corners) for corners in x[rows]]).reshape(-1, 1, 3)
    return np.concatenate([x[rows], wings], axis=1)


def opposite(corners: NDArray) -> NDArray:
    """Mirror image of a triangle's third corner (corners (3, 3)), beyond its first side.

    The image lies perpendicular to the middle of the side: then a panel whose edge tilts, but whose
    tangent is kept, does not turn.
    """
    a, b, c = corners
    foot = a + (b - a) * ((c - a) @ (b - a)) / ((b - a) @ (b - a))
    return 0.5 * (a + b) + foot - c
