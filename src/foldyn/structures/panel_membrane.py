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

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.algebra.extrapolation import extrapolated
from foldyn.structures.panel_plate import Outline, meshed

COARSE, FINE = 4, 8  # pieces of each edge in the two meshes; twice as many in triangles
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
    coarse, fine = (_condensed(panel, poissons_ratio, resistance, more * n) for n in (COARSE, FINE))
    stiffness = extrapolated(coarse, fine, FINE / COARSE)
    stiffness = 0.5 * (stiffness + stiffness.T)
    stiffness.setflags(write=False)
    return stiffness


def _condensed(
    panel: Outline, poissons_ratio: float, resistance: tuple[float, ...], n: int
) -> NDArray:
    points, triangles, at, edges = meshed(np.array(panel.corners), panel.center, n)
    at = at[: len(edges)]  # of the corners
    sides = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2)
    ends, side = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
    middle = {pair: len(points) + k for k, pair in enumerate(map(tuple, ends.tolist()))}
    elements = np.concatenate([triangles, len(points) + side.reshape(-1, 3)], axis=1)
    x = np.concatenate([points, points[ends].mean(axis=1)])
    along = []  # points on each edge, in order, without its ends
    for edge in (edge.tolist() for edge in edges):
        halves = [(middle[min(pair), max(pair)], pair[1]) for pair in pairwise(edge)]
        along.append(np.array([point for both in halves for point in both][:-1]))
    moves = _moves(panel, x, at, along)
    whole = moves.T @ _stretching(x, elements, poissons_ratio) @ moves
    m = 2 * len(at)
    lengths = np.linalg.norm(x[np.roll(at, -1)] - x[at], axis=1)
    bows = [
        _bowing(length, 2 * n, factor)
        for length, factor, straight in zip(lengths, resistance, panel.straight, strict=True)
        if not straight
    ]
    free = whole.shape[0] - m - sum(len(bow) for bow in bows)
    parts = [sparse.csr_array((m, m)), *bows, sparse.csr_array((free, free))]
    whole = sparse.csc_array(whole + sparse.block_diag(parts))
    across = whole[m:, :m].toarray()
    factor = splu(whole[m:, m:], "MMD_AT_PLUS_A", 0.0, options={"SymmetricMode": True})
    return whole[:m, :m].toarray() - across.T @ factor.solve(across)


def _bowing(length: float, pieces: int, resistance: float) -> NDArray:
    """Stiffness (pieces - 1, ...) of the bows of an edge at its points."""
    wave = np.arange(1, pieces)
    shapes = np.sin(np.pi / pieces * np.outer(wave, wave))
    per_wave = resistance * (np.pi * wave / length) ** 3 * 0.5 * length
    return (2.0 / pieces) ** 2 * (shapes * per_wave) @ shapes


def _moves(panel: Outline, x: NDArray, at: NDArray, along: list[NDArray]) -> sparse.csr_array:
    """Displacements of all points x by those of the corners, and by what is free."""
    rows, columns, values, count = [], [], [], 2 * len(at)

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
        for end, share in zip(ends, (1.0 - place / length, place / length), strict=True):
            for axis in range(2):
                column = np.full(len(points), 2 * end + axis)
                put(points, column, share[:, None] * np.eye(2)[axis])
        if not panel.straight[k]:
            put(points, count + np.arange(len(points)), np.tile(normal, (len(points), 1)))
            count += len(points)
    for axis in range(2):
        put(inside, count + np.arange(len(inside)), np.tile(np.eye(2)[axis], (len(inside), 1)))
        count += len(inside)
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sparse.csr_array(sparse.coo_array(entries, shape=(2 * len(x), count)))


def _stretching(x: NDArray, elements: NDArray, poissons_ratio: float) -> sparse.csr_array:
    """Stiffness of the displacements of points x (n, 2) in plane stress, E t = 1.

    elements : (nt, 6) corners, and the middles of the sides from each to the next.
    """
    nu = poissons_ratio
    elastic = np.array([[1, nu, 0], [nu, 1, 0], [0, 0, 0.5 * (1 - nu)]]) / (1 - nu**2)
    corners = x[elements[:, :3]]
    spans = corners[:, 1:] - corners[:, :1]
    inverse, part = np.linalg.inv(spans), np.linalg.det(spans) / 6.0
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
