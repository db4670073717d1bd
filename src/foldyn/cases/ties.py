"""The equations that supports along directions, links and rigid panels ask for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.clamped_edges import supported_points
from foldyn.cases.constraints import AGREES, STRUCTURE, Equation
from foldyn.cases.directions import AXES, unit_vector
from foldyn.cases.selection import resolve_nodes
from foldyn.cases.supports import Fix, Impose, Link
from foldyn.errors import InputError
from foldyn.structures.rigid_plates import OFF_PLANE, on_plate
from foldyn.values import show


def equations_of(structure: Any, supports: Iterable[tuple[str, Any]]) -> list[Equation]:
    """Equations of a structure's rigid panels and of supports, these with their places.

    Those of supports come first, so that of equations that say the same theirs is the one that
    carries.
    """
    directions: list[Equation] = []
    links: list[Equation] = []
    for place, support in supports:
        nodes, _ = supported_points(structure, support, place)
        if isinstance(support, Link):
            links += _link(structure, support, place, nodes)
        elif support.direction is not None:
            directions += _along(support, place, nodes)
    return [*directions, *links, *_rigid(structure)]


def values_of(owners: NDArray, values: Mapping[str, Any]) -> NDArray[np.float64]:
    """Values (k,), m, of equations with these owners; of others than those given, zero.

    values : by owner; one for all nodes, or one for each.
    """
    out = np.zeros(len(owners))
    for owner, value in values.items():
        out[owners == owner] = value
    return out


def check_tied(case: Any, displacement: NDArray, field: str) -> None:
    """Refuse displacements (n, 3), m, in which links gape or rigid panels are bent."""
    ties = case.constraints
    if not ties:
        return
    gap = np.where(ties.along, 0.0, np.abs(ties.values(displacement)))
    if gap.max() > AGREES * case.structure.bar_length.max():
        worst = int(gap.argmax())
        raise InputError(
            f": does not satisfy {ties.owners[worst]}: node {ties.equations[worst].dofs[0] // 3} "
            f"stands {gap[worst]:.3g} m from where it is tied to; take a state of a case with the "
            "same links and rigid panels",
            field,
        )


def _along(support: Fix | Impose, owner: str, nodes: NDArray) -> list[Equation]:
    """The displacement of each node along a direction, which its largest component names."""
    unit = unit_vector(support.direction)
    axes = [int(k) for k in np.argsort(-np.abs(unit), kind="stable") if unit[k] != 0.0]
    values = unit[axes].tolist()
    return [Equation(owner, [3 * node + k for k in axes], values) for node in nodes.tolist()]


def _link(structure: Any, link: Link, place: str, nodes: NDArray) -> list[Equation]:
    if link.to is None:
        if len(nodes) < 2:
            raise InputError(
                f" = {show(link.nodes)}: selects node {nodes[0]} alone; a link ties at least two",
                f"{place}.nodes",
            )
        first, *others = nodes.tolist()
        return [
            Equation(place, [3 * node + k, 3 * first + k], [1.0, -1.0])
            for node in others
            for k in sorted(map(AXES.index, link.axes or ""))
        ]
    corners = resolve_nodes(structure, link.to, f"{place}.to")
    if twice := set(nodes.tolist()) & set(corners.tolist()):
        raise InputError(
            f": node {min(twice)} is among those that ride on them; leave it out", f"{place}.to"
        )
    weights, off = on_plate(structure.nodes[nodes], structure.nodes[corners])
    if np.isnan(off).any():
        raise InputError(
            f" = {list(link.to)}: these nodes lie on a line; take three that span a triangle",
            f"{place}.to",
        )
    if off.max() > OFF_PLANE:
        raise InputError(
            f": node {nodes[int(off.argmax())]} lies off the plane of nodes {list(link.to)} by "
            f"{off.max():.2g} of their size; a point off the plane would have to know how the "
            "plate turns, which is no linear function of three displacements: take nodes in the "
            "plane, or join it by bars",
            f"{place}.nodes",
        )
    return _riding(place, nodes, corners, weights)


def _rigid(structure: Any) -> list[Equation]:
    return [
        equation
        for plate in structure.plates
        for equation in _riding(STRUCTURE, plate.riders, plate.corners, plate.weights)
    ]


def _riding(owner: str, nodes: NDArray, corners: NDArray, weights: NDArray) -> list[Equation]:
    """Each node moves as corners (3,) do with its weights (k, 3)."""
    return [
        Equation(owner, [3 * node + k, *(3 * corners + k).tolist()], [1.0, *-row])
        for node, row in zip(nodes.tolist(), weights, strict=True)
        for k in range(3)
    ]
