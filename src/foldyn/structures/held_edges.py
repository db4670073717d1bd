"""Boundary edges that are held: clamped ones keep a tangent in space, guided ones a direction.

Along clamped edges a panel keeps its tangent in space. In bars and hinges a clamp is a hinge
between the triangle (j, k, i) at the edge and the triangle's mirror image beyond the edge, in the
same plane. The mirror image does not turn. With L the length of the edge and h the distance of i
from it, the stiffness of the hinge is

    k = 2 D L / h,    D = E t^3 / 12 (1 - nu^2).

This follows from a plate of width L in cylindrical bending, M = D L kappa. A chain of rigid pieces
of length h with hinges between them bends like the plate if each hinge gathers the curvature of the
half pieces on both of its sides, k = D L / h. A clamp has a half piece on one side only, so that
the same moment turns it by half the angle. In the scheme n5b8e the same hinge is an angle of the
panel's plate (`structures.edge_angles`).

Guided edges are boundary edges held along one axis along their whole length, and free otherwise.
Held perpendicular to itself, an edge can bow only along the direction f, perpendicular to the edge
and to the axis. With g the angle between f and the normal of the panel, a bow w in the plane of the
panel is a deflection w / tan(g), which the panel's bending resists as at a crease
(`structures.panel_membrane`); g = 90 degrees is an edge that bows freely in the plane of its panel,
and g = 0 one that is straight in it. As a plate, the panel has a straight edge there if sin(g) is
above `edge_angles.STRAIGHT` t/L, as at creases. Edges that are not perpendicular to the axis are
straight.
"""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.patterns.selection import given_as, select
from foldyn.patterns.topology import Edge, edge_lookup, edge_of
from foldyn.structures.sheet import Sheet
from foldyn.values import show, whole

AXES = "xyz"
STEEP = 3.0  # sin(g) L/t above which plates have straight edges; see `edge_angles`
ACROSS = 1e-6  # cosine between an edge and an axis, up to which they are perpendicular
Guided = tuple[int, int, str]  # an edge (low, high) and the axis along which it is held


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


def guided_edges(given: Any, pattern: Pattern) -> tuple[Guided, ...]:
    """Guided edges from a mapping of axes to edges, given as in `boundary_edges`, or from such.

    Raises
    ------
    InputError
        Not such a mapping, or an edge that is guided twice.
    """
    if isinstance(given, Mapping):
        if strange := [axis for axis in given if axis not in tuple(AXES)]:
            raise InputError(f": {show(strange[0])} is no axis; take x, y or z", "guided")
        chosen = {
            axis: boundary_edges(edges, pattern, f"guided.{axis}") for axis, edges in given.items()
        }
        found = [(*edge, axis) for axis, edges in chosen.items() for edge in edges]
    elif isinstance(given, Sequence) and not isinstance(given, str):
        found = [_guided(one) for one in given]
    else:
        raise InputError(
            f' = {show(given)}: give edges by axis, as in guided = {{"z": "zmax"}}', "guided"
        )
    edges = [(low, high) for low, high, _ in found]
    if twice := [edge for edge in edges if edges.count(edge) > 1]:
        raise InputError(f": {twice[0]} is listed twice; list it in straight instead", "guided")
    return tuple(found)


def _guided(given: Any) -> Guided:
    """An edge and its axis, as options have them."""
    if isinstance(given, Sequence) and len(given) == 3 and given[2] in tuple(AXES):
        return (*edge_of(*(whole("guided", each) for each in given[:2])), given[2])
    raise InputError(f": {show(given)}: give two vertices and an axis x, y or z", "guided")


def perpendicular(pattern: Pattern, edge: Edge, axis: str) -> bool:
    """Whether an edge is perpendicular to an axis."""
    along = pattern.vertices[edge[1]] - pattern.vertices[edge[0]]
    return abs(along[AXES.index(axis)]) < ACROSS * float(np.linalg.norm(along))


def directions(guided: Sequence[Guided], pattern: Pattern) -> dict[Edge, NDArray[np.float64]]:
    """Directions (3,) in which guided edges can bow, for edges perpendicular to their axis."""
    found = {}
    for low, high, axis in guided:
        if perpendicular(pattern, (low, high), axis):
            along = pattern.vertices[high] - pattern.vertices[low]
            f = np.cross(along, np.eye(3)[AXES.index(axis)])
            found[low, high] = f / np.linalg.norm(f)
    return found


def straight_in_plane(
    straight: Sequence[Edge], guided: Sequence[Guided], pattern: Pattern
) -> list[Edge]:
    """Edges that do not bow in the plane of their panel: straight ones, and oblique guided ones."""
    bowing = directions(guided, pattern)
    edges = [(low, high) for low, high, _ in guided]
    return [*straight, *(edge for edge in edges if edge not in bowing)]


def straight_in_bending(
    straight: Sequence[Edge], guided: Sequence[Guided], pattern: Pattern, sheet: Sheet
) -> list[Edge]:
    """Edges that do not bow out of the plane of their panel."""
    found, x = straight_in_plane(straight, guided, pattern), pattern.vertices
    thickness = sheet.values("thickness", len(pattern.faces))
    for (low, high), f in directions(guided, pattern).items():
        (panel,) = (p for p, face in enumerate(pattern.faces) if {low, high} <= set(face))
        sine = float(np.linalg.norm(np.cross(f, pattern.face_normals[panel])))
        if sine > STEEP * thickness[panel] / np.linalg.norm(x[high] - x[low]):
            found.append((low, high))
    return found
