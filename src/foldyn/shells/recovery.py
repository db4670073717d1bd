"""Strains and moments at points of a panel, from the sides of triangles.

A triangle has a strain e along each of its sides and a moment m about each, per length, which its
neighbors share: these are accurate at the middles of the sides. With t and n the directions along
and across a side, a symmetric tensor field that is quadratic in position is fitted to

    t . eps t = e    and    n . M n = m

by least squares, on the sides nearest to a point. So uniform strains and moments are exact, and
errors fall with the square of the mesh size. Sides of the rigid corners have no strain, and do not
count.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.patterns import Pattern
from foldyn.structures.sheet import Sheet

SIDES = 90  # sides of a fit, each counted in both of its triangles
TERMS = 6, 3, 1  # of the polynomial: as many as the sides determine
BESIDE = 12  # sides whose triangles tell how much longer they are in one direction
NEAR = 1.0  # weights of sides fall as exp(-NEAR r^2), with r the distance relative to the farthest
SAME = 1e-6  # relative difference of distances that count as equal
SMALL = 1e-3  # singular values of a fit, relative to the largest, that count as 0
MOST = 0.5  # share of the way from a corner to the center


class Recovery(NamedTuple):
    """Matrices (3 p, 3 nt) from the sides of triangles to tensors xx, yy, xy at p points."""

    strain: sparse.csr_array  # from strains along sides
    moment: sparse.csr_array  # from moments about sides, N m: N at the points


PLACES = ("center", "edge", "corner")


class StressPoints(NamedTuple):
    """Points of a pattern's panels at which stresses are found, panel by panel.

    A panel with k corners has 2k + 1 of them, see `stress_points`; the points at its corners are
    one thickness away from them, or as far as these are rigid.
    """

    position: NDArray  # (p, 3) m, at rest
    panel: NDArray  # (p,)
    place: NDArray  # (p,) one of `PLACES`
    number: NDArray  # (p,) which edge, from corner k to k + 1, or which corner of the panel
    axes: NDArray  # (np, 2, 3) axes of each panel's tensors: along its first edge, and across it
    thickness: NDArray  # (p,) m

    @classmethod
    def of(cls, pattern: Pattern, sheet: Sheet, radius: float = 0.0) -> StressPoints:
        """The points of a pattern.

        radius : distance (m) from the vertices up to which corners are rigid.
        """
        count, thickness = len(pattern.faces), sheet.values("thickness", len(pattern.faces))
        position, panel, place, number, axes = [], [], [], [], np.zeros((count, 2, 3))
        for p, face in enumerate(pattern.faces):
            corners, normal = pattern.vertices[[*face]], pattern.face_normals[p]
            position.append(stress_points(corners, max(float(thickness[p]), radius)))
            panel += [p] * len(position[-1])
            place += [PLACES[0], *len(face) * [PLACES[1]], *len(face) * [PLACES[2]]]
            number += [0, *range(len(face)), *range(len(face))]
            along = np.cross(np.cross(normal, corners[1] - corners[0]), normal)
            axes[p, 0] = along / np.linalg.norm(along)
            axes[p, 1] = np.cross(normal, axes[p, 0])
        where = np.array(panel)
        return cls(
            np.concatenate(position), where, np.array(place), np.array(number), axes,
            thickness[where],
        )  # fmt: skip


def stress_points(corners: NDArray, near: float) -> NDArray[np.float64]:
    """Points (2k + 1, ...) of a panel with corners (k, ...): center, middles of edges, corners.

    near : distance from the corners, toward the center, of the last k points.
    """
    center = corners.mean(axis=0)
    middles = 0.5 * (corners + np.roll(corners, -1, axis=0))
    away = center - corners
    share = np.minimum(near / np.linalg.norm(away, axis=1), MOST)
    return np.vstack([center, middles, corners + share[:, None] * away])


def recovery(points: NDArray, corners: NDArray, axes: NDArray, rigid: NDArray) -> Recovery:
    """How the sides of a panel's triangles give tensors at points of the panel.

    Parameters
    ----------
    points : (p, 3)
    corners : (nt, 3, 3)
    axes : (2, 3)
        Directions x and y of the tensors, in the panel's plane.
    rigid : (nt,)
        Whether each triangle belongs to a rigid corner.
    """
    side = (np.roll(corners, -1, axis=1) - corners).reshape(-1, 3)
    middle, length = corners.reshape(-1, 3) + 0.5 * side, np.linalg.norm(side, axis=1)
    along = side @ axes.T / length[:, None]
    across, there = np.stack([along[:, 1], -along[:, 0]], axis=1), (points @ axes.T)
    flat, soft = middle @ axes.T, np.flatnonzero(~np.repeat(rigid, 3))
    sides = (side @ axes.T).reshape(-1, 3, 2)
    sizes = np.repeat(np.einsum("tki,tkj->tij", sides, sides), 3, axis=0)
    strain = _fitted(there, flat, sizes, along, soft)
    return Recovery(strain, _fitted(there, flat, sizes, across, soft) / length)


def _nearest(point: NDArray, middle: NDArray, sizes: NDArray) -> tuple[NDArray, NDArray]:
    """Sides (m,) near a point, and where their middles are, relative to the farthest, (m, 2).

    Distances are in units of the size that triangles near the point have in each direction.

    sizes : (s, 2, 2) products of the sides of the triangle of each side, summed.
    """
    apart = np.linalg.norm(middle - point, axis=1)
    some = np.argsort(apart, kind="stable")[:BESIDE]
    size, axes = np.linalg.eigh(sizes[some].sum(axis=0))
    away = (middle - point) @ (axes / np.sqrt(size))
    apart = np.linalg.norm(away, axis=1)
    count = min(SIDES, len(apart))
    reach = np.partition(apart, count - 1)[count - 1]
    own = np.flatnonzero(apart <= (1.0 + SAME) * reach)
    return own, away[own] / reach


def _fitted(
    points: NDArray, middle: NDArray, sizes: NDArray, direction: NDArray, counted: NDArray
) -> sparse.csr_array:
    """Matrix (3 p, s) from d . T d at the middles (s, 2) of sides to T at points (p, 2)."""
    rows, columns, values = [], [], []
    for k, point in enumerate(points):
        own, away = _nearest(point, middle[counted], sizes[counted])
        own = counted[own]
        x, y = away.T
        a, b = direction[own].T
        tensor = np.stack([a * a, b * b, 2.0 * a * b], axis=1)
        powers = [np.ones(len(own)), x, y, x * x, x * y, y * y]
        weight = np.exp(-NEAR * (x * x + y * y))
        for terms in TERMS:
            columns_of = [(weight * power)[:, None] * tensor for power in powers[:terms]]
            left, size, right = np.linalg.svd(np.concatenate(columns_of, 1), full_matrices=False)
            if size[-1] > SMALL * size[0]:
                break
        inverse = (right[:, :3].T / size.clip(min=SMALL * size[0])) @ left.T
        values.append((inverse * weight).ravel())
        rows.append(np.repeat(3 * k + np.arange(3), len(own)))
        columns.append(np.tile(own, 3))
    place = np.concatenate(rows), np.concatenate(columns)
    return sparse.csr_array((np.concatenate(values), place), shape=(3 * len(points), len(middle)))


def forces(strain: NDArray, stretching: NDArray) -> NDArray[np.float64]:
    """Membrane forces (..., 3), N/m, from strains xx, yy, xy (..., 3).

    stretching : (..., 3, 3), N/m per unit of xx, yy, and twice xy.
    """
    return np.einsum("...ij,...j->...i", stretching, strain * np.array([1.0, 1.0, 2.0]))
