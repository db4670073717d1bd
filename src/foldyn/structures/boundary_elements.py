"""Boundary elements of the fluid on a sheet: panels as grids of squares, each two triangles.

A panel has a grid at each corner, bounded by the corner, the midpoints of its two edges and the
center. At an open edge the jump of the potential vanishes like the square root of the distance, so
grids are graded there, like 1 - cos(pi i / 2m); the error then falls with the square of the number
of elements along an edge.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.errors import InputError
from foldyn.patterns.pattern import Pattern, refuse_junctions
from foldyn.patterns.topology import edge_lookup, edge_of
from foldyn.structures.discretized import Discretized

ROUNDING = 1e-9  # smaller weights, and areas relative to squared lengths, count as zero


class BoundaryElements(NamedTuple):
    """Triangles on a sheet, in pairs, whose corners move with the sheet's nodes.

    Attributes
    ----------
    weights : sparse array, shape (p, n)
        Positions of the p corners of all elements are these weights times nodal positions.
    triangles : ndarray of int, shape (t, 3)
        Corners of each element, counter-clockwise from the front.
    panel : ndarray of int, shape (t,)
    unknown : ndarray of int, shape (p,)
        Index of each corner with a potential jump, -1 on open edges.
    element : ndarray of int, shape (k,)
        Index of an element, once for each triangle of the structure that contains the element's
        center: twice if the center lies between two triangles, so that numbering has no influence.
    under : ndarray of int, shape (k,)
        The triangle of the structure that contains the center of `element`.
    shares : ndarray, shape (k, 3)
        Weights of the nodes of `under` at the center; they add up to 1 per element.
    """

    weights: sparse.csr_array
    triangles: NDArray[np.int64]
    panel: NDArray[np.int64]
    unknown: NDArray[np.int64]
    element: NDArray[np.int64]
    under: NDArray[np.int64]
    shares: NDArray[np.float64]


class _Corners(NamedTuple):
    """Corners (c,) of all panels, each with an adjacent grid."""

    panel: NDArray
    vertex: NDArray  # number of the point
    ahead: NDArray  # index of the edge to the next corner; `behind`: from the previous one
    behind: NDArray
    before: NDArray  # index of the previous corner
    starts: tuple[NDArray, NDArray]  # whether these two edges are numbered from this corner
    open: tuple[NDArray, NDArray]  # whether `ahead` and `behind` are open edges of the sheet
    graded: tuple[NDArray, NDArray]  # whether the grid along them is graded toward this corner
    rim: NDArray  # whether the vertex is on an open edge of the sheet
    edges: int


def boundary_elements(
    structure: Discretized, resolution: int, alone: bool = False
) -> BoundaryElements:
    """Boundary elements of a structure, or shell.

    Parameters
    ----------
    structure : Structure
    resolution : int
        Elements along each edge of a panel, even.
    alone : bool
        Whether each panel is treated alone, with open edges all around.

    Raises
    ------
    InputError
        A structure without a pattern or with thick panels, a panel that is not convex, a sheet
        without an open edge, or with edges of more than two panels.
    """
    pattern = structure.pattern
    if pattern is None or pattern.boards is not None:
        raise InputError(": added mass needs a pattern of thin panels; leave it out", "air")
    if not len(pattern.boundary) and not alone:
        raise InputError(
            ": the sheet encloses a volume, from which the fluid cannot escape; open a panel, or "
            'give added_mass = "local"',
            "air",
        )
    if not alone:
        why = 'where the flow has several jumps; give added_mass = "local"'
        refuse_junctions(pattern, why, "air")
    _check_convex(pattern)
    corners = _alone(_corners(pattern)) if alone else _corners(pattern)
    half = resolution // 2
    numbers, count = _numbered(corners, half, len(pattern.faces))
    triangles = _cut(numbers)
    panel = np.repeat(corners.panel, 2 * half * half)
    places, owner, edge = np.zeros((count, 3)), np.zeros(count, np.int64), np.zeros(count, bool)
    places[numbers] = _places(corners, half, structure)
    owner[numbers] = corners.panel[:, None, None]
    edge[corners.vertex] = corners.rim
    for side, opened in zip((numbers[:, 1:, 0], numbers[:, 0, 1:]), corners.open, strict=True):
        edge[side[opened]] = True
    unknown = np.where(edge, -1, np.cumsum(~edge) - 1)
    point, triangle, weight = _located(structure, places, owner)
    entries = weight.ravel(), (point.repeat(3), structure.triangles[triangle].ravel())
    weights = sparse.csr_array(entries, (count, len(structure.nodes)))
    weights.eliminate_zeros()
    on = _located(structure, places[triangles].mean(axis=1), panel)
    return BoundaryElements(weights, triangles, panel, unknown, *on)


def _check_convex(pattern: Pattern) -> None:
    for panel, face in enumerate(pattern.faces):
        sides = np.diff(pattern.vertices[[*face, face[0], face[1]]], axis=0)
        turns = np.cross(sides[:-1], sides[1:]) @ pattern.face_normals[panel]
        if (turns < -ROUNDING * (sides**2).sum(axis=1).max()).any():
            raise InputError(
                f": added mass needs convex panels, and panel {panel} is not; cut it (fd.convex)",
                "air",
            )


def _corners(pattern: Pattern) -> _Corners:
    sizes = np.array([len(face) for face in pattern.faces])
    panel = np.repeat(np.arange(len(sizes)), sizes)
    vertex = np.concatenate([np.array(face) for face in pattern.faces])
    first = np.repeat(np.cumsum(sizes) - sizes, sizes)
    place, size = np.arange(len(panel)) - first, sizes[panel]
    following, before = first + (place + 1) % size, first + (place - 1) % size
    number = edge_lookup(pattern.edges)
    pairs = zip(vertex.tolist(), vertex[following].tolist(), strict=True)
    ahead = np.array([number[edge_of(a, b)] for a, b in pairs])
    behind = ahead[before]
    edge_open = np.zeros(len(pattern.edges), bool)
    edge_open[[number[edge_of(a, b)] for a, b in pattern.boundary.tolist()]] = True
    rim = np.zeros(len(pattern.vertices), bool)
    rim[pattern.boundary] = True
    single = np.bincount(vertex, minlength=len(rim)) == 1
    opened = edge_open[ahead], edge_open[behind]
    ends = rim[vertex]
    return _Corners(
        panel, vertex, ahead, behind, before,
        starts=(vertex < vertex[following], vertex < vertex[before]),
        open=opened,
        graded=tuple(ends & (~one | single[vertex]) for one in opened),
        rim=ends,
        edges=len(pattern.edges),
    )  # fmt: skip


def _alone(corners: _Corners) -> _Corners:
    """Corners with separate vertices and edges for each panel."""
    number = np.arange(len(corners.panel))
    yes = np.ones(len(number), bool)
    return corners._replace(
        vertex=number, ahead=number, behind=corners.before, starts=(yes, ~yes),
        open=(yes, yes), graded=(yes, yes), rim=yes, edges=len(number),
    )  # fmt: skip


def _numbered(corners: _Corners, half: int, panels: int) -> tuple[NDArray, int]:
    """Indices (c, half + 1, half + 1) of the points of each grid, and their number.

    Vertices come first, then points on edges, points on the spokes from midpoints of edges to
    centers, centers, and points inside grids.
    """
    count, inside = len(corners.panel), np.arange(1, half)
    middles = int(corners.vertex.max()) + 1
    sides = middles + corners.edges
    spokes = sides + 2 * corners.edges * len(inside)
    centers = spokes + count * len(inside)
    grids = centers + panels
    out = np.empty((count, half + 1, half + 1), np.int64)
    out[:, 0, 0], out[:, half, half] = corners.vertex, centers + corners.panel
    out[:, half, 0], out[:, 0, half] = middles + corners.ahead, middles + corners.behind
    ends = [
        sides + (2 * edge + ~starts)[:, None] * len(inside) + inside - 1
        for edge, starts in zip((corners.ahead, corners.behind), corners.starts, strict=True)
    ]
    out[:, inside, 0], out[:, 0, inside] = ends
    both = np.arange(count), corners.before
    ways = [spokes + corner[:, None] * len(inside) + inside - 1 for corner in both]
    out[:, half, inside], out[:, inside, half] = ways
    own = grids + np.arange(count * len(inside) ** 2)
    out[:, 1:half, 1:half] = own.reshape(count, len(inside), len(inside))
    return out, grids + own.size


def _places(corners: _Corners, half: int, structure: Discretized) -> NDArray:
    """Positions (c, half + 1, half + 1, 3) of the points of each grid at rest, m."""
    steps = np.arange(half + 1) / half
    by_kind = np.array([steps, 1.0 - np.cos(0.5 * np.pi * steps)])  # even, graded
    bottom, left = (by_kind[graded.astype(int)] for graded in corners.graded)
    right, top = (by_kind[opened.astype(int)] for opened in corners.open)
    change, turn = (top - bottom)[:, :, None], (right - left)[:, None, :]
    u = (bottom[:, :, None] + left[:, None, :] * change) / (1.0 - change * turn)
    v = left[:, None, :] + u * turn
    pattern, nodes = structure.pattern, structure.nodes
    vertex = np.concatenate([np.array(face) for face in pattern.faces])
    here, last = nodes[vertex], nodes[vertex[corners.before]]
    following = np.empty_like(here)
    following[corners.before] = here
    centers = np.array([nodes[list(face)].mean(axis=0) for face in pattern.faces])
    known = structure.centers >= 0
    centers[known] = nodes[structure.centers[known]]
    weights = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v], axis=-1)
    ends = here, 0.5 * (here + following), centers[corners.panel], 0.5 * (here + last)
    return np.einsum("cijk,cka->cija", weights, np.stack(ends, axis=1))


def _cut(numbers: NDArray) -> NDArray:
    """Triangles (t, 3) of the grid squares, cut along alternating diagonals."""
    half = numbers.shape[1] - 1
    a, b = numbers[:, :-1, :-1], numbers[:, 1:, :-1]
    c, d = numbers[:, 1:, 1:], numbers[:, :-1, 1:]
    odd = (np.add.outer(np.arange(half), np.arange(half)) % 2 == 1)[None, :, :, None]
    one = np.where(odd, np.stack([a, b, c], axis=-1), np.stack([a, b, d], axis=-1))
    two = np.where(odd, np.stack([a, c, d], axis=-1), np.stack([b, c, d], axis=-1))
    return np.stack([one, two], axis=3).reshape(-1, 3)


def _located(structure: Discretized, points: NDArray, panel: NDArray) -> list[NDArray]:
    """Points (k,), the triangles (k,) of their panels in which they lie at rest, weights (k, 3).

    If a point lies in several triangles, each gets an equal share of its weight.
    """
    count, found = int(panel.max()) + 1, []
    for own, mine in zip(_by(panel, count), _by(structure.triangle_panel, count), strict=True):
        corner, one, two = np.moveaxis(structure.nodes[structure.triangles[mine]], 1, 0)
        sides = np.stack([one - corner, two - corner], axis=2)  # (t, 3, 2)
        away = points[own][:, None, :] - corner
        share = np.einsum("tij,ptj->pti", np.linalg.pinv(sides), away)
        each = np.concatenate([1.0 - share.sum(axis=2, keepdims=True), share], axis=2)
        least = each.min(axis=2)
        here, under = np.nonzero(least > least.max(axis=1, keepdims=True) - ROUNDING)
        weight = each[here, under]
        weight = np.where(weight > ROUNDING, weight, 0.0)
        whole = weight.sum(axis=1) * np.bincount(here)[here]
        found.append((own[here], mine[under], weight / whole[:, None]))
    return [np.concatenate(parts) for parts in zip(*found, strict=True)]


def _by(number: NDArray, count: int) -> list[NDArray]:
    """For each number from 0 to count - 1, its positions in the array `number`."""
    counts = np.bincount(number, minlength=count)
    return np.split(np.argsort(number, kind="stable"), np.cumsum(counts)[:-1])
