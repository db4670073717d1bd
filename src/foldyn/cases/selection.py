"""Selections: nodes by number or by place (`patterns.selection`); creases, edges and panels.

Also the share of each node in the length of edges and the area of panels.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.arguments import Check
from foldyn.errors import InputError
from foldyn.patterns.crease_data import crease_rows
from foldyn.patterns.selection import check_expression, given_as, select
from foldyn.patterns.topology import edge_lookup, edge_of
from foldyn.structures.discretized import Discretized
from foldyn.structures.mesh import double_areas
from foldyn.values import indices, listed, show

_WORDS = 'one of "all", "mountain", "valley", or a family of the pattern'


def resolve_nodes(
    structure: Discretized, nodes: int | Sequence[int] | ArrayLike | str, field: str = "nodes"
) -> NDArray[np.int64]:
    """Numbers of nodes of a structure, from one or several numbers or an expression.

    Parameters
    ----------
    structure : Structure
        Its `nodes` (n, 3) limit the numbers; expressions refer to the vertices of its pattern.
    nodes : int, sequence of int, or str
        Numbers are kept in the order given.
    field : str
        Name of the field for messages.

    Raises
    ------
    InputError
        A number is out of range or listed twice, or an expression selects nothing.
    """
    if isinstance(nodes, str):
        pattern = structure.pattern  # None for a structure made by hand: all nodes are vertices
        with given_as(field):
            return select(structure.nodes if pattern is None else pattern, nodes)
    check_nodes(field, nodes)
    return in_range(field, nodes, len(structure.nodes), "node")


def in_range(field: str, given: Any, count: int, what: str) -> NDArray[np.int64]:
    """Return numbers as an array if all are below `count`, the number of items that exist."""
    chosen = np.atleast_1d(np.array(given, dtype=np.int64))
    bad = chosen[(chosen < 0) | (chosen >= count)]
    if bad.size:
        raise InputError(
            f" = {show(given)}: {what} {bad[0]} is out of range; this structure has {what}s 0 to "
            f"{count - 1}",
            field,
        )
    return chosen


def refuse_linear(structure: Discretized, place: str, what: str) -> None:
    """Refuse parts that are not linear, such as stops, on superelements."""
    if structure.kind == "superelements":
        raise InputError(
            f"{place}: superelements are linear, and {what} are not; take bars and hinges or a "
            "shell"
        )


def check_nodes(name: str, nodes: Any) -> str | tuple[int, ...]:
    """Return a node selection as text or tuple of numbers; their range is not checked."""
    if isinstance(nodes, str):
        with given_as(name):
            return check_expression(nodes)
    return indices(name, nodes, "node", 'or a selection such as "xmin"')


def check_creases(name: str, creases: Any) -> str | tuple[int, ...]:
    """Return creases as a word or tuple of numbers; their range is not checked."""
    if isinstance(creases, str):
        if not creases.strip():
            raise InputError(
                f' = "{creases}": give crease numbers, as in [0, 1], or {_WORDS}', name
            )
        return creases
    return indices(name, creases, "crease", f"or {_WORDS}")


def resolve_creases(
    structure: Discretized, creases: Any, name: str = "creases"
) -> NDArray[np.int64]:
    """Numbers of creases of a structure from numbers or a word.

    Parameters
    ----------
    structure : Structure
        Its folds limit the numbers; words refer to assignments and families of its pattern.
    creases : str or tuple of int
        Creases as `check_creases` returns them; numbers are kept in the order given.
    name : str
        Name of the field for messages.

    Raises
    ------
    InputError
        The structure has no folds, a number is out of range, or a word means no crease.
    """
    count = len(structure.folds)
    if count == 0:
        raise InputError(
            f"{name} = {show(creases)}: this structure has no folds; give a pattern with creases"
        )
    if not isinstance(creases, str):
        return in_range(name, creases, count, "crease")
    if structure.pattern is None:
        raise InputError(
            f'{name} = "{creases}": this structure has no pattern with assignments; give crease '
            "numbers"
        )
    return crease_rows(name, creases, structure.pattern)


Nodes = Annotated[int | str | Sequence[int], Check(check_nodes)]
Creases = Annotated[int | str | Sequence[int], Check(check_creases)]


PAIRS = 'pairs of vertices, as in [[0, 1], [1, 2]], or a selection such as "xmin"'


def check_edges(name: str, edges: Any) -> str | tuple[tuple[int, int], ...]:
    """Return edges as text or tuple of pairs (low, high); their range is not checked."""
    if isinstance(edges, str):
        return str(check_nodes(name, edges))
    given = listed(name, edges, PAIRS)
    if not given:
        raise InputError(f" = {show(edges)}: give {PAIRS}", name)
    pairs = []
    for k, edge in enumerate(given):
        ends = indices(f"{name}[{k}]", edge, "vertex", "the two ends of an edge")
        if len(ends) != 2:
            raise InputError(f" = {show(edge)}: give {PAIRS}", f"{name}[{k}]")
        if edge_of(*ends) in pairs:
            raise InputError(f" = {show(edge)}: is listed twice", f"{name}[{k}]")
        pairs.append(edge_of(*ends))
    return tuple(pairs)


def resolve_edges(structure: Discretized, edges: Any, name: str) -> NDArray[np.int64]:
    """Nodes (k, p) along edges; p is 2, or the number of a shell's nodes along an edge.

    edges : from `check_edges`; a text selects edges by both of their ends.

    Raises
    ------
    InputError
        The pattern has no such edge.
    """
    if structure.pattern is None:
        raise InputError(
            f"{name} = {show(edges)}: this structure has no pattern with edges; give nodes"
        )
    if isinstance(edges, str):
        found = edges_between(structure, resolve_nodes(structure, edges, name))
        if not len(found):
            raise InputError(
                f' = "{edges}": selects no edge, which needs both of its ends; give {PAIRS}', name
            )
        return found
    along = structure.edge_nodes
    rows = edge_lookup(along[:, [0, -1]])
    for pair in edges:
        if pair not in rows:
            raise InputError(
                f" = {show(edges)}: the pattern has no edge from vertex {pair[0]} to {pair[1]}",
                name,
            )
    return along[[rows[pair] for pair in edges]]


def edges_between(structure: Discretized, nodes: NDArray) -> NDArray[np.int64]:
    """Nodes (k, p) along all edges with both ends among the given nodes."""
    along = structure.edge_nodes
    return along[np.isin(along[:, [0, -1]], nodes).all(axis=1)]


def check_panels(name: str, panels: Any) -> str | tuple[int, ...]:
    """Return "all" or a tuple of panel numbers; their range is not checked."""
    if isinstance(panels, str):
        if panels != "all":
            raise InputError(f' = {show(panels)}: give panel numbers, or "all"', name)
        return panels
    return indices(name, panels, "panel", 'or "all"')


def resolve_panels(structure: Discretized, panels: Any, name: str) -> NDArray[np.int64]:
    """Triangles (k,) of a structure in given panels, as `check_panels` returns them."""
    if not len(structure.triangles):
        raise InputError(f"{name} = {show(panels)}: this structure has no panels")
    if panels == "all":
        return np.arange(len(structure.triangles))
    chosen = in_range(name, panels, int(structure.triangle_panel.max()) + 1, "panel")
    return np.flatnonzero(np.isin(structure.triangle_panel, chosen))


Edges = Annotated[str | Sequence[Sequence[int]], Check(check_edges)]
Panels = Annotated[int | str | Sequence[int], Check(check_panels)]


def length_at_nodes(structure: Discretized, along: NDArray) -> NDArray[np.float64]:
    """Length (n,), m, of edges (k, p) per node: half of each piece for either end."""
    x, length = structure.nodes, np.zeros(len(structure.nodes))
    pieces = np.linalg.norm(np.diff(x[along], axis=1), axis=2)
    for ends in (along[:, :-1], along[:, 1:]):
        np.add.at(length, ends, 0.5 * pieces)
    return length


def area_at_nodes(structure: Discretized, triangles: NDArray) -> NDArray[np.float64]:
    """Area (n,), m2, of triangles (k,) per node: a third of a triangle for each corner."""
    corners = structure.triangles[triangles]
    area = 0.5 * np.linalg.norm(double_areas(structure.nodes, corners), axis=1)
    count = len(structure.nodes)
    return np.bincount(corners.ravel(), np.repeat(area / 3.0, 3), count).astype(float)


def tributary_area(structure: Discretized) -> NDArray[np.float64]:
    """Area (n,), m2, of the sheet that belongs to each vertex, independent of the model.

    The area of a panel is divided equally among its corners. Other nodes of a structure have no
    area. Without a pattern, a third of each triangle goes to each corner.
    """
    if structure.pattern is None:
        return area_at_nodes(structure, np.arange(len(structure.triangles)))
    area = np.zeros(len(structure.nodes))
    for face, whole in zip(structure.pattern.faces, structure.pattern.face_areas, strict=True):
        area[list(face)] += whole / len(face)
    return area
