"""Meshes of flat panels for CalculiX: parts with four sides, finer toward vertices and edges."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.patterns import Pattern

PIECES = 16  # of half an edge
FIRST = 0.12  # length of the smallest one, relative to the thickness
CORNERS = ((0, 0), (2, 0), (2, 2), (0, 2))  # of a cell, in halves of its sides
MIDDLES = ((1, 0), (2, 1), (1, 2), (0, 1))
GAUSS = 1.0 / np.sqrt(3.0)
DIGITS = 9  # of coordinates, relative to the size of the panel, that tell nodes apart
NEAR = 1e-6  # distance from a cell, relative to the part, that counts as inside


class Panel(NamedTuple):
    """A panel of k parts, one at each corner, of n by n cells with quadratic sides."""

    corners: NDArray  # (k, 3)
    ends: NDArray  # (n + 1,) where cells end, from 0 at the corner to 1 at the middle of an edge
    nodes: NDArray  # (m, 3)
    grid: NDArray  # (k, 2n + 1, 2n + 1) nodes of each part, from its corner; -1 within cells
    frame: NDArray  # (3, 3) x along the first edge, y, and the normal of the front

    def line(self, k: int) -> NDArray:
        """Nodes of edge k, from its first corner."""
        return np.append(self.grid[k, :, 0], self.grid[(k + 1) % len(self.grid), 0, -2::-1])

    def cells(self) -> NDArray:
        """Nodes (k n^2, 8) of the cells: corners, then middles of sides."""
        low = np.arange(0, self.grid.shape[1] - 1, 2)
        both = [self.grid[:, low + a][:, :, low + b] for a, b in (*CORNERS, *MIDDLES)]
        return np.stack(both, axis=-1).reshape(-1, 8)

    def areas(self) -> NDArray:
        """Shares (m,), m2, of the nodes under an even load."""
        cells, found = self.cells(), np.zeros(len(self.nodes))
        a, b = np.array([*CORNERS, *MIDDLES]).T - 1.0
        at = self.nodes[cells[:, :4]]
        for x, y in product((-GAUSS, GAUSS), repeat=2):
            corner = (1 + a * x) * (1 + b * y) * (a * x + b * y - 1) / 4
            middle = np.where(a == 0, (1 - x * x) * (1 + b * y), (1 + a * x) * (1 - y * y)) / 2
            over = np.einsum("k,ekx->ex", a[:4] * (1 + b[:4] * y) / 4, at)
            up = np.einsum("k,ekx->ex", b[:4] * (1 + a[:4] * x) / 4, at)
            area = np.linalg.norm(np.cross(over, up), axis=1)[:, None]
            np.add.at(found, cells, area * np.where(np.abs(a * b) == 1, corner, middle))
        return found

    def at(self, field: NDArray, point: NDArray) -> NDArray:
        """Value at a point of a field (k n^2, 4, ...) at four points of integration per cell.

        It is extrapolated bilinearly, and averaged over the cells that meet at the point.
        """
        n, found, flat = len(self.ends) - 1, [], self.frame[:2]
        for k, part in enumerate(_parts(self.corners)):
            x = _place(part @ flat.T, flat @ point)
            inside = [
                [i for i in range(n) if self.ends[i] - NEAR <= c <= self.ends[i + 1] + NEAR]
                for c in x
            ]
            for i, j in product(*inside):
                low, high = self.ends[[i, j]], self.ends[[i + 1, j + 1]]
                a, b = (2.0 * (x - low) / (high - low) - 1.0) / GAUSS
                weight = np.outer([1 - b, 1 + b], [1 - a, 1 + a]).ravel() / 4
                found.append(np.tensordot(weight, field[(k * n + i) * n + j], 1))
        return np.mean(found, axis=0)


def panel_mesh(corners: NDArray, ends: NDArray) -> Panel:
    """Mesh of a flat panel with corners (k, 3)."""
    along = corners[1] - corners[0]
    normal = np.cross(along, corners[2] - corners[1])
    frame = np.stack([along, np.cross(normal, along), normal])
    fine = np.sort(np.append(ends, 0.5 * (ends[1:] + ends[:-1])))
    weights = _weights(*np.meshgrid(fine, fine, indexing="ij"))
    points = np.array([weights @ part for part in _parts(corners)])
    used = np.ones(points.shape[:3], bool)
    used[:, 1::2, 1::2] = False
    rounded = np.round(points[used] / np.ptp(corners, axis=0).max(), DIGITS)
    _, first, number = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
    grid = np.full(used.shape, -1)
    grid[used] = number.ravel()
    frame /= np.linalg.norm(frame, axis=1)[:, None]
    return Panel(corners, ends, points[used][first], grid, frame)


def cell_ends(pattern: Pattern, thickness: float) -> NDArray:
    """Where cells end, which grow from the corner on as a power of their number."""
    edge = np.linalg.norm(np.diff(pattern.vertices[pattern.edges], axis=1), axis=2).mean()
    power = np.log(2.0 * FIRST * thickness / edge) / -np.log(PIECES)
    return np.linspace(0.0, 1.0, PIECES + 1) ** max(power, 1.0)


def shares(line: NDArray) -> NDArray:
    """Shares (2n + 1,), m, of the points of a line under an even load."""
    length, share = np.linalg.norm(line[2::2] - line[:-2:2], axis=1), np.zeros(len(line))
    for k, part in enumerate((1 / 6, 4 / 6, 1 / 6)):
        share[k : k + 2 * len(length) : 2] += part * length
    return share


def _parts(corners: NDArray) -> NDArray:
    """Corners (k, 4, 3) of the parts: corner, middle of an edge, center, middle of an edge."""
    middle = 0.5 * (corners + np.roll(corners, -1, axis=0))
    center = np.broadcast_to(corners.mean(axis=0), corners.shape)
    return np.stack([corners, middle, center, np.roll(middle, 1, axis=0)], axis=1)


def _weights(x: NDArray, y: NDArray) -> NDArray:
    return np.stack([(1 - x) * (1 - y), x * (1 - y), x * y, (1 - x) * y], axis=-1)


def _place(part: NDArray, point: NDArray) -> NDArray:
    """Coordinates (2,) of a point in a part with corners (4, 2), by Newton's method."""
    x = np.array([0.5, 0.5])
    for _ in range(20):
        over = (1 - x[1]) * (part[1] - part[0]) + x[1] * (part[2] - part[3])
        up = (1 - x[0]) * (part[3] - part[0]) + x[0] * (part[2] - part[1])
        step = np.linalg.solve(np.stack([over, up], axis=1), point - _weights(*x) @ part)
        x = np.clip(x + step, -1.0, 2.0)
    return x
