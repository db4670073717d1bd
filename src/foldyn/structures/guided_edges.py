"""Guided edges: boundary edges held along one axis along their whole length, and free otherwise.

Held perpendicular to itself, an edge can bow only along the direction f, perpendicular to the edge
and to the axis. With g the angle between f and the normal of the panel, a bow w in the plane of the
panel is a deflection w / tan(g), which the panel's bending resists as at a crease
(`structures.panel_membrane`); g = 90 degrees is an edge that bows freely in the plane of its panel,
and g = 0 one that is straight in it. As a plate, the panel has a straight edge there if sin(g) is
above `edge_angles.STRAIGHT` t/L, as at creases. Edges that are not perpendicular to the axis are
straight.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.patterns.topology import Edge, edge_of
from foldyn.structures.clamps import boundary_edges
from foldyn.structures.sheet import Sheet
from foldyn.values import show, whole

AXES = "xyz"
STEEP = 3.0  # sin(g) L/t above which plates have straight edges; see `edge_angles`
ACROSS = 1e-6  # cosine between an edge and an axis, up to which they are perpendicular
Guided = tuple[int, int, str]  # an edge (low, high) and the axis along which it is held


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
