"""Panels cut into small triangles that share whole sides, also across creases.

A triangle has constant strains, from the lengths of its sides, and constant curvatures, from
rotations about them. With the unit tangents t_k and outward normals n_k of the sides (in the plane
of the triangle), their lengths L_k and the area A:

membrane   t_k . eps t_k = e_k,  e_k = (l_k^2 / L_k^2 - 1) / 2 the Green strain along side k,
bending    kappa = sum_k (L_k / A) beta_k n_k n_k^T,  beta_k the rotation, about side k, of the
           sheet at the middle of that side relative to the plane of the triangle

(Morley, Aeronaut. Quart. 19, 1968; for large rotations with hinges: Phaal and Calladine, Int. J.
Numer. Methods Eng. 35, 1992). Plane stress with E, nu, t gives energies e K_m e / 2 and
beta K_b beta / 2.

On a side shared by two triangles of one panel, and along a weld of two panels, the sheet is smooth:
with d the change of the dihedral there, the sheet turns by d/2 + x in one triangle and by d/2 - x
in the other, with x a rotation without mass. On a crease each triangle has its own rotation, x or
y, and the crease turns by the rest of the dihedral, d - x - y; at junctions of several panels x and
y have signs, and welds are as in `structures.edge_angles`. Free sides have no moment: their
rotation is eliminated in the triangle. A clamped side keeps its rest tangent in space: one wing of
its hinge is a point that is not a node and moves with the mean displacement of the side's ends. The
sides of rigid panels, which stay flat, have no rotations.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.mechanics.triangle import triangle_stiffness
from foldyn.patterns import Pattern
from foldyn.patterns.topology import Edge, around, at_junctions, edge_lookup, edge_of
from foldyn.structures import Sheet
from foldyn.structures.edge_angles import EdgePlates, weld_turns
from foldyn.structures.graded import Grading
from foldyn.structures.held_edges import opposite
from foldyn.structures.material_axes import material_axes
from foldyn.structures.mesh import CUT, Triangle, check_triangles

EQUAL = 1e-6  # diagonals with a smaller relative difference count as equal


@dataclass(frozen=True, eq=False)
class ShellMesh:
    """Triangles of all panels.

    Attributes
    ----------
    nodes : (n, 3)
        The pattern's vertices in order, then points of its edges, then points inside panels, m.
    triangles, panel : (nt, 3), (nt,)
        Counter-clockwise from the front, and the panel of each.
    edge_points : dict
        Nodes along each edge of the pattern, by (low, high) vertex, from low to high.
    """

    nodes: NDArray
    triangles: NDArray
    panel: NDArray
    edge_points: dict[Edge, list[int]]


class _Points:
    """Nodes of a mesh under construction."""

    def __init__(self, vertices: NDArray) -> None:
        self.all: list[NDArray] = list(vertices)

    def add(self, point: NDArray) -> int:
        self.all.append(point)
        return len(self.all) - 1

    def line(self, a: int, b: int, places: Iterable[float]) -> list[int]:
        """Nodes from a to b, both included, with new nodes at `places` in (0, 1) between them."""
        x, y = self.all[a], self.all[b]
        return [a, *(self.add(x + (y - x) * place) for place in places), b]


def shell_mesh(pattern: Pattern, divisions: int, graded: Grading | None = None) -> ShellMesh:
    """Cut every edge of a pattern into `divisions` pieces and its panels into triangles.

    Quadrilaterals get a grid whose cells are cut in two, triangles are divided evenly, and other
    polygons are first cut into triangles about the mean of their corners. A `graded` mesh cuts all
    panels alike, finer toward their corners.
    """
    points = _Points(pattern.vertices)
    even = [step / divisions for step in range(1, divisions)]
    edges = {}
    for low, high in pattern.lines.tolist():
        length = float(np.linalg.norm(pattern.vertices[high] - pattern.vertices[low]))
        edges[low, high] = points.line(low, high, graded.places(length) if graded else even)
    triangles, panels = [], []
    for number, face in enumerate(pattern.faces):
        sides = [side_between(edges, a, b) for a, b in around(face)]
        if graded:
            pieces = _graded(points, sides, graded)
        elif len(face) == 3:
            pieces = _divided(points, sides)
        elif len(face) == 4:
            pieces = _grid(points, sides)
        else:
            pieces = _fan(points, sides, even)
        triangles += pieces
        panels += [number] * len(pieces)
    nodes, rows, panel = np.array(points.all), np.array(triangles, np.int64), np.array(panels)
    remedy = f"the panel is not convex enough to be meshed; {CUT}"
    check_triangles(nodes, rows, panel, pattern, remedy)
    return ShellMesh(nodes, rows, panel, edges)


def side_between(edges: dict[Edge, list[int]], a: int, b: int) -> list[int]:
    """Nodes from vertex a to vertex b."""
    return edges[a, b] if a < b else edges[b, a][::-1]


def _grid(points: _Points, sides: list[list[int]]) -> list[Triangle]:
    """Triangles of a quadrilateral with sides 0-1, 1-2, 2-3, 3-0."""
    bottom, right, top, left = sides[0], sides[1], sides[2][::-1], sides[3][::-1]
    n = len(bottom) - 1
    p, q = points.all[bottom[0]], points.all[bottom[-1]]
    r, s = points.all[top[-1]], points.all[top[0]]
    node = np.empty((n + 1, n + 1), np.int64)
    node[:, 0], node[:, n], node[0], node[n] = bottom, top, left, right
    for i in range(1, n):
        for j in range(1, n):
            x, y = i / n, j / n
            node[i, j] = points.add((1 - y) * ((1 - x) * p + x * q) + y * ((1 - x) * s + x * r))
    return _halves(node, np.array([points.all[k] for k in node.ravel()]).reshape(n + 1, n + 1, 3))


def _halves(node: NDArray, x: NDArray) -> list[Triangle]:
    """Triangles of a grid of nodes (n + 1, n + 1) at x (n + 1, n + 1, 3).

    Each cell is cut at its shorter diagonal, so that the mesh has the symmetries of the panel; in
    cells with equal diagonals the cuts alternate.
    """
    a, b, c, d = node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]
    ac = np.linalg.norm(x[1:, 1:] - x[:-1, :-1], axis=2)
    bd = np.linalg.norm(x[:-1, 1:] - x[1:, :-1], axis=2)
    odd = np.indices(a.shape).sum(axis=0) % 2 == 1
    cut_bd = np.where(np.abs(ac - bd) <= EQUAL * ac, odd, bd < ac)[:, :, None]
    one = np.where(cut_bd, np.stack([a, b, d], 2), np.stack([a, b, c], 2))
    two = np.where(cut_bd, np.stack([b, c, d], 2), np.stack([a, c, d], 2))
    return list(map(tuple, np.stack([one, two], axis=2).reshape(-1, 3).tolist()))


def _divided(points: _Points, sides: list[list[int]]) -> list[Triangle]:
    """Triangles of a triangle with sides 0-1, 1-2, 2-0."""
    n = len(sides[0]) - 1
    p, q, r = (points.all[side[0]] for side in sides)
    node = {}
    for k in range(n + 1):
        node[k, 0], node[n - k, k], node[0, n - k] = sides[0][k], sides[1][k], sides[2][k]
    for i in range(1, n):
        for j in range(1, n - i):
            node[i, j] = points.add(p + (q - p) * (i / n) + (r - p) * (j / n))
    out = []
    for i in range(n):
        for j in range(n - i):
            out.append((node[i, j], node[i + 1, j], node[i, j + 1]))
            if i + j < n - 1:
                out.append((node[i + 1, j], node[i + 1, j + 1], node[i, j + 1]))
    return out


def _fan(points: _Points, sides: list[list[int]], even: list[float]) -> list[Triangle]:
    """Triangles of a polygon, cut along spokes from its corners to their mean."""
    corners = [side[0] for side in sides]
    center = points.add(np.mean([points.all[k] for k in corners], axis=0))
    spokes = [points.line(k, center, even) for k in corners]
    out = []
    for k, side in enumerate(sides):
        out += _divided(points, [side, spokes[(k + 1) % len(sides)], spokes[k][::-1]])
    return out


def _graded(points: _Points, sides: list[list[int]], graded: Grading) -> list[Triangle]:
    """Triangles of a polygon, graded toward its corners."""
    center = points.add(np.mean([points.all[side[0]] for side in sides], axis=0))
    cuts = [points.line(side[graded.arcs], center, graded.steps) for side in sides]
    out = []
    for k, side in enumerate(sides):
        before = sides[k - 1][::-1]
        patch = [side[0], cuts[k][0], center, cuts[k - 1][0]]
        x = graded.points(np.array([points.all[corner] for corner in patch]))
        node = np.empty(x.shape[:2], np.int64)
        node[:, 0], node[:, -1] = side[1 : graded.arcs + 1], before[1 : graded.arcs + 1]
        node[-1] = [*cuts[k], *cuts[k - 1][-2::-1]]
        for i, j in np.ndindex(len(x) - 1, x.shape[1] - 2):
            node[i, j + 1] = points.add(x[i, j + 1])
        out += [(side[0], *pair) for pair in pairwise(node[0].tolist())]
        out += _halves(node, np.array([points.all[k] for k in node.ravel()]).reshape(x.shape))
    return out


class Sides(NamedTuple):
    """nt triangles with nh hinges, x rotations, c pieces of creases and g wings of clamped sides.

    Side k of a triangle runs from its corner k to k + 1; its rotation is
    beta = weight d[hinge] + sign x[rotation], where there is a hinge or a rotation (else -1).
    """

    hinges: NDArray  # (nh, 4) axis j, k, wings i, l: hinges of pieces of creases first, of clamped
    # sides last; wings with numbers from n on are no nodes
    hinge: NDArray  # (nt, 3)
    weight: NDArray  # (nt, 3)
    rotation: NDArray  # (nt, 3)
    sign: NDArray  # (nt, 3)
    free: NDArray  # (nt, 3) bool
    rotations: int
    piece_rotations: NDArray  # (c, 2) rotations of both sides, -1 for none
    piece_ways: NDArray  # (c, 2) 1, or at junctions -1 for rotations that open the crease
    piece_crease: NDArray  # (c,) number of the pattern's crease
    wings: NDArray  # (g, 3) positions of wings that are no nodes, m


def sides(
    mesh: ShellMesh, pattern: Pattern, clamped: Collection[Edge] = (), rigid: Collection[int] = ()
) -> Sides:
    """Find hinges and rotations of a mesh.

    clamped : boundary edges (low, high).
    rigid : numbers of rigid panels.
    """
    crease_of = {
        pair: number
        for edge, number in edge_lookup(pattern.creases).items()
        for pair in _pieces(mesh.edge_points[edge])
    }
    held = {pair for edge in clamped for pair in _pieces(mesh.edge_points[edge])}
    tri = mesh.triangles
    n, count = len(mesh.nodes), len(tri)
    a, b, third = tri.ravel(), np.roll(tri, -1, 1).ravel(), np.roll(tri, -2, 1).ravel()
    low, high = np.minimum(a, b), np.maximum(a, b)
    order = np.lexsort((a > b, high, low))  # the triangle that runs low to high comes first
    new = (low[order][1:] != low[order][:-1]) | (high[order][1:] != high[order][:-1])
    first = np.flatnonzero(np.append(True, new))
    times = np.diff(np.append(first, 3 * count))
    both = order[first[times == 2][:, None] + np.arange(2)]
    alone = np.sort(order[first[times == 1]])

    folded = mesh.panel[both[:, 0] // 3] != mesh.panel[both[:, 1] // 3]
    ends = np.stack([low, high], axis=1)
    folded[folded] = [pair in crease_of for pair in map(tuple, ends[both[folded, 0]].tolist())]
    smooth = both[~folded]
    creased = _Creased.between(both[folded], ends, crease_of)
    half, turned = np.full(smooth.shape, 0.5), np.ones(smooth.shape) * [1.0, -1.0]
    joined = _Joined(smooth, ends[smooth[:, 0]], half, turned, np.arange(len(smooth)))
    if (times > 2).any():
        creased, joined = _with_junctions(
            creased, joined, mesh, pattern, order[np.repeat(times > 2, times)], ends
        )
    # pieces of creases come first
    hinges = [np.column_stack([part.axis, third[part.sides]]) for part in (creased, joined)]
    hinge, rotation = np.full((2, 3 * count), -1)
    weight, sign = np.zeros((2, 3 * count))
    numbers = np.arange(len(creased.sides) + len(joined.sides))
    hinge[joined.sides] = numbers[len(creased.sides) :, None]
    weight[joined.sides], sign[joined.sides] = joined.weight, joined.sign
    rotation[joined.sides] = joined.rotation[:, None]
    turns = int(joined.rotation.max(initial=-1)) + 1
    own, place, which = np.unique(creased.sides, return_index=True, return_inverse=True)
    pieces = turns + np.argsort(np.argsort(place))[which].reshape(-1, 2)
    rotation[creased.sides], sign[creased.sides] = pieces, 1.0

    stiff = [k for k in alone.tolist() if (int(low[k]), int(high[k])) in held]
    wings = []
    for k in stiff:
        hinge[k], weight[k] = len(numbers) + len(wings), 1.0
        hinges.append(np.array([(a[k], b[k], third[k], n + len(wings))]))
        wings.append(opposite(mesh.nodes[[a[k], b[k], third[k]]]))
    free = np.zeros(3 * count, bool)
    free[alone] = True
    free[stiff] = False
    kept = np.ones(turns + len(own) + 1, bool)  # the last entry stands for none
    kept[rotation[np.repeat(np.isin(mesh.panel, list(rigid)), 3)]] = False
    number = np.where(kept, np.cumsum(kept) - 1, -1)
    number[-1] = -1
    rotation, pieces = number[rotation], number[pieces]
    sign[rotation < 0] = 0.0
    return Sides(
        hinges=np.concatenate(hinges).astype(np.int64),
        hinge=hinge.reshape(-1, 3),
        weight=weight.reshape(-1, 3),
        rotation=rotation.reshape(-1, 3),
        sign=sign.reshape(-1, 3),
        free=free.reshape(-1, 3),
        rotations=int(kept[:-1].sum()),
        piece_rotations=pieces,
        piece_ways=creased.ways,
        piece_crease=creased.crease,
        wings=np.array(wings).reshape(-1, 3),
    )


class _Creased(NamedTuple):
    """c pieces of creases."""

    sides: NDArray  # (c, 2) sides of triangles
    axis: NDArray  # (c, 2) nodes
    ways: NDArray  # (c, 2) see `Sides.piece_ways`
    crease: NDArray  # (c,)

    @classmethod
    def between(
        cls, both: NDArray, ends: NDArray, crease_of: dict[tuple[int, ...], int]
    ) -> _Creased:
        """Pieces between two sides each (c, 2), the first of which runs from low to high."""
        axis = ends[both[:, 0]]
        crease = np.array([crease_of[pair] for pair in map(tuple, axis.tolist())], np.int64)
        return cls(both, axis, np.ones(both.shape), crease)


class _Joined(NamedTuple):
    """s pairs of sides between which the sheet is smooth."""

    sides: NDArray  # (s, 2) sides of triangles
    axis: NDArray  # (s, 2) nodes
    weight: NDArray  # (s, 2) as in `Sides`
    sign: NDArray  # (s, 2) as in `Sides`
    rotation: NDArray  # (s,)


def _with_junctions(
    creased: _Creased, joined: _Joined, mesh: ShellMesh, pattern: Pattern, sides: NDArray,
    ends: NDArray,
) -> tuple[_Creased, _Joined]:  # fmt: skip
    """Add the pieces of junctions, at which the `sides` of triangles meet."""
    panels, pairs = mesh.panel[sides // 3].tolist(), ends[sides].tolist()
    each = zip(panels, pairs, sides.tolist(), strict=True)
    side_of = {(panel, *pair): side for panel, pair, side in each}

    def along(edge: Edge, one: int, two: int) -> list[tuple[list[int], Edge]]:
        """Sides of two panels at the pieces of an edge, and the nodes of these."""
        pieces = pairwise(mesh.edge_points[edge])
        return [([side_of[p, *edge_of(*piece)] for p in (one, two)], piece) for piece in pieces]

    folds, welds = [], []
    for k in np.flatnonzero(at_junctions(pattern.creases)).tolist():
        a, b = pattern.creases[k].tolist()
        for both, piece in along((a, b), *pattern.crease_faces[k].tolist()):
            folds.append((both, piece, pattern.crease_ways[k], k))
    turns, number = weld_turns(pattern), int(joined.rotation.max(initial=-1)) + 1
    shared: dict[Edge, int] = {}
    for k in np.flatnonzero(at_junctions(pattern.welds)).tolist():
        (a, b), (one, two) = pattern.welds[k].tolist(), pattern.weld_faces[k].tolist()
        row, share, way = turns[two, (a, b)]
        for both, piece in along((a, b), one, two) if row == k else ():
            rotation = shared.setdefault(piece, number + len(shared))
            welds.append((both, piece, (0.0, share), (1.0, way), rotation))

    return _after(creased, folds), _after(joined, welds)


def _after(own: Any, more: list[tuple[Any, ...]]) -> Any:
    """Rows of a named tuple of arrays, and more of them."""
    columns = zip(*more, strict=True) if more else (each[:0] for each in own)
    return type(own)(*map(np.concatenate, zip(own, map(np.array, columns), strict=True)))


def _pieces(points: list[int]) -> list[Edge]:
    """Pairs (low, high) of neighbors along an edge."""
    return [edge_of(a, b) for a, b in pairwise(points)]


def stiffness(
    corners: NDArray, panel: NDArray, sheet: Sheet, pattern: Pattern
) -> tuple[NDArray, NDArray]:
    """Membrane and bending stiffness (nt, 3, 3) of triangles (nt, 3, 3) in the panels (nt,)."""
    kinds, kind = sheet.kinds(len(pattern.faces))
    axes = material_axes(pattern, sheet)
    membrane, bending = np.empty((2, len(corners), 3, 3))
    for number, own in enumerate(kinds):
        rows = kind[panel] == number
        membrane[rows], bending[rows] = triangle_stiffness(
            corners[rows], own.stretching, own.bending, None if axes is None else axes[panel[rows]]
        )
    return membrane, bending


def triangle_plates(ends: Sides, bending: NDArray) -> tuple[EdgePlates, NDArray, NDArray]:
    """Triangles as plates; `bending` (nt, 3, 3) is the stiffness of rotations about their sides.

    Also returns, for each angle (nq,), the index of the side that the angle turns, 3 t + k for side
    k of triangle t, and the turn of this side per unit of the angle.
    """
    size = (len(bending), 6)
    angle = np.stack([ends.hinge, -1 - ends.rotation], axis=2).reshape(size)
    share = np.stack([ends.weight, ends.sign], axis=2).reshape(size)
    there, side = share != 0.0, np.repeat(np.arange(3), 2)
    whole = share[:, :, None] * bending[:, side][:, :, side] * share[:, None]
    count = there.sum(axis=1)
    at = np.zeros(ends.rotations, np.int64)
    smooth = (ends.hinge >= 0) & (ends.rotation >= 0)
    at[ends.rotation[smooth]] = ends.hinge[smooth]
    piece, beside = np.nonzero(ends.piece_rotations >= 0)
    at[ends.piece_rotations[piece, beside]] = piece
    plates = EdgePlates(
        rotation_hinge=at,
        fold_rotations=ends.piece_rotations,
        fold_ways=ends.piece_ways,
        start=np.concatenate([[0], np.cumsum(count)]),
        angle=angle[there],
        entry=np.concatenate([[0], np.cumsum(count**2)]),
        stiffness=whole[there[:, :, None] & there[:, None]],
    )
    return plates, (3 * np.arange(len(bending))[:, None] + side)[there], share[there]


def without_free_sides(bending: NDArray, free: NDArray) -> NDArray:
    """Bending stiffness (nt, 3, 3) without moment about the sides `free` (nt, 3)."""
    out = bending.copy()
    for k in range(3):
        rows = np.flatnonzero(free[:, k])
        part = out[rows]
        column = part[:, :, k]
        pivot = np.where(column[:, k] > 0.0, column[:, k], 1.0)
        part = part - np.einsum("ti,tj->tij", column, column) / pivot[:, None, None]
        part[:, k, :] = part[:, :, k] = 0.0
        out[rows] = part
    return out
