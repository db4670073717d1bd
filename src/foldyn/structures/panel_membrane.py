"""A panel's membrane, condensed to its corners.

Along an edge the two panels of a folded sheet hold each other by shear: displacements there are
linear between its ends. Across it, in the plane of its panel, an edge is free to bow, but for what
the panels resist in bending: where it bows by w and the fold angle is phi, the neighbor's edge
deflects by w / sin(phi), and its own by w / tan(phi). A panel resists a deflection
sin(q s) of its edge, s along it, by

    D (1 - nu)(3 + nu)/2 q^3

per length, as the edge of a half plane without moment there does (Kirchhoff). In a sheet that is
nearly flat edges so become straight; in a folded one they bow freely.

The membrane is made of quadratic triangles, twice, and its stiffness extrapolated in their size: as
the corners feel it, in the plane, over E t.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.algebra.extrapolation import extrapolated
from foldyn.structures.graded import ROOM, Grading, graded
from foldyn.structures.panel_plate import Outline, meshed

COARSE, FINE = 4, 8  # pieces of each edge in the two meshes; twice as many in triangles
RAYS = 2  # of a graded mesh, in half a corner
STIFF = 1e3  # times as stiff as the rest: rigid corners
WAVES = 2.0  # in a bow of an edge, for each of its radii
MIDDLES = 0.5 * (np.ones((3, 3)) - np.eye(3))  # of the sides: three points integrate exactly


@lru_cache(maxsize=4096)
def membrane_stiffness(
    panel: Outline, poissons_ratio: float, resistance: tuple[float, ...]
) -> NDArray:
    """Stiffness (2m, 2m) over E t of the displacements (x, y) of the m corners in the plane.

    Parameters
    ----------
    panel : Outline
        Its straight edges do not bow.
    poissons_ratio : float
    resistance : tuple of float
        What q^3 is multiplied by above, over E t, of both panels at each other edge: in the unit
        of length of the outline, squared.
    """
    more = 1 if panel.center else 2
    coarse, fine = (
        _condensed(panel, poissons_ratio, resistance, _even(panel, more * n))
        for n in (COARSE, FINE)
    )
    return _symmetric(extrapolated(coarse, fine, FINE / COARSE))


@lru_cache(maxsize=4096)
def giving_stiffness(
    panel: Outline, poissons_ratio: float, resistance: tuple[float, ...], radius: float
) -> NDArray:
    """The same (4m, 4m) of corners that give way along their edges, rigid within a radius.

    After the displacements of the corners come the gives: of each edge in turn, at its first and
    at its last corner, how far the points near it slide along the edge, away from the corner.
    """
    return _symmetric(_condensed(panel, poissons_ratio, resistance, _graded(panel, radius)))


def _symmetric(stiffness: NDArray) -> NDArray:
    stiffness = 0.5 * (stiffness + stiffness.T)
    stiffness.setflags(write=False)
    return stiffness


class PanelMesh(NamedTuple):
    """Quadratic triangles of a panel."""

    x: NDArray  # (n, 2) corners and middles of the triangles
    elements: NDArray  # (nt, 6) corners, and the middles of the sides from each to the next
    at: NDArray  # (m,) the panel's corners
    along: list[NDArray]  # points on each edge, in order, without its ends
    radius: float | None = None  # within which corners are rigid, where they give way


def _even(panel: Outline, n: int) -> PanelMesh:
    """A mesh with n pieces of each edge."""
    points, triangles, at, edges = meshed(np.array(panel.corners), panel.center, n)
    return _quadratic(points, triangles, at[: len(edges)], edges)


def _graded(panel: Outline, radius: float) -> PanelMesh:
    """A mesh that is graded toward corners, down to a radius or to what a short edge has room for.

    As that of a shell (`structures.graded`).
    """
    corners = np.array(panel.corners)
    middles, mean = 0.5 * (corners + np.roll(corners, -1, axis=0)), corners.mean(axis=0)
    pieces = [
        np.stack([corner, middles[k], mean, middles[k - 1]]) for k, corner in enumerate(corners)
    ]
    length = 2.0 * np.linalg.norm(middles - corners, axis=1)
    room = min(Grading(radius, 2, RAYS).reach(piece).min() for piece in pieces)
    radius = min(radius, 0.999 * room / ROOM, 0.5 * length.min() / ROOM)
    cut = graded(length, RAYS, radius)
    x = np.stack([cut.points(piece) for piece in pieces])  # (m, arcs, 2 RAYS + 1, 2)
    node = np.arange(x[..., 0].size).reshape(x.shape[:3])
    node[:, -1, RAYS] = node[0, -1, RAYS]  # the mean; cuts belong to two pieces
    node[:, -1, :RAYS:-1] = np.roll(node[:, -1, :RAYS], 1, axis=0)
    at = x[..., 0].size + np.arange(len(pieces))
    a, b, c, d = node[:, :-1, :-1], node[:, 1:, :-1], node[:, 1:, 1:], node[:, :-1, 1:]
    halves = [  # cut alike on both sides of the middle ray
        np.where((np.arange(2 * RAYS) < RAYS)[:, None], np.stack(one, -1), np.stack(other, -1))
        for one, other in (((a, b, d), (a, b, c)), ((b, c, d), (a, c, d)))
    ]
    halves = [half.reshape(-1, 3) for half in halves]
    tips = np.stack(np.broadcast_arrays(at[:, None], node[:, 0, :-1], node[:, 0, 1:]), axis=-1)
    triangles = np.concatenate([tips.reshape(-1, 3), *halves])
    following = np.roll(np.arange(len(pieces)), -1)
    edges = [
        np.array([at[k], *node[k, :, 0], *node[j, -2::-1, -1], at[j]])
        for k, j in enumerate(following)
    ]
    used, triangles = np.unique(triangles, return_inverse=True)
    points = np.empty((at[-1] + 1, 2))
    points[: x[..., 0].size], points[at] = x.reshape(-1, 2), corners
    edges = [np.searchsorted(used, edge) for edge in edges]
    mesh = _quadratic(points[used], triangles.reshape(-1, 3), np.searchsorted(used, at), edges)
    return mesh._replace(radius=radius)


def _quadratic(points: NDArray, triangles: NDArray, at: NDArray, edges: list[NDArray]) -> PanelMesh:
    """Triangles with the middles of their sides; `edges` with their ends."""
    sides = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2)
    ends, side = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
    middle = {pair: len(points) + k for k, pair in enumerate(map(tuple, ends.tolist()))}
    elements = np.concatenate([triangles, len(points) + side.reshape(-1, 3)], axis=1)
    along = []
    for edge in (edge.tolist() for edge in edges):
        halves = [(middle[min(pair), max(pair)], pair[1]) for pair in pairwise(edge)]
        along.append(np.array([point for both in halves for point in both][:-1]))
    return PanelMesh(np.concatenate([points, points[ends].mean(axis=1)]), elements, at, along)


def _condensed(
    panel: Outline, poissons_ratio: float, resistance: tuple[float, ...], mesh: PanelMesh
) -> NDArray:
    moves, m = _moves(panel, mesh)
    stiffness = np.ones(len(mesh.elements))
    if mesh.radius is not None:
        stiffness[np.isin(mesh.elements[:, :3], mesh.at).any(axis=1)] = STIFF
    whole = moves.T @ _stretching(mesh, poissons_ratio, stiffness) @ moves
    bows = [
        _bowing(mesh, k, factor)
        for k, (factor, straight) in enumerate(zip(resistance, panel.straight, strict=True))
        if not straight
    ]
    free = whole.shape[0] - m - sum(len(bow) for bow in bows)
    parts = [sparse.csr_array((m, m)), *bows, sparse.csr_array((free, free))]
    whole = sparse.csc_array(whole + sparse.block_diag(parts))
    across = whole[m:, :m].toarray()
    factor = splu(whole[m:, m:], "MMD_AT_PLUS_A", 0.0, options={"SymmetricMode": True})
    return whole[:m, :m].toarray() - across.T @ factor.solve(across)


def _bowing(mesh: PanelMesh, edge: int, resistance: float) -> NDArray:
    """Stiffness (points, ...) of the bows of an edge at its points, waves of sines."""
    points = mesh.along[edge]
    start, end = mesh.x[mesh.at[edge]], mesh.x[mesh.at[(edge + 1) % len(mesh.at)]]
    length = float(np.linalg.norm(end - start))
    place = np.linalg.norm(mesh.x[points] - start, axis=1)
    if mesh.radius is None:
        wave = np.pi / length * np.arange(1, len(points) + 1)
        shapes = 2.0 / (len(points) + 1) * np.sin(np.outer(wave, place))
    else:  # of bows that are linear between the points
        count = WAVES * length / mesh.radius
        number = np.arange(1, int(np.ceil(1.5 * count)))
        wave = np.pi / length * number
        at = np.concatenate([[0.0], place, [length]])
        slopes = np.diff(np.sin(np.outer(wave, at)), axis=1) / np.diff(at)
        shapes = -2.0 / length * np.diff(slopes, axis=1) / wave[:, None] ** 2
        # the shortest ones fade, as a last whole wave would make the stiffness jump with the length
        part = np.clip(1.5 - number / count, 0.0, 1.0)
        resistance = resistance * part**2 * (3.0 - 2.0 * part)
    return (shapes.T * (resistance * wave**3 * 0.5 * length)) @ shapes


def _moves(panel: Outline, mesh: PanelMesh) -> tuple[sparse.csr_array, int]:
    """Displacements of all points by those of the corners, gives, and what is free.

    The number of the first two as well.
    """
    x, at, along = mesh.x, mesh.at, mesh.along
    rows, columns, values = [], [], []
    kept = count = (2 if mesh.radius is None else 4) * len(at)

    def put(points: NDArray, column: NDArray, value: NDArray) -> None:
        """By one column each: both components of the displacements of some points."""
        rows.append((2 * points[:, None] + np.arange(2)).ravel())
        columns.append(np.repeat(column, 2))
        values.append(value.ravel())

    for k, corner in enumerate(at):
        for axis in range(2):
            put(np.array([corner]), np.array([2 * k + axis]), np.eye(2)[axis])
    inside = np.setdiff1d(np.arange(len(x)), np.concatenate([at, *along]))
    for k, points in enumerate(along):
        ends = k, (k + 1) % len(at)
        edge = x[at[ends[1]]] - x[at[ends[0]]]
        length = np.linalg.norm(edge)
        tangent = edge / length
        normal, place = np.array([-tangent[1], tangent[0]]), (x[points] - x[at[k]]) @ tangent
        radius = mesh.radius or 0.0
        for side, far in enumerate((place, length - place)):
            share = 1.0 - far / length
            slid = 1.0 - np.clip((far - radius) / (length - 2.0 * radius), 0.0, 1.0)
            for axis, unit in enumerate(np.eye(2)):
                column = np.full(len(points), 2 * ends[side] + axis)
                along_it = np.outer(slid, (unit @ tangent) * tangent)
                put(points, column, along_it + np.outer(share, (unit @ normal) * normal))
            if radius:
                half = 0.5 * length
                held = np.log(np.maximum(far, radius) / half) / np.log(radius / half)
                gives = (slid - np.maximum(held, 0.0)) * (1 - 2 * side)
                column = np.full(len(points), 2 * (len(at) + k) + side)
                put(points, column, np.outer(gives, tangent))
        if not panel.straight[k]:
            put(points, count + np.arange(len(points)), np.tile(normal, (len(points), 1)))
            count += len(points)
    for axis in range(2):
        put(inside, count + np.arange(len(inside)), np.tile(np.eye(2)[axis], (len(inside), 1)))
        count += len(inside)
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sparse.csr_array(sparse.coo_array(entries, shape=(2 * len(x), count))), kept


def _stretching(mesh: PanelMesh, poissons_ratio: float, stiffness: NDArray) -> sparse.csr_array:
    """Stiffness of the displacements of all points in plane stress, E t = `stiffness` (nt,)."""
    nu, x, elements = poissons_ratio, mesh.x, mesh.elements
    elastic = np.array([[1, nu, 0], [nu, 1, 0], [0, 0, 0.5 * (1 - nu)]]) / (1 - nu**2)
    corners = x[elements[:, :3]]
    spans = corners[:, 1:] - corners[:, :1]
    inverse, part = np.linalg.inv(spans), stiffness * np.linalg.det(spans) / 6.0
    gradient = np.concatenate([-inverse.sum(axis=2, keepdims=True), inverse], axis=2)
    following, block = np.roll(gradient, -1, axis=2), 0.0
    for place in MIDDLES:
        slopes = np.concatenate(
            [gradient * (4 * place - 1), 4 * (np.roll(place, -1) * gradient + place * following)],
            axis=2,
        )
        strain = np.zeros((len(elements), 3, 6, 2))
        strain[:, 0, :, 0], strain[:, 1, :, 1] = slopes[:, 0], slopes[:, 1]
        strain[:, 2, :, 0], strain[:, 2, :, 1] = slopes[:, 1], slopes[:, 0]
        strain = strain.reshape(-1, 3, 12)
        block = block + strain.transpose(0, 2, 1) @ (part[:, None, None] * elastic @ strain)
    dofs = (2 * elements[:, :, None] + np.arange(2)).reshape(-1, 12)
    places = (np.repeat(dofs, 12, axis=1).ravel(), np.tile(dofs, (1, 12)).ravel())
    return sparse.csr_array(sparse.coo_array((np.ravel(block), places), (x.size, x.size)))
