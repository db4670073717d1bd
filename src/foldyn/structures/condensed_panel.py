"""A panel as a thin plate, condensed to its bends and the turns of its creased edges: scheme n5b8e.

The angles of a panel of m corners are the turns of its m spokes (none in a triangle) and, of each
edge that is a crease, the turn beta of the sheet there against the facet of the spokes at that
edge, averaged along the edge. Their energy 1/2 phi^T K phi is the least that a plate can have which
goes through the corners and the center, keeps its straight edges straight and has these mean turns;
other edges are free. An edge along which the sheet runs on into the next panel also has a bow: the
mean distance of the sheet from the line between its ends, over its length. The plate is made of
triangles of constant curvature (Morley; in `mechanics.triangle`), twice, and K extrapolated in
their size.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.mechanics.triangle import triangle_stiffness

COARSE, FINE = 8, 16  # pieces of each edge in the two meshes
DIGITS = 9  # to which panels have the same shape
Rows = tuple[tuple[float, float], ...]


class Outline(NamedTuple):
    """A panel: corners in its plane, counter-clockwise from the front, and how its edges are held.

    Edge k runs from corner k to corner k + 1.
    """

    corners: Rows  # m
    center: tuple[float, float] | None  # m; None in a triangle
    creased: tuple[bool, ...]
    straight: tuple[bool, ...]
    bowed: tuple[bool, ...]


def outline(
    x: NDArray,
    center: NDArray | None,
    creased: list[bool],
    straight: list[bool],
    bowed: list[bool] | None = None,
) -> Outline:
    """Outline of a panel with corners x (m, 3), of size 1 with its first edge along an axis."""
    bowed = [False] * len(x) if bowed is None else bowed
    middle = x.mean(axis=0)
    points = x if center is None else np.concatenate([x, center[None]])
    _, _, axes = np.linalg.svd(x - middle)
    normal = np.cross(x - middle, np.roll(x, -1, axis=0) - middle).sum(axis=0)
    plane = axes[:2] if np.cross(axes[0], axes[1]) @ normal > 0.0 else axes[1::-1]
    flat = (points - middle) @ plane.T
    edge = flat[1] - flat[0]
    e = edge / np.linalg.norm(edge)
    flat = flat @ np.array([[e[0], -e[1]], [e[1], e[0]]]) / np.sqrt(np.linalg.norm(normal))
    rows = tuple((float(a), float(b)) for a, b in flat.round(DIGITS) + 0.0)
    corners, middle = rows[: len(x)], None if center is None else rows[-1]
    return Outline(corners, middle, tuple(creased), tuple(straight), tuple(bowed))


@lru_cache(maxsize=4096)
def panel_stiffness(panel: Outline, poissons_ratio: float) -> NDArray:
    """Stiffness (q, q) of a panel's angles over its bending stiffness E t^3/(12 (1 - nu^2)).

    The angles: turns of the spokes, in the order of the corners (none in a triangle), then of the
    creased edges, then the bows, in their order. A turn is the increase of a dihedral, seen from
    the front, and a bow positive towards it.
    """
    coarse, fine = (_condensed(panel, poissons_ratio, n) for n in (COARSE, FINE))
    ratio = (FINE / COARSE) ** 2
    stiffness = fine + (fine - coarse) / (ratio - 1.0)
    x = np.array(panel.corners)
    points = x if panel.center is None else np.concatenate([x, [panel.center]])
    corners = len(x)
    edges = np.flatnonzero(panel.creased)
    held = np.eye(len(stiffness))  # of heights, turns beta and bows
    turning = slice(len(points), len(points) + len(edges))
    held[turning, : len(points)] = _facet_slopes(points, corners)[edges]
    held[turning, turning] *= -1.0
    stiffness = held.T @ stiffness @ held
    spokes = _spoke_turns(points, corners) if panel.center else np.zeros((0, len(points)))
    others = len(stiffness) - len(points)
    turned = np.zeros((len(stiffness), len(spokes) + others))
    turned[: len(points), : len(spokes)] = np.linalg.pinv(spokes, rcond=1e-9)
    turned[len(points) :, len(spokes) :] = np.eye(others)
    out = turned.T @ stiffness @ turned
    out = 0.5 * (out + out.T)
    out.setflags(write=False)
    return out


def _facets(points: NDArray, corners: int) -> list[tuple[int, int, int]]:
    """Triangles of the panel: the one at edge k has the number k."""
    if len(points) == corners:
        return [(0, 1, 2)] * 3
    return [(k, (k + 1) % corners, corners) for k in range(corners)]


def _gradient(points: NDArray) -> NDArray:
    """Rows (2, 3): slopes of the plane over three points (3, 2) for heights there."""
    inverse = np.linalg.inv(points[1:] - points[0])
    return np.column_stack([-inverse.sum(axis=1), inverse])


def _facet_slopes(points: NDArray, corners: int) -> NDArray:
    """Outward slopes (m, points) of the facets across their edges, for heights of the points."""
    slopes = np.zeros((corners, len(points)))
    for k, facet in enumerate(_facets(points, corners)):
        along = points[(k + 1) % corners] - points[k]
        outward = np.array([along[1], -along[0]]) / np.linalg.norm(along)
        slopes[k, list(facet)] = outward @ _gradient(points[list(facet)])
    return slopes


def _spoke_turns(points: NDArray, corners: int) -> NDArray:
    """Turns (m, points) of the spokes for heights of the points."""
    turns = np.zeros((corners, len(points)))
    facets = _facets(points, corners)
    for k in range(corners):
        along = points[k] - points[corners]
        left = np.array([-along[1], along[0]]) / np.linalg.norm(along)
        for facet, sign in ((facets[k], -1.0), (facets[k - 1], 1.0)):
            turns[k, list(facet)] += sign * left @ _gradient(points[list(facet)])
    return turns


def _condensed(panel: Outline, poissons_ratio: float, n: int) -> NDArray:
    """Stiffness of the heights of corners and center, mean outward slopes of creases, and bows."""
    plate = _Plate(panel, poissons_ratio, n)
    return plate.solved([*plate.heights, *plate.slopes, *plate.bows])[1]


class _Plate:
    """A panel as a plate of small triangles; n pieces of each edge, G = 1.

    Its unknowns are heights of the points, then slopes across the sides. `heights` (of corners and
    center), `slopes` (mean, outward, of creased edges), `bows` and `lines` (of points on straight
    edges off the line between its ends) are linear functions of them: coefficients by number.
    """

    def __init__(self, panel: Outline, poissons_ratio: float, n: int) -> None:
        x = np.array(panel.corners)
        self.points, self.triangles, at, edges = _meshed(x, panel.center, n)
        side, sign, ends = _sides(self.triangles)
        self.stiffness = _plate(self.points, self.triangles, side, sign, poissons_ratio)
        number = {pair: len(self.points) + k for k, pair in enumerate(map(tuple, ends.tolist()))}
        self.heights = [{node: 1.0} for node in at.tolist()]
        self.slopes, self.bows, self.lines = [], [], []
        for k, nodes in enumerate(edge.tolist() for edge in edges):
            if panel.creased[k]:
                mean = {
                    number[min(a, b), max(a, b)]: (1.0 if a < b else -1.0) / n
                    for a, b in pairwise(nodes)
                }
                self.slopes.append(mean)
            if panel.bowed[k]:
                share = 1.0 / (n * float(np.linalg.norm(x[k] - x[(k + 1) % len(x)])))
                ends = 0.5 * (1 - n) * share  # the line between them takes them off
                inner = {node: share for node in nodes[1:-1]}
                self.bows.append({nodes[0]: ends, nodes[-1]: ends, **inner})
            if panel.straight[k]:
                for step in range(1, n):
                    part = step / n
                    self.lines.append({nodes[step]: 1.0, nodes[0]: part - 1.0, nodes[-1]: -part})

    def solved(self, held: list[dict[int, float]]) -> tuple[NDArray, NDArray]:
        """Unknowns (size, k) where one of the k held functions is 1; the stiffness (k, k).

        The heights come first among the held functions: with them the rest is positive definite.
        """
        size, count = len(self.stiffness.indptr) - 1, len(self.heights)
        first = np.array([next(iter(entries)) for entries in self.heights])
        others = np.setdiff1d(np.arange(size), first)
        inner = sparse.csc_array(self.stiffness[others][:, others])
        factor = splu(inner, "MMD_AT_PLUS_A", 0.0, options={"SymmetricMode": True})
        rows = _rows([*held[count:], *self.lines], size)
        both = self.stiffness[others][:, first].toarray()
        given, multipliers = rows[:, first].toarray(), rows[:, others]
        loose = factor.solve(np.column_stack([both, multipliers.T.toarray()]))
        # unknowns x = -loose_h h + loose_c m, where C x + C_h h = g
        moved, pulled = loose[:, :count], loose[:, count:]
        wanted = np.zeros((len(given), len(held)))
        wanted[:, :count] = multipliers @ moved - given
        wanted[: len(held) - count, count:] = np.eye(len(held) - count)
        force = np.linalg.solve(multipliers @ pulled, wanted)
        found = np.zeros((size, len(held)))
        found[first, :count] = np.eye(count)
        found[others] = pulled @ force
        found[others, :count] -= moved
        return found, found.T @ (self.stiffness @ found)


def _rows(functions: list[dict[int, float]], size: int) -> sparse.csr_array:
    """Rows (k, size) of linear functions, given by their coefficients."""
    row = np.repeat(np.arange(len(functions)), [len(entries) for entries in functions])
    column = [place for entries in functions for place in entries]
    value = [factor for entries in functions for factor in entries.values()]
    return sparse.csr_array((value, (row, column)), shape=(len(functions), size))


@lru_cache(maxsize=4096)
def panel_mass(panel: Outline, poissons_ratio: float) -> NDArray:
    """Mass matrix (points, points) of a panel of mass 1 that follows its corners and center.

    As a plate at rest does, without moments at its edges; exact for what is linear over the panel.
    """
    coarse, fine = (_Plate(panel, poissons_ratio, n) for n in (COARSE, FINE))
    less, more = (
        _mass(plate.points, plate.triangles, plate.solved(plate.heights)[0])
        for plate in (coarse, fine)
    )
    out = more + (more - less) / ((FINE / COARSE) ** 2 - 1.0)
    # what is linear over the panel to the last digit, as its facets have it
    x = np.array([*panel.corners, panel.center] if panel.center else panel.corners)
    linear = np.column_stack([np.ones(len(x)), x])
    along = linear @ np.linalg.pinv(linear)
    facets = np.array(_facets(x, len(panel.corners)))[: None if panel.center else 1]
    out = out + along.T @ (_mass(x, facets, np.eye(len(x))) - out) @ along
    out = 0.5 * (out + out.T)
    out.setflags(write=False)
    return out


def _mass(points: NDArray, triangles: NDArray, heights: NDArray) -> NDArray:
    """Mass matrix (k, k) of shapes with heights (points or more, k) that triangles join."""
    shape, corners = heights[triangles], points[triangles]
    area = 0.5 * np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
    element = (np.ones((3, 3)) + np.eye(3)) / 12.0
    return np.einsum("tak,ab,tbl,t->kl", shape, element, shape, area / area.sum())


def _meshed(
    x: NDArray, center: tuple[float, float] | None, n: int
) -> tuple[NDArray, NDArray, NDArray, list[NDArray]]:
    """Points (p, 2), triangles, those at corners and center, and those along each edge."""
    points = x if center is None else np.concatenate([x, [center]])
    facets = [(0, 1, 2)] if center is None else _facets(points, len(x))
    i, j = (axis.ravel() for axis in np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij"))
    kept = i + j <= n
    i, j = i[kept], j[kept]  # parts of the way from the first corner to the others, in n-ths
    place = np.full((n + 1, n + 1), -1)
    place[i, j] = np.arange(len(i))
    up = np.argwhere(np.add.outer(np.arange(n + 1), np.arange(n + 1)) < n)
    down = up[up.sum(axis=1) < n - 1]
    small = np.concatenate(
        [
            np.stack([place[*(up + step).T] for step in ((0, 0), (1, 0), (0, 1))], axis=1),
            np.stack([place[*(down + step).T] for step in ((1, 0), (1, 1), (0, 1))], axis=1),
        ]
    )
    weights = np.column_stack([n - i - j, i, j]) / n
    everywhere = np.concatenate([weights @ points[list(facet)] for facet in facets])
    _, first, same = np.unique(everywhere.round(7), axis=0, return_index=True, return_inverse=True)
    same = same.ravel()
    triangles = np.concatenate([same[small + k * len(i)] for k in range(len(facets))])
    nodes = everywhere[first]

    def found(wanted: NDArray) -> NDArray:
        apart = np.linalg.norm(nodes[None] - wanted[:, None], axis=2)
        return apart.argmin(axis=1)

    steps = np.linspace(0.0, 1.0, n + 1)[:, None]
    edges = [found(a + steps * (b - a)) for a, b in zip(x, np.roll(x, -1, axis=0), strict=True)]
    return nodes, triangles, found(points), edges


def _sides(triangles: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Number and sign (nt, 3) of the triangles' sides, positive from low to high; ends (s, 2)."""
    pairs = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)
    ends, side = np.unique(np.sort(pairs, axis=2).reshape(-1, 2), axis=0, return_inverse=True)
    sign = np.where(pairs[:, :, 0] < pairs[:, :, 1], 1.0, -1.0)
    return side.reshape(-1, 3), sign, ends


def _plate(
    points: NDArray, triangles: NDArray, side: NDArray, sign: NDArray, poissons_ratio: float
) -> sparse.csr_array:
    """Stiffness of heights of the points and slopes across the sides, for G = 1."""
    corners = points[triangles]
    flat = np.concatenate([corners, np.zeros((*triangles.shape, 1))], axis=2)
    bending = triangle_stiffness(flat, poissons_ratio, 1.0, 1.0)[1]
    along = np.roll(corners, -1, axis=1) - corners
    outward = np.stack([along[:, :, 1], -along[:, :, 0]], axis=2)
    outward /= np.linalg.norm(along, axis=2)[:, :, None]
    inverse = np.linalg.inv(corners[:, 1:] - corners[:, :1])
    gradient = np.concatenate([-inverse.sum(axis=2, keepdims=True), inverse], axis=2)
    turns = np.zeros((len(triangles), 3, 6))  # of the sheet at each side, beta
    turns[:, :, :3] = -outward @ gradient
    turns[:, np.arange(3), 3 + np.arange(3)] = sign
    block = np.einsum("tka,tkl,tlb->tab", turns, bending, turns)
    dofs = np.concatenate([triangles, len(points) + side], axis=1)
    rows, columns = np.repeat(dofs, 6, axis=1).ravel(), np.tile(dofs, (1, 6)).ravel()
    size = len(points) + int(side.max()) + 1
    return sparse.csr_array(sparse.coo_array((block.ravel(), (rows, columns)), shape=(size, size)))
