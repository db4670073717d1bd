"""Material axes of orthotropic sheets in the panels of a pattern, and stiffness along others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import breadth_first_order

from foldyn.errors import InputError
from foldyn.mechanics.triangle import turned_axes
from foldyn.patterns import Pattern
from foldyn.patterns.topology import around, at_junctions
from foldyn.structures.ply import expansion as plies_expansion
from foldyn.structures.sheet import Sheet

UPRIGHT = 0.02  # a vector with a smaller part along a panel counts as normal to it
SAME = 1e-3  # rad: difference of directions carried along two ways; drawings are not exact


def material_axes(pattern: Pattern, sheet: Sheet) -> NDArray[np.float64] | None:
    """Unit vectors (np, 3) of direction 1 in the panels at rest; None if all are isotropic.

    Isotropic panels among others have their first edge.

    Raises
    ------
    InputError
        A direction normal to its panel; an edge that the pattern does not have; a direction that
        cannot be carried over the creases, as the pattern does not lie flat.
    """
    kinds, kind = sheet.kinds(len(pattern.faces))
    if not any(own.orthotropic for own in kinds):
        return None
    axes = panel_axes(pattern)
    out = axes[:, 0].copy()
    for number, own in enumerate(kinds):
        panels = np.flatnonzero(kind == number)
        if not own.orthotropic or not len(panels):
            continue
        place = f"sheet: panels[{number - 1}].direction" if number else "sheet: direction"
        given: Any = own.direction
        if isinstance(given, float):
            out[panels] = _heading(given) @ axes[panels]
        elif len(given) == 3:
            out[panels] = _projected(np.array(given), pattern.face_normals[panels], panels, place)
        else:
            out[panels] = _carried(pattern, given[0], given[1], place)[panels]
    return out


def panel_axes(pattern: Pattern) -> NDArray[np.float64]:
    """Unit vectors (np, 2, 3) along the first edge of each panel, and across in its plane."""
    return np.array([_frame(pattern, p, *face[:2]) for p, face in enumerate(pattern.faces)])


def _frame(pattern: Pattern, panel: int, a: int, b: int) -> NDArray[np.float64]:
    """Unit vectors (2, 3) from vertex a to b, and across in the plane of a panel."""
    along = pattern.vertices[b] - pattern.vertices[a]
    axes = np.stack([along, np.cross(pattern.face_normals[panel], along)])
    return axes / np.linalg.norm(axes, axis=1)[:, None]


def _heading(degrees: float) -> NDArray[np.float64]:
    angle = np.radians(degrees)
    return np.array([np.cos(angle), np.sin(angle)])


def own_stretching(pattern: Pattern, sheet: Sheet, axes: NDArray) -> NDArray[np.float64]:
    """Membrane stiffness (np, 3, 3), N/m, along axes (np, 2, 3) of the panels."""
    kinds, kind = sheet.kinds(len(pattern.faces))
    stiffness = np.array([own.stretching for own in kinds])[kind]
    return _along(stiffness, material_axes(pattern, sheet), axes)


def bending_across(pattern: Pattern, sheet: Sheet) -> NDArray[np.float64]:
    """Bending stiffness (nf, 2), N m, of the panels beside each crease, across the crease."""
    kinds, kind = sheet.kinds(len(pattern.faces))
    faces, fibers = pattern.crease_faces, material_axes(pattern, sheet)
    if fibers is None:
        return np.array([own.bending_modulus for own in kinds])[kind][faces]
    side = pattern.vertices[pattern.creases[:, 1]] - pattern.vertices[pattern.creases[:, 0]]
    along = side / np.linalg.norm(side, axis=1)[:, None]
    stiffness = np.array([own.bending for own in kinds])[kind]
    out = []
    for face in faces.T:
        axes = np.stack([np.cross(along, pattern.face_normals[face]), along], axis=1)
        out.append(_along(stiffness[face], fibers[face], axes)[:, 0, 0])
    return np.stack(out, axis=1)


def free_strains(
    pattern: Pattern, sheet: Sheet, chosen: NDArray, expansion: tuple[float, float] | None
) -> NDArray[np.float64]:
    """Tensors (np, 3, 3), 1/K, of panels that expand by two numbers, or as their plies (None).

    Raises
    ------
    InputError
        A chosen panel (np,) without a direction, or without plies whose expansion is known.
    """
    kinds, kind = sheet.kinds(len(pattern.faces))
    given = [expansion and own.orthotropic and (*expansion, 0.0) for own in kinds]
    if expansion is None:
        given = [own.plies and plies_expansion(own.plies).tolist() for own in kinds]
    strain = np.array([own or 3 * [np.nan] for own in given])[kind]
    missed = np.flatnonzero(chosen & np.isnan(strain).any(axis=1))
    if len(missed):
        why = "has no plies with an expansion; give Ply(expansion=...)"
        if expansion is not None:
            why = "is isotropic, and has no direction; give one number"
        raise InputError(f": panel {missed[0]} {why}, or name other panels", "expansion")
    fibers = material_axes(pattern, sheet)
    if fibers is None:
        return np.zeros((len(strain), 3, 3))
    axes = np.stack([fibers, np.cross(pattern.face_normals, fibers)], axis=1)
    xx, yy, xy = np.where(chosen[:, None], strain, 0.0).T
    tensor = np.moveaxis(np.array([[xx, 0.5 * xy], [0.5 * xy, yy]]), 2, 0)
    return axes.swapaxes(1, 2) @ tensor @ axes


def _along(stiffness: NDArray, fibers: NDArray | None, axes: NDArray) -> NDArray[np.float64]:
    """Stiffness (k, 3, 3) along axes (k, 2, 3), from that along the material's."""
    if fibers is None:
        return stiffness
    x, y = np.einsum("kai,ki->ak", axes, fibers)
    return turned_axes(stiffness, np.arctan2(y, x))


def _projected(vector: NDArray, normals: NDArray, panels: NDArray, place: str) -> NDArray:
    """Directions of a vector in panels (k,) with normals (k, 3)."""
    flat = vector - (normals @ vector)[:, None] * normals
    size = np.linalg.norm(flat, axis=1)
    upright = np.flatnonzero(size < UPRIGHT * np.linalg.norm(vector))
    if len(upright):
        raise InputError(
            f"{place} = {vector.tolist()}: is normal to panel {panels[upright[0]]}; give an edge "
            "from which it continues over the creases, { edge = [0, 1], angle = 0 }, or "
            "panels of their own direction"
        )
    return flat / size[:, None]


def _carried(pattern: Pattern, edge: tuple[int, int], degrees: float, place: str) -> NDArray:
    """Directions (np, 3) at an angle from an edge, continued over creases as in the flat sheet."""
    ways = {edge, edge[::-1]}
    start = [p for p, face in enumerate(pattern.faces) if not ways.isdisjoint(around(face))]
    if not start:
        raise InputError(f"{place}.edge = {list(edge)}: the pattern has no such edge")
    inner = np.concatenate([pattern.creases, pattern.welds])
    flat = ~at_junctions(inner)  # the others do not lie flat
    inner = inner[flat].tolist()
    faces = np.concatenate([pattern.crease_faces, pattern.weld_faces])[flat]
    count = len(pattern.faces)
    graph = sparse.coo_array((np.ones(len(faces)), tuple(faces.T)), (count, count))
    order, before = breadth_first_order(graph.tocsr(), start[0], directed=False)
    shared = {frozenset(pair): ends for pair, ends in zip(faces.tolist(), inner, strict=True)}
    out = np.zeros((count, 3))
    out[start[0]] = _heading(degrees) @ _frame(pattern, start[0], *edge)

    def across(ends: Sequence[int], one: int, other: int) -> NDArray:
        a, b = ends
        return _frame(pattern, one, a, b) @ out[one] @ _frame(pattern, other, a, b)

    for panel in order[1:].tolist():
        one = int(before[panel])
        out[panel] = across(shared[frozenset((one, panel))], one, panel)
    if len(order) < count:
        missed = np.setdiff1d(np.arange(count), order)[0]
        raise InputError(
            f"{place}: no creases lead from the edge to panel {missed}; give it a direction of its "
            "own in sheet.panels"
        )
    for (one, other), ends in zip(faces.tolist(), inner, strict=True):
        if np.linalg.norm(np.cross(across(ends, one, other), out[other])) > SAME:
            raise InputError(
                f"{place}: panel {other} gets two directions along two ways, as the pattern does "
                "not lie flat; give a vector, or panels of their own direction"
            )
    return out
