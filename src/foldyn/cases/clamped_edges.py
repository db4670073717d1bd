"""Edges that are supported along their whole length, and the mesh points on them.

A support with `along` holds an edge along its whole length. A clamped edge whose ends are both held
is supported in the same way: it stays straight, and its points move with the line between its ends.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.directions import AXES, unit_vector
from foldyn.cases.selection import edges_between, resolve_nodes
from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.patterns.selection import select
from foldyn.patterns.topology import Edge, edge_lookup, edge_of
from foldyn.structures.discretized import Discretized
from foldyn.structures.held_edges import boundary_edges, guided_edges, perpendicular
from foldyn.values import show


def supported_points(
    structure: Discretized, support: Any, place: str
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Nodes (k,) of a Fix, an Impose or a Link, and for an Impose the values (k,) there, m.

    Raises
    ------
    InputError
        A support with `along` has no edge between its nodes, or an edge that may bow.
    """
    named = resolve_nodes(structure, support.nodes, f"{place}.nodes")
    value = np.broadcast_to(getattr(support, "value", 0.0), named.shape)
    if not getattr(support, "along", False):
        return named, value
    edges = _edges(structure, support, named, place)
    stated = np.zeros(len(structure.nodes))
    stated[named] = value
    inner = edges[:, 1:-1].ravel()
    between = between_ends(structure, edges, stated[:, None])
    return np.concatenate([named, inner]), np.concatenate([value, between.ravel()])


def _edges(structure: Discretized, support: Any, named: NDArray, place: str) -> NDArray[np.int64]:
    """Nodes (k, p) along the edges between nodes that a support names."""
    if structure.pattern is None:
        raise InputError(
            ": this structure has no pattern with edges; leave it out", f"{place}.along"
        )
    edges = edges_between(structure, named)
    if not len(edges):
        raise InputError(
            f": no edge of the pattern has both of its ends among nodes = {show(support.nodes)}; "
            "name them, or leave it out",
            f"{place}.along",
        )
    loose = [edge_of(*edge) for edge in edges[:, [0, -1]].tolist()]
    sliding = {(low, high): axis for low, high, axis in getattr(structure.options, "guided", ())}
    held = _axes(support)
    wrong = [edge for edge in loose if sliding.get(edge, held) != held]
    loose = [edge for edge in loose if edge in structure.bowed_edges]
    if wrong:
        raise InputError(
            f": the edge {wrong[0]} is guided along {sliding[wrong[0]]} only, and may bow; list it "
            "in straight instead",
            f"{place}.along",
        )
    inside = sorted(set(loose) - edge_lookup(structure.pattern.boundary).keys())
    if inside:
        raise InputError(
            f": the crease {inside[0]} would have to be straight, and bars and hinges have no "
            "such option for creases; hold its vertices without along, or take a shell",
            f"{place}.along",
        )
    if loose:
        given = support.nodes if isinstance(support.nodes, str) else list(map(list, loose))
        made = f"straight = {show(given)}"
        if len(held) == 1:
            made = f"guided = {show({held: given})}, or {made} if the rim is stiff"
        raise InputError(
            f": the edge {loose[0]} may bow between its ends; make the structure with {made}",
            f"{place}.along",
        )
    return edges


def held_edges(
    structure: Any, supports: Iterable[Any], fixed: NDArray[np.bool_]
) -> dict[int, NDArray[np.float64]]:
    """Edges, as numbered in `pattern.lines`, that are held along, and in which directions (h, 3).

    Empty for models that have nodes along edges, or edges that do not bow.

    fixed : dofs (n, 3) that are supported in all; both ends of a clamped edge hold it.
    """
    if not structure.linear:
        return {}
    number, found = edge_lookup(structure.pattern.lines), {}
    for support in supports:
        if not getattr(support, "along", False):
            continue
        held = np.array([unit_vector(unit) for unit in _axes(support) or [support.direction]])
        for edge in edges_between(structure, resolve_nodes(structure, support.nodes, "nodes")):
            found.setdefault(number[edge_of(int(edge[0]), int(edge[-1]))], []).append(held)
    for low, high in structure.options.clamped:
        both = fixed[low] & fixed[high]
        if both.any():
            found.setdefault(number[low, high], []).append(np.eye(3)[both])
    return {edge: np.concatenate(held) for edge, held in found.items()}


def _axes(support: Any) -> str:
    """Axes that a support holds, or "" for one in an oblique direction."""
    return getattr(support, "axes", None) or getattr(support, "axis", None) or ""


def straightened(options: Any, pattern: Pattern, supports: Iterable[Any]) -> dict[str, Any]:
    """Options `straight` and `guided` for supports that hold edges along their length.

    They list all boundary edges that are held so: along one axis perpendicular to the edge, or
    otherwise. Where edges cannot bow, the result is empty.
    """
    if not getattr(options, "bowed", False):
        return {}
    straight = dict.fromkeys(boundary_edges(options.straight, pattern, "straight"))
    guided = {(low, high): axis for low, high, axis in guided_edges(options.guided, pattern)}
    found: dict[Edge, set[str]] = {}
    for support in supports:
        if getattr(support, "along", False):
            named = support.nodes
            nodes = set(select(pattern, named).tolist() if isinstance(named, str) else named)
            held = (edge for edge in edge_lookup(pattern.boundary) if nodes.issuperset(edge))
            for edge in sorted(held):
                found.setdefault(edge, set()).update(_axes(support) or AXES)
    for edge, axes in found.items():
        if len(axes) == 1 and edge not in straight and perpendicular(pattern, edge, *axes):
            guided[edge] = min(axes)
        else:
            straight[edge] = None
    slid = tuple((*edge, axis) for edge, axis in guided.items() if edge not in straight)
    return {"straight": tuple(straight), "guided": slid}


def between_ends(structure: Discretized, edges: NDArray, vector: NDArray) -> NDArray[np.float64]:
    """Values (k, p - 2, ...) at the inner points of edges (k, p), linear between their ends."""
    x = structure.nodes[edges]
    share = np.linalg.norm(x - x[:, :1], axis=2)
    share = (share / share[:, -1:])[:, 1:-1, None]
    return (1.0 - share) * vector[edges[:, :1]] + share * vector[edges[:, -1:]]
