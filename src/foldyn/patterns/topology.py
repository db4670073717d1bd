"""Faces as a graph: checked indices, edges, creases and a consistent winding."""

from __future__ import annotations

import operator
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, combinations, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from foldyn.errors import InputError
from foldyn.values import listed

Faces = tuple[tuple[int, ...], ...]
Edge = tuple[int, int]
SAME_DIRECTION = 1e-6  # rad: panels this little behind the first come before it
SAME_ANGLE = 1e-11  # rad: panels within this angle coincide, but for rounding


@dataclass(frozen=True, eq=False, repr=False)
class Topology:
    """How the faces of a pattern are connected.

    Attributes
    ----------
    faces : tuple of tuple of int
        The faces, consistently wound.
    flipped : tuple of bool
        For each face, whether the winding given was reversed.
    edges, creases, boundary : ndarray of int, shape (m, 2)
        All edges; edges of several faces, except welds; and edges of one face only. Each is a
        vertex pair (low, high), in lexicographic order. A junction, an edge of m > 2 faces, is m
        creases: one between each two neighbors in the order of angles about the edge.
    crease_faces : ndarray of int, shape (nc, 2)
        For each crease the face that runs low to high and the face that runs high to low; at
        junctions two faces of which the second is reached from the first by a turn about the edge,
        by the right-hand rule from low to high.
    crease_ways : ndarray of int, shape (nc, 2)
        1, or at junctions -1 for a first face that runs high to low, or a second face that runs low
        to high.
    welds, weld_faces, weld_ways : ndarray of int, shape (nw, 2)
        Like `creases`, `crease_faces` and `crease_ways`, for edges across which the sheet is
        continuous. A junction is m (m - 1) / 2 welds, of each two faces.
    """

    faces: Faces
    flipped: tuple[bool, ...]
    edges: NDArray[np.int64]
    boundary: NDArray[np.int64]
    creases: NDArray[np.int64]
    crease_faces: NDArray[np.int64]
    crease_ways: NDArray[np.int64]
    welds: NDArray[np.int64]
    weld_faces: NDArray[np.int64]
    weld_ways: NDArray[np.int64]


def checked_faces(faces: Any, n_vertices: int) -> Faces:
    """Faces as tuples of Python integers, each checked by itself and against the others.

    Parameters
    ----------
    faces : iterable of sequences of int
        Vertex numbers of each face, in order around it.
    n_vertices : int
        Number of vertices to which the faces may refer.

    Returns
    -------
    tuple of tuple of int
        The same faces.

    Raises
    ------
    InputError
        No face at all; a face that is not a sequence of integers, is too short, repeats a
        vertex, refers to a vertex that does not exist, or has the vertices of another face.
    """
    faces = listed("faces", faces, "faces, each a list of vertex numbers")
    result: list[tuple[int, ...]] = []
    seen: dict[tuple[int, ...], int] = {}
    for f, face in enumerate(faces):
        checked = _checked_face(f, face, n_vertices)
        first = seen.setdefault(tuple(sorted(checked)), f)
        if first != f:
            raise InputError(
                f"faces[{f}] = {list(checked)}: has the same vertices as faces[{first}]; "
                "keep only one of the two."
            )
        result.append(checked)
    if not result:
        raise InputError("faces is empty: a pattern needs at least one face.")
    return tuple(result)


def _checked_face(f: int, face: Any, n_vertices: int) -> tuple[int, ...]:
    numbers: list[int] = []
    for v in listed(f"faces[{f}]", face, "vertex numbers"):
        try:
            if isinstance(v, (bool, np.bool_)):
                raise TypeError
            numbers.append(operator.index(v))
        except TypeError:
            raise InputError(
                f"faces[{f}]: vertex number {v!r} is not an integer; "
                f"give integers from 0 to {n_vertices - 1}."
            ) from None
    for v in numbers:
        if not 0 <= v < n_vertices:
            raise InputError(
                f"faces[{f}] = {numbers}: vertex {v} does not exist; "
                f"with {n_vertices} vertices the numbers run from 0 to {n_vertices - 1}."
            )
    distinct = len(set(numbers))
    if distinct < 3:
        raise InputError(
            f"faces[{f}] = {numbers}: a face needs at least 3 distinct vertices, this has "
            f"{distinct}."
        )
    if distinct < len(numbers):
        twice = next(v for v in numbers if numbers.count(v) > 1)
        raise InputError(
            f"faces[{f}] = {numbers}: vertex {twice} occurs twice; list each corner once "
            "(the first is not repeated at the end)."
        )
    return tuple(numbers)


def build_topology(faces: Faces, vertices: NDArray, welds: Any = ()) -> Topology:
    """Edges, creases and a consistent winding of checked faces.

    Each part connected by edges of two faces is walked from its lowest-numbered face, whose winding
    stays; a neighbor that runs along the shared edge in the same direction is reversed. A reversed
    face keeps its first vertex: (v1, v2, v3, v4) becomes (v1, v4, v3, v2).

    Parameters
    ----------
    faces : tuple of tuple of int
        Faces that passed `checked_faces`.
    vertices : ndarray, shape (n, 3)
        Coordinates (m), for the order of faces at junctions.
    welds : sequence of (vertex, vertex)
        Edges of several faces across which the sheet is continuous.

    Returns
    -------
    Topology
        The wound faces and their edges.

    Raises
    ------
    InputError
        A one-sided surface, or a weld that is not an edge of several faces.
    """
    sizes = np.array([len(face) for face in faces])
    owner = np.repeat(np.arange(len(faces)), sizes)
    start = np.fromiter(chain.from_iterable(faces), np.int64, int(sizes.sum()))
    end, last = np.roll(start, -1), np.cumsum(sizes) - 1
    end[last] = start[last - sizes + 1]
    low, high = np.minimum(start, end), np.maximum(start, end)
    # Sorted by edge, so that equal edges are side by side, the one of the lower face first.
    order = np.argsort(low * len(vertices) + high, kind="stable")
    low, high, owner, start = low[order], high[order], owner[order], start[order]
    first = np.flatnonzero(np.r_[True, (np.diff(low) != 0) | (np.diff(high) != 0)])
    count = np.diff(np.r_[first, len(low)])
    edges = np.column_stack([low[first], high[first]])
    pairs = first[count == 2][:, None] + np.arange(2)
    forward = start == low
    clash = forward[pairs[:, 0]] == forward[pairs[:, 1]]
    reverse = _reversals(len(faces), owner[pairs], clash, edges[count == 2])
    turned = zip(faces, reverse, strict=True)
    wound = tuple((face[0], *face[:0:-1]) if turn else face for face, turn in turned)
    forward ^= reverse[owner]
    pairs = np.where(forward[pairs[:, :1]], pairs, pairs[:, ::-1])
    welded = _welded(welds, edges, count > 1)
    found, owners = [pairs], [np.flatnonzero(count == 2)]
    for k in np.flatnonzero(count > 2).tolist():
        sides = np.arange(first[k], first[k] + count[k])
        about = [wound[face] for face in owner[sides].tolist()]
        ring = sides[_ring(vertices, edges[k], about, forward[sides])].tolist()
        beside = combinations(ring, 2) if welded[k] else pairwise([*ring, ring[0]])
        found.append(np.array(list(beside)))
        owners.append(np.full(len(found[-1]), k))
    pairs, edge = np.concatenate(found), np.concatenate(owners)
    order = np.argsort(edge, kind="stable")
    pairs, edge = pairs[order], edge[order]
    ways = np.where(forward[pairs], 1, -1) * np.array([1, -1])
    on = welded[edge]  # rows of welds
    creases, joined = ((edges[edge[rows]], owner[pairs[rows]], ways[rows]) for rows in (~on, on))
    flipped = tuple(bool(turn) for turn in reverse)
    return Topology(wound, flipped, edges, edges[count == 1], *creases, *joined)


def _ring(
    vertices: NDArray, edge: NDArray, faces: Sequence[tuple[int, ...]], forward: NDArray
) -> NDArray[np.int64]:
    """Order (m,) of faces by their angle about an edge, from the first of them.

    forward : (m,) whether the faces run along the edge from its lower to its higher vertex.
    """
    axis = vertices[edge[1]] - vertices[edge[0]]
    axis = axis / max(float(np.linalg.norm(axis)), 1e-154)
    normals = []
    for face in faces:
        corners = vertices[list(face)] - vertices[edge[0]]
        normals.append(np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0))
    inward = np.where(forward, 1.0, -1.0)[:, None] * np.cross(normals, axis)
    sine, cosine = np.cross(inward[0], inward) @ axis, inward @ inward[0]
    angle = np.arctan2(sine, cosine) % (2.0 * np.pi)
    angle[angle > 2.0 * np.pi - SAME_DIRECTION] -= 2.0 * np.pi
    return np.lexsort((np.arange(len(faces)), (angle / SAME_ANGLE).round()))


def _welded(welds: Any, edges: NDArray, inner: NDArray) -> NDArray[np.bool_]:
    """Whether each edge (k,) is among the vertex pairs `welds`, all of which are `inner` (k,)."""
    row, chosen = edge_lookup(edges), np.zeros(len(edges), bool)
    for pair in listed("welds", welds, "pairs of vertices, as [(0, 1)]"):
        edge = vertex_pair("welds", pair)
        if edge not in row or not inner[row[edge]]:
            raise InputError(f": {edge} is not an edge of two panels; leave it out", "welds")
        chosen[row[edge]] = True
    return chosen


def _reversals(n_faces: int, pairs: NDArray, clash: NDArray, creases: NDArray) -> NDArray:
    """Whether to reverse each face, so that no two faces run along a crease the same way."""
    reverse = np.zeros(n_faces, dtype=bool)
    if not clash.any():
        return reverse
    for f, g, k, _ in walk(pairs, n_faces):
        reverse[g] = reverse[f] ^ clash[k]
    wrong = np.flatnonzero((reverse[pairs[:, 0]] ^ reverse[pairs[:, 1]]) != clash)
    if len(wrong):
        (a, b), (f, g) = creases[wrong[0]].tolist(), pairs[wrong[0]].tolist()
        raise InputError(
            f"faces: the surface has only one side (as a Moebius strip): no winding agrees on "
            f"both sides of edge ({a}, {b}) between faces {f} and {g}; cut it open along an "
            "edge by giving one of its faces vertices of its own."
        )
    return reverse


def walk(pairs: NDArray, count: int) -> Iterator[tuple[int, int, int, int]]:
    """Steps from face to face that reach all of `count` faces, across pairs (k, 2) of neighbors.

    Each part is walked from its lowest face, breadth first. A step is the face where it starts, the
    new face, the row of the pair, and 1, or -1 if it leads from the second to the first of a pair.
    """
    beside: list[list[tuple[int, int, int]]] = [[] for _ in range(count)]
    for row, (one, two) in enumerate(pairs.tolist()):
        beside[one].append((two, row, 1))
        beside[two].append((one, row, -1))
    reached = [False] * count
    for seed in range(count):
        queue = deque([] if reached[seed] else [seed])
        reached[seed] = True
        while queue:
            here = queue.popleft()
            for there, row, way in beside[here]:
                if not reached[there]:
                    reached[there] = True
                    yield here, there, row, way
                    queue.append(there)


def components(pairs: ArrayLike, count: int) -> NDArray[np.int64]:
    """Number of the connected part of each of `count` nodes, joined by pairs (k, 2)."""
    rows = np.asarray(pairs, np.int64).reshape(-1, 2)
    graph = coo_array((np.ones(len(rows)), (rows[:, 0], rows[:, 1])), (count, count))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def edge_lookup(edges: NDArray) -> dict[Edge, int]:
    """Row number of each (low, high) vertex pair."""
    return {(a, b): k for k, (a, b) in enumerate(edges.tolist())}


class Lines(NamedTuple):
    """The distinct pairs among vertex pairs, which repeat side by side at junctions."""

    first: NDArray[np.int64]  # (n,) first row of each
    number: NDArray[np.int64]  # (k,) of each row
    single: NDArray[np.bool_]  # (n,) whether no other row has the pair

    @classmethod
    def of(cls, pairs: NDArray) -> Lines:
        """Lines of pairs (k, 2)."""
        rows = np.reshape(pairs, (-1, 2))
        new = np.append(True, (rows[1:] != rows[:-1]).any(axis=1))[: len(rows)]
        first = np.flatnonzero(new)
        return cls(first, np.cumsum(new) - 1, np.diff(np.append(first, len(rows))) == 1)

    def letters(self, assignments: Sequence[str]) -> NDArray[np.str_]:
        """Letter of each line (n,), given those of creases (k,): "U" at junctions."""
        return np.where(self.single, np.array(assignments, dtype="U1")[self.first], "U")


def at_junctions(pairs: NDArray) -> NDArray[np.bool_]:
    """Mask (k,) of the vertex pairs (k, 2) that occur more than once, side by side."""
    lines = Lines.of(pairs)
    return ~lines.single[lines.number]


def edge_rows(edges: NDArray) -> dict[Edge, list[int]]:
    """All row numbers of each (low, high) vertex pair: several at junctions."""
    rows: dict[Edge, list[int]] = {}
    for k, (a, b) in enumerate(edges.tolist()):
        rows.setdefault((a, b), []).append(k)
    return rows


def edge_of(a: int, b: int) -> Edge:
    """Vertex pair (low, high) of an edge."""
    return (a, b) if a < b else (b, a)


def vertex_pair(field: str, key: Any) -> Edge:
    """Edge (low, high) of a pair of vertex numbers."""
    try:
        if isinstance(key, str):
            raise TypeError
        a, b = (operator.index(v) for v in key)
    except (TypeError, ValueError):
        raise InputError(f": key {key!r} is not a pair of vertices, as (0, 1)", field) from None
    return edge_of(a, b)


def around(face: Sequence[int]) -> Iterator[Edge]:
    """Pairs of neighboring corners around a face, in order."""
    return zip(face, (*face[1:], face[0]), strict=True)
