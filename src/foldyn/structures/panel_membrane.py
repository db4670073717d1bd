"""A panel's membrane, condensed to its corners.

The two panels at an edge of a folded sheet hold each other by shear: displacements along the edge
are linear between its ends. Across it, in the plane of its panel, an edge is free to bow, except
for the bending resistance of the panels: if it bows by w and the fold angle is phi, the neighbor's
edge deflects by w / sin(phi), and its own by w / tan(phi). With s the position along the edge, a
panel resists a deflection sin(q s) of its edge by

    D (1 - nu)(3 + nu)/2 q^3

per length, like the moment-free edge of a half plane (Kirchhoff). So edges of a nearly flat sheet
are straight, and edges of a folded sheet bow freely.

The in-plane stiffness at the corners, divided by E t, is computed on two meshes of quadratic
triangles and extrapolated in the triangle size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.algebra.condensing import Condensing
from foldyn.algebra.extrapolation import extrapolated
from foldyn.jit.eights import COUNT
from foldyn.mechanics.block_matrix import pairs_within
from foldyn.mechanics.triangle import PRODUCTS, add_triangles, squares
from foldyn.structures.graded import ROOM, Grading, graded
from foldyn.structures.panel_plate import Outline, across_edges, meshed, shared, sides_of, symmetric

COARSE, FINE = 4, 8  # pieces per edge in the two meshes; twice as many for triangular panels
RAYS = 2  # rays of a graded mesh in half a corner
STIFF = 1e3  # stiffness of rigid corners relative to the rest
WAVES = 2.0  # number of sine waves in an edge's bow, divided by length/radius
SLENDER = 2e-4  # radius/length below which no further waves are taken: panels hardly resist bows


class Kind(NamedTuple):
    """Data that determine a panel's membrane, except E t.

    Attributes
    ----------
    outline : Outline
        Outline of the panel; edges that are `straight` in it do not bow.
    poissons_ratio : float
    resistance : tuple of float
        For each bowing edge, the factor of q^3 in the module's formula, summed over both panels and
        divided by E t, in squared length units of the outline.
    grading : Grading, optional
        Given for a panel whose corners give way along its edges; corners are rigid within the
        radius.
    smooth : tuple of bool
        Corners where the sheet is smooth, which are not rigid; by default none is.
    """

    outline: Outline
    poissons_ratio: float
    resistance: tuple[float, ...]
    grading: Grading | None = None
    smooth: tuple[bool, ...] = ()

    @property
    def rigid(self) -> NDArray[np.bool_]:
        """Corners (m,) that are rigid within the radius."""
        return ~np.array(self.smooth or np.zeros(len(self.outline.corners)), bool)

    @property
    def topology(self) -> tuple:
        """Key that is equal for panels that are cut and condensed alike."""
        arcs = self.grading and self.grading.arcs
        panel = self.outline
        return len(panel.corners), panel.center is None, arcs, all(panel.straight)


@shared(lambda *given: Kind(*given).topology)
def membrane_stiffness(given: Sequence[tuple]) -> list[NDArray]:
    """Stiffness (2m, 2m), divided by E t, for in-plane displacements (x, y) of the m corners.

    The arguments are the fields of a `Kind`. With a grading the stiffness is (4m, 4m):
    displacements are followed by gives, for each edge in turn at its first and its last corner. A
    give is the slip of nearby points along the edge, away from the corner.
    """
    kinds = [Kind(*each) for each in given]
    if kinds[0].grading:
        return list(symmetric(_condensed(kinds, _graded(kinds))))
    more = 1 if kinds[0].outline.center else 2
    coarse, fine = (
        _condensed(kinds, [_even(kind.outline, more * n) for kind in kinds]) for n in (COARSE, FINE)
    )
    return list(symmetric(extrapolated(coarse, fine, FINE / COARSE)))


@dataclass(frozen=True, eq=False)
class Cut:
    """How panels are cut into quadratic triangles. Many panels share one cut.

    Attributes
    ----------
    ends : (s, 2)
        End points of the triangle sides; their midpoints follow the other points.
    elements : (nt, 6)
        Corners, and the midpoints of the sides from each corner to the next.
    at : (m,)
        The panel's corners.
    along : list of arrays
        Points on each edge, in order, without its ends.
    """

    ends: NDArray
    elements: NDArray
    at: NDArray
    along: list[NDArray]


class PanelMesh(NamedTuple):
    """Quadratic triangles of a panel."""

    x: NDArray  # (n, 2) corners and side midpoints of the triangles
    cut: Cut
    radius: float | None = None  # radius of the rigid corners, if corners give way


def _even(panel: Outline, n: int) -> PanelMesh:
    """A mesh with n pieces of each edge."""
    weights, cut = _evenly(len(panel.corners), panel.center is not None, n)
    return _quadratic(weights @ [*panel.corners, *([panel.center] if panel.center else [])], cut)


@lru_cache(maxsize=64)
def _evenly(corners: int, center: bool, n: int) -> tuple[NDArray, Cut]:
    """Weights (points, corners) of corners and center that give each point; the cut."""
    unit = np.eye(corners + center)
    weights, triangles, at, edges = meshed(unit[:corners], unit[-1] if center else None, n)
    return weights, _cut(len(weights), triangles, at[:corners], edges)


def grading_of(panel: Outline, radius: float) -> Grading:
    """Grading of a mesh toward corners, down to a radius or to what a short edge permits.

    Shells use the same grading (`structures.graded`).
    """
    corners = np.array(panel.corners)
    length = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    room = Grading(radius, 2, RAYS).reach(_pieces(corners)).min()
    return graded(length, RAYS, min(radius, 0.999 * room / ROOM, 0.5 * length.min() / ROOM))


def _pieces(corners: NDArray) -> NDArray:
    """Pieces (..., m, 4, 2) that panels (..., m, 2) are cut into, one at each corner."""
    middles = 0.5 * (corners + np.roll(corners, -1, axis=-2))
    mean = np.broadcast_to(corners.mean(axis=-2, keepdims=True), corners.shape)
    return np.stack([corners, middles, mean, np.roll(middles, 1, axis=-2)], axis=-2)


def _graded(kinds: Sequence[Kind]) -> list[PanelMesh]:
    """Meshes with equal numbers of arcs."""
    gradings = [kind.grading for kind in kinds if kind.grading]
    corners = np.array([kind.outline.corners for kind in kinds])
    radius = np.array([grading.radius for grading in gradings])[:, None, None]
    x = gradings[0]._replace(radius=1.0).points(_pieces(corners / radius))
    used, fans = _fans(corners.shape[1], gradings[0].arcs)
    points = np.concatenate([radius * x.reshape(len(x), -1, 2), corners], axis=1)[:, used]
    pairs = zip(points, gradings, strict=True)
    return [_quadratic(own, fans, grading.radius) for own, grading in pairs]


@lru_cache(maxsize=64)
def _fans(corners: int, arcs: int) -> tuple[NDArray, Cut]:
    """Points used by a graded mesh: indices in all points of pieces, then corners; the cut."""
    count = corners * arcs * (2 * RAYS + 1)
    node = np.arange(count).reshape(corners, arcs, -1)
    node[:, -1, RAYS] = node[0, -1, RAYS]  # the mean; two pieces share each cut
    node[:, -1, :RAYS:-1] = np.roll(node[:, -1, :RAYS], 1, axis=0)
    at = count + np.arange(corners)
    a, b, c, d = node[:, :-1, :-1], node[:, 1:, :-1], node[:, 1:, 1:], node[:, :-1, 1:]
    halves = [  # symmetric about the middle ray
        np.where((np.arange(2 * RAYS) < RAYS)[:, None], np.stack(one, -1), np.stack(other, -1))
        for one, other in (((a, b, d), (a, b, c)), ((b, c, d), (a, c, d)))
    ]
    halves = [half.reshape(-1, 3) for half in halves]
    tips = np.stack(np.broadcast_arrays(at[:, None], node[:, 0, :-1], node[:, 0, 1:]), axis=-1)
    triangles = np.concatenate([tips.reshape(-1, 3), *halves])
    edges = [
        np.array([at[k], *node[k, :, 0], *node[j, -2::-1, -1], at[j]])
        for k, j in enumerate(np.roll(np.arange(corners), -1))
    ]
    used, triangles = np.unique(triangles, return_inverse=True)
    edges = [np.searchsorted(used, edge) for edge in edges]
    at = np.searchsorted(used, at)
    return used, _cut(len(used), triangles.reshape(-1, 3), at, edges)


def _quadratic(points: NDArray, cut: Cut, radius: float | None = None) -> PanelMesh:
    """Mesh with midpoints of the triangle sides added."""
    return PanelMesh(np.concatenate([points, points[cut.ends].mean(axis=1)]), cut, radius)


def _cut(points: int, triangles: NDArray, at: NDArray, edges: list[NDArray]) -> Cut:
    """Cut with the given number of points, panel corners `at`, and `edges` with their ends."""
    side, _, ends = sides_of(triangles)
    along = [
        np.stack([between, edge[1:]], axis=1).ravel()[:-1]
        for edge, (between, _) in zip(edges, across_edges(edges, ends, points), strict=True)
    ]
    return Cut(ends, np.concatenate([triangles, points + side], axis=1), at, along)


class Unknowns(NamedTuple):
    """Unknowns that move the points of panels with the same cut.

    In order: the displacements (x, y) of inner points; the bows of edges, which are displacements
    of their points across them, from the line between the ends; the displacements of the corners;
    the gives.

    Attributes
    ----------
    starts : (n + 1,)
        Start of each point's entries in `number` and `axes`.
    number : (k,)
        Indices of the unknowns that move each point, in turn.
    axes : (k, 2)
        Directions in which the unknowns move the points; 0 at edges.
    along : list of arrays (points, j)
        Unknowns that move the points of each edge.
    bows : list of arrays (points,)
        Indices of the unknowns that are bows, for each edge.
    free, size : int
        Number of unknowns, without and with displacements and gives of the corners.
    """

    starts: NDArray
    number: NDArray
    axes: NDArray
    along: list[NDArray]
    bows: list[NDArray]
    free: int
    size: int


class Plan(NamedTuple):
    """Layout of the stiffness of all panels with the same cut.

    Attributes
    ----------
    unknowns : Unknowns
    places : see `add_triangles`
    bows : list of arrays
        Positions of the entries for each edge's bows: the lower half, by rows.
    condensing : Condensing
    """

    unknowns: Unknowns
    places: NDArray
    bows: list[NDArray]
    condensing: Condensing


def _unknowns(cut: Cut, bowing: bool, gives: bool) -> Unknowns:
    m, n, edges = len(cut.at), int(cut.elements.max()) + 1, np.concatenate(cut.along)
    inside = np.setdiff1d(np.arange(n), np.concatenate([cut.at, edges]))
    first, per_edge = 2 * len(inside), bowing + 4 + 2 * gives
    free = first + bowing * len(edges)
    counts = np.full(n, 2)
    counts[edges] = per_edge
    starts = np.append(0, np.cumsum(counts))
    number, axes = np.zeros(starts[-1], np.int64), np.zeros((starts[-1], 2))
    x = np.append(2 * np.arange(len(inside)), free + 2 * np.arange(m))
    for c in range(2):
        at = starts[np.append(inside, cut.at)] + c
        number[at], axes[at, c] = x + c, 1.0
    along, bows = [], []
    for k, points in enumerate(cut.along):
        corners = np.array([k, (k + 1) % m])
        moving = (2 * corners[:, None] + np.arange(2)).ravel()
        moving = np.append(moving, 2 * (m + k) + np.arange(2 * gives))
        along.append(starts[points][:, None] + np.arange(per_edge))
        number[along[k][:, bowing:]] = free + moving
        if bowing:
            bows.append(np.arange(first, first + len(points)))
            number[along[k][:, 0]] = bows[k]
            first += len(points)
    return Unknowns(starts, number, axes, along, bows, free, free + (4 if gives else 2) * m)


@lru_cache(maxsize=64)
def _plan(cut: Cut, bowing: bool, gives: bool) -> Plan:
    """Layout for a cut; edges bow unless all are straight."""
    unknowns = _unknowns(cut, bowing, gives)
    starts, size = unknowns.starts, unknowns.size
    # all ordered pairs of points of a triangle; the lower half of the matrix suffices
    one, other = pairs_within(cut.elements).T
    counts = np.diff(starts)
    each = counts[one] * counts[other]
    one, other, first = (np.repeat(k, each) for k in (one, other, np.cumsum(each) - each))
    row, column = np.divmod(np.arange(len(one)) - first, counts[other])
    row, column = unknowns.number[starts[one] + row], unknowns.number[starts[other] + column]
    lower = row >= column
    keys = [row[lower] * size + column[lower]]
    for own in unknowns.bows:
        i, j = np.tril_indices(len(own))
        keys.append(own[i] * size + own[j])
    found, place = np.unique(np.concatenate(keys), return_inverse=True)
    condensing = Condensing(np.stack(np.divmod(found, size), axis=1), size, size - unknowns.free)
    own, *bows = np.split(condensing.places[place], np.cumsum([*map(len, keys)])[:-1])
    places = np.full(len(row), -1, np.int32)
    places[lower] = COUNT * own
    return Plan(unknowns, places, bows, condensing)


def _condensed(kinds: Sequence[Kind], meshes: Sequence[PanelMesh]) -> NDArray:
    """Stiffness (c, 2m, 2m) of the corners of up to eight panels with the same cut; see `Kind`."""
    cut, some = meshes[0].cut, np.minimum(np.arange(COUNT), len(kinds) - 1)
    straight = np.array([kinds[k].outline.straight for k in some])
    gives = meshes[0].radius is not None
    plan = _plan(cut, not straight.all(), gives)
    x = np.stack([meshes[k].x for k in some], axis=-1)
    radius = np.array([meshes[k].radius or 0.0 for k in some])
    rigid = np.stack([kinds[k].rigid for k in some], axis=1)
    nu = np.array([kinds[k].poissons_ratio for k in some])
    numbers = np.zeros((plan.condensing.entries, COUNT))
    shapes = np.repeat(plan.unknowns.axes[:, :, None], COUNT, axis=2)
    for k, points in enumerate(cut.along):
        edge = _edge(x[points], x[cut.at[k]], x[cut.at[(k + 1) % len(cut.at)]])
        moves = _moves(edge, radius if gives else None, rigid[[k, (k + 1) % len(cut.at)]])
        if plan.bows:
            moves.insert(0, np.broadcast_to(edge.normal * ~straight[:, k], moves[0].shape))
            for lane, (kind, mesh) in enumerate(zip(kinds, meshes, strict=True)):
                own = len(points), float(edge.length[lane]), mesh.radius
                numbers[plan.bows[k], lane] = _bowing(kind, k, *own)
        shapes[plan.unknowns.along[k]] = np.stack(moves, axis=1)
    numbers[:, len(kinds) :] = numbers[:, len(kinds) - 1 : len(kinds)]
    stiffness = np.repeat(1.0 / (1.0 - nu[None] ** 2), len(cut.elements), axis=0)
    if gives:
        for corner, stiff in zip(cut.at, rigid, strict=True):
            stiffness[(cut.elements[:, :3] == corner).any(axis=1)] *= np.where(stiff, STIFF, 1.0)
    slopes = squares(x[cut.elements[:, :3]], stiffness)
    add_triangles(
        cut.elements, plan.unknowns.starts, plan.places, shapes.ravel(), slopes.ravel(), PRODUCTS,
        nu, numbers.reshape(-1),
    )  # fmt: skip
    return plan.condensing.left(numbers)[: len(kinds)]


class Edge(NamedTuple):
    """One edge in each of eight panels."""

    normal: NDArray  # (2, 8)
    tangent: NDArray
    length: NDArray  # (8,)
    place: NDArray  # (p, 8) positions of points, from its start


def _edge(x: NDArray, start: NDArray, end: NDArray) -> Edge:
    """Edge with points x (p, 2, 8), from `start` to `end` (2, 8)."""
    length = np.linalg.norm(end - start, axis=0)
    tangent = (end - start) / length
    normal = np.stack([-tangent[1], tangent[0]])
    return Edge(normal, tangent, length, ((x - start) * tangent).sum(axis=1))


def _moves(edge: Edge, radius: NDArray | None, rigid: NDArray) -> list[NDArray]:
    """Motions (p, 2, 8) of edge points: one per corner displacement x, y; one per give.

    Edges remain straight in these motions.

    radius : (8,), within which corners are rigid.
    rigid : (2, 8) mask of these corners; gives are cubic at others.
    """
    moves, gives = [], []
    within, half = np.where(rigid, 0.0 if radius is None else radius, 0.0), 0.5 * edge.length
    for k, (sign, far) in enumerate(((1.0, edge.place), (-1.0, edge.length - edge.place))):
        share = 1.0 - far / edge.length
        between = edge.length - within[0] - within[1]
        slid = 1.0 - np.clip((far - within[k]) / between, 0.0, 1.0)
        for c in range(2):
            across, along = edge.normal[c] * edge.normal, edge.tangent[c] * edge.tangent
            moves.append(share[:, None] * across + slid[:, None] * along)
        if radius is not None:
            held = np.log(np.maximum(far, radius) / half) / np.log(radius / half)
            near = np.where(rigid[k], slid - np.maximum(held, 0.0), (1.0 - share) * share**2)
            gives.append(sign * near[:, None] * edge.tangent)
    return moves + gives


def _bowing(kind: Kind, k: int, points: int, length: float, radius: float | None) -> NDArray:
    """Stiffness matrix of the bows of edge k, which has `points` points: lower triangle, by rows.

    Bows of a straight edge have the stiffness 1; they move nothing.
    """
    if kind.outline.straight[k]:
        return np.eye(points)[np.tril_indices(points)]
    if kind.resistance[k] == 0.0:
        return np.zeros(points * (points + 1) // 2)
    part = None if radius is None else float(f"{radius / length:.12g}")
    return kind.resistance[k] / length**2 * _waves(points, part)


@lru_cache(maxsize=256)
def _waves(points: int, radius: float | None) -> NDArray:
    """Bow stiffness of an edge of length and resistance 1, with sine waves as bows.

    radius : radius of the `Grading` that places the points; without it they are equidistant.
    """
    fade, number = 1.0, np.arange(1, points + 1)
    if radius is None:
        shapes = 2.0 / (points + 1) * np.sin(np.outer(np.pi * number, number / (points + 1)))
    else:  # bows that are linear between the points
        nodes = np.concatenate([[0.0], Grading(radius, (points + 1) // 4, RAYS).places(1.0), [1.0]])
        at = np.interp(np.arange(0, len(nodes) - 0.75, 0.5), np.arange(len(nodes)), nodes)
        count = WAVES / max(radius, SLENDER)
        number = np.arange(1, int(np.ceil(1.5 * count)))
        half = np.sin(np.outer(np.pi * number, at[: len(nodes)]))
        mirrored = (-1.0) ** (number[:, None] + 1) * half[:, -2::-1]
        kinks = np.diff(np.diff(np.eye(len(at)), axis=0) / np.diff(at)[:, None], axis=0)
        shapes = np.concatenate([half, mirrored], axis=1) @ kinks.T
        shapes *= -2.0 / (np.pi * number[:, None]) ** 2
        # the shortest waves fade out, so that the stiffness is continuous in the length
        part = np.clip(1.5 - number / count, 0.0, 1.0)
        fade = part**2 * (3.0 - 2.0 * part)
    shapes = shapes * np.sqrt(0.5 * fade * (np.pi * number) ** 3)[:, None]
    return (shapes.T @ shapes)[np.tril_indices(points)]
