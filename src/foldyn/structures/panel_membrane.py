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

from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.extrapolation import extrapolated
from foldyn.algebra.superlu import factorize
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


@dataclass(frozen=True, eq=False)
class Cut:
    """How panels are cut into quadratic triangles: the same for many.

    Attributes
    ----------
    ends : (s, 2)
        Of the triangles' sides; their middles are points after the others.
    elements : (nt, 6)
        Corners, and the middles of the sides from each to the next.
    at : (m,)
        The panel's corners.
    along : list of arrays
        Points on each edge, in order, without its ends.
    """

    ends: NDArray
    elements: NDArray
    at: NDArray
    along: list[NDArray]

    @cached_property
    def size(self) -> int:
        """Displacements of all points: at edges across them and along, elsewhere x and y."""
        return 2 * (int(self.elements.max()) + 1)

    @cached_property
    def beside(self) -> NDArray:
        """Triangles with points on edges."""
        return np.flatnonzero(np.isin(self.elements, np.concatenate(self.along)).any(axis=1))

    @cached_property
    def entries(self) -> tuple[NDArray, NDArray, NDArray]:
        """Rows and pointers of the entries of their matrix by columns.

        And places there of those of all triangles (nt 144,).
        """
        dofs = (2 * self.elements[:, :, None] + np.arange(2)).reshape(-1, 12)
        keys = self.size * np.repeat(dofs, 12, axis=1) + np.tile(dofs, (1, 12))
        found, place = np.unique(keys, return_inverse=True)
        column, row = np.divmod(found, self.size)
        return row, np.searchsorted(column, np.arange(self.size + 1)), place.ravel()


class Loose(NamedTuple):
    """Displacements that corners and gives leave free, in the order in which they are solved for.

    Entries of their matrix by columns: rows, pointers, and places there of entries `take` of the
    whole matrix and of the bows of each edge that is not straight.
    """

    free: NDArray
    rows: NDArray
    pointers: NDArray
    put: NDArray
    take: NDArray
    bows: list[NDArray]


class PanelMesh(NamedTuple):
    """Quadratic triangles of a panel."""

    x: NDArray  # (n, 2) corners and middles of the triangles
    cut: Cut
    radius: float | None = None  # within which corners are rigid, where they give way


def _even(panel: Outline, n: int) -> PanelMesh:
    """A mesh with n pieces of each edge."""
    weights, cut = _evenly(len(panel.corners), panel.center is not None, n)
    return _quadratic(weights @ [*panel.corners, *([panel.center] if panel.center else [])], cut)


@lru_cache(maxsize=64)
def _evenly(corners: int, center: bool, n: int) -> tuple[NDArray, Cut]:
    """Weights (points, corners) of the corners, and of the center, in points; how it is cut."""
    unit = np.eye(corners + center)
    weights, triangles, at, edges = meshed(unit[:corners], unit[-1] if center else None, n)
    return weights, _cut(len(weights), triangles, at[:corners], edges)


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
    used, fans = _fans(len(pieces), cut.arcs)
    mesh = _quadratic(np.concatenate([x.reshape(-1, 2), corners])[used], fans)
    return mesh._replace(radius=radius)


@lru_cache(maxsize=64)
def _fans(corners: int, arcs: int) -> tuple[NDArray, Cut]:
    """Points that a graded mesh uses, of its pieces' and then the corners, and how it is cut."""
    count = corners * arcs * (2 * RAYS + 1)
    node = np.arange(count).reshape(corners, arcs, -1)
    node[:, -1, RAYS] = node[0, -1, RAYS]  # the mean; cuts belong to two pieces
    node[:, -1, :RAYS:-1] = np.roll(node[:, -1, :RAYS], 1, axis=0)
    at = count + np.arange(corners)
    a, b, c, d = node[:, :-1, :-1], node[:, 1:, :-1], node[:, 1:, 1:], node[:, :-1, 1:]
    halves = [  # cut alike on both sides of the middle ray
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


def _quadratic(points: NDArray, cut: Cut) -> PanelMesh:
    """Triangles with the middles of their sides."""
    return PanelMesh(np.concatenate([points, points[cut.ends].mean(axis=1)]), cut)


def _cut(points: int, triangles: NDArray, at: NDArray, edges: list[NDArray]) -> Cut:
    """Sides of triangles between so many points; `edges` with their ends."""
    sides = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2)
    ends, side = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
    middle = {pair: points + k for k, pair in enumerate(map(tuple, ends.tolist()))}
    elements = np.concatenate([triangles, points + side.reshape(-1, 3)], axis=1)
    along = []
    for edge in (edge.tolist() for edge in edges):
        halves = [(middle[min(pair), max(pair)], pair[1]) for pair in pairwise(edge)]
        along.append(np.array([point for both in halves for point in both][:-1]))
    return Cut(ends, elements, at, along)


@lru_cache(maxsize=256)
def _loose(cut: Cut, straight: tuple[bool, ...]) -> Loose:
    """What is free where edges are straight or not."""
    across = [2 * along for along, held in zip(cut.along, straight, strict=True) if not held]
    inside = np.setdiff1d(np.arange(cut.size // 2), np.concatenate([cut.at, *cut.along]))
    free = np.concatenate([*across, (2 * inside[:, None] + np.arange(2)).ravel()])
    rows, pointers, _ = cut.entries
    whole = sparse.csc_array((np.arange(len(rows)), rows, pointers), (cut.size, cut.size))
    ends = np.cumsum([0, *map(len, across)])
    bows = [np.arange(a, b) for a, b in pairwise(ends)]

    def entries() -> Loose:
        size, part = len(free), sparse.coo_array(whole[:, free][free])
        keys = [size * part.coords[1] + part.coords[0]]
        keys += [(size * bow[:, None] + bow).ravel() for bow in bows]
        found, place = np.unique(np.concatenate(keys), return_inverse=True)
        put, *of_bows = np.split(place, np.cumsum([len(key) for key in keys])[:-1])
        column, row = np.divmod(found, size)
        return Loose(
            free, row, np.searchsorted(column, np.arange(size + 1)), put, part.data, of_bows
        )

    # any definite matrix with these entries says in which order they fill least
    first = entries()
    definite = -np.ones(len(first.rows))
    column = np.repeat(np.arange(len(free)), np.diff(first.pointers))
    definite[first.rows == column] = len(free)
    order = np.argsort(factorize(_by_columns(definite, first.rows, first.pointers)).perm_c)
    free, place = free[order], np.argsort(order)
    bows = [place[bow] for bow in bows]
    return entries()


def _by_columns(data: NDArray, rows: NDArray, pointers: NDArray) -> sparse.csc_array:
    size = len(pointers) - 1
    places = rows.astype(np.int32), pointers.astype(np.int32)
    return sparse.csc_array((data, *places), (size, size))


def _condensed(
    panel: Outline, poissons_ratio: float, resistance: tuple[float, ...], mesh: PanelMesh
) -> NDArray:
    cut, loose = mesh.cut, _loose(mesh.cut, panel.straight)
    stiffness = np.ones(len(cut.elements))
    if mesh.radius is not None:
        stiffness[np.isin(cut.elements[:, :3], cut.at).any(axis=1)] = STIFF
    axes, given = _moves(mesh)
    whole = _stretching(mesh, axes, poissons_ratio, stiffness)
    inner = np.zeros(len(loose.rows))
    inner[loose.put] = whole.data[loose.take]
    bowing = [k for k, straight in enumerate(panel.straight) if not straight]
    for k, places in zip(bowing, loose.bows, strict=True):
        inner[places] += _bowing(mesh, k, resistance[k]).ravel()
    moved = whole @ given
    factors = factorize(_by_columns(inner, loose.rows, loose.pointers), ordered=True)
    across = moved[loose.free]
    return given.T @ moved - across.T @ factors.solve(across)


def _bowing(mesh: PanelMesh, edge: int, resistance: float) -> NDArray:
    """Stiffness (points, ...) of the bows of an edge at its points, waves of sines."""
    points, at = mesh.cut.along[edge], mesh.cut.at
    start, end = mesh.x[at[edge]], mesh.x[at[(edge + 1) % len(at)]]
    length = float(np.linalg.norm(end - start))
    place = np.linalg.norm(mesh.x[points] - start, axis=1)
    fade = 1.0
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
        fade = part**2 * (3.0 - 2.0 * part)
    shapes = shapes * np.sqrt(fade * resistance * wave**3 * 0.5 * length)[:, None]
    return shapes.T @ shapes


def _moves(mesh: PanelMesh) -> tuple[NDArray, NDArray]:
    """Axes (n, 2, 2) of the displacements of points, by rows; how corners and gives move them.

    At edges the axes are across and along. Edges that are straight stay so.
    """
    x, at, along = mesh.x, mesh.cut.at, mesh.cut.along
    axes = np.tile(np.eye(2), (len(x), 1, 1))
    given = np.zeros((len(x), 2, (2 if mesh.radius is None else 4) * len(at)))
    for k, corner in enumerate(at):
        given[corner, :, 2 * k : 2 * k + 2] = np.eye(2)
    for k, points in enumerate(along):
        ends = k, (k + 1) % len(at)
        edge = x[at[ends[1]]] - x[at[ends[0]]]
        length = np.linalg.norm(edge)
        tangent = edge / length
        normal, place = np.array([-tangent[1], tangent[0]]), (x[points] - x[at[k]]) @ tangent
        axes[points] = normal, tangent
        radius = mesh.radius or 0.0
        for side, far in enumerate((place, length - place)):
            share = 1.0 - far / length
            slid = 1.0 - np.clip((far - radius) / (length - 2.0 * radius), 0.0, 1.0)
            columns = slice(2 * ends[side], 2 * ends[side] + 2)
            given[points, 0, columns] = np.outer(share, normal)
            given[points, 1, columns] = np.outer(slid, tangent)
            if radius:
                half = 0.5 * length
                held = np.log(np.maximum(far, radius) / half) / np.log(radius / half)
                gives = (slid - np.maximum(held, 0.0)) * (1 - 2 * side)
                given[points, 1, 2 * (len(at) + k) + side] = gives
    return axes, given.reshape(-1, given.shape[2])


@lru_cache(maxsize=64)
def _by_slopes(nu: float) -> NDArray:
    """Stiffness (16, 144) of triangles of area 1/2 by the products of their slopes.

    Those (2, 2) of the coordinates that are 1 at the second and at the third corner.
    """
    both, linear = 0.0, np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    for place in MIDDLES:
        after = np.roll(np.eye(3), -1, axis=0)
        corners = (4 * place - 1)[:, None] * np.eye(3)
        middles = 4 * (np.roll(place, -1)[:, None] * np.eye(3) + place[:, None] * after)
        shapes = np.concatenate([corners, middles]) @ linear
        both = both + np.einsum("ar,bs->arbs", shapes, shapes) / 6.0
    same, shear = np.eye(2), 0.5 * (1.0 - nu)
    elastic = nu * np.einsum("ic,jd->icjd", same, same)
    elastic += shear * np.einsum("ij,cd->icjd", same, same)
    elastic += shear * np.einsum("id,jc->icjd", same, same)
    return np.einsum("arbs,icjd->crdsaibj", both, elastic / (1.0 - nu**2)).reshape(16, 144)


def _stretching(
    mesh: PanelMesh, axes: NDArray, poissons_ratio: float, stiffness: NDArray
) -> sparse.csc_array:
    """Stiffness of the displacements of all points in plane stress, E t = `stiffness` (nt,)."""
    elements, turned = mesh.cut.elements, mesh.cut.beside
    corners = mesh.x[elements[:, :3]]
    spans = corners[:, 1:] - corners[:, :1]
    slopes = np.linalg.inv(spans).reshape(-1, 4)
    squares = (
        (stiffness * np.linalg.det(spans))[:, None, None] * slopes[:, :, None] * slopes[:, None]
    )
    block = squares.reshape(-1, 16) @ _by_slopes(poissons_ratio)
    own = block[turned]
    for _ in range(2):  # first by rows, then, symmetric as they are, by columns
        own = axes[elements[turned]] @ own.reshape(-1, 6, 2, 12)
        own = own.reshape(-1, 12, 12).transpose(0, 2, 1)
    block[turned] = own.reshape(-1, 144)
    rows, pointers, place = mesh.cut.entries
    return _by_columns(np.bincount(place, np.ravel(block), len(rows)), rows, pointers)
