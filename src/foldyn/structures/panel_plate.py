"""A panel as a thin plate of small triangles: outline, mesh, stiffness of triangles, mass.

The triangles have constant curvature (Morley; in `mechanics.triangle`). Their unknowns are the
heights of the points and the slopes across the sides. Expensive functions of panels keep the values
they computed (`shared`).
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.eights import COUNT
from foldyn.mechanics.triangle import isotropic, triangle_stiffness

Value = TypeVar("Value")
Find = Callable[[Sequence[tuple]], list[Value]]
KEPT = 4096  # number of cached values of each kind; older values are dropped


class Shared(Generic[Value]):
    """A function with cached values; see `shared`."""

    def __init__(self, find: Find[Value], alike: Callable[..., Hashable]) -> None:
        self._find, self._alike = find, alike
        self._kept: dict[tuple, Value] = {}

    def __call__(self, *given: Hashable) -> Value:
        """The value for these arguments."""
        return self.each([given])[0]

    def each(self, many: Sequence[tuple]) -> list[Value]:
        """The values for the arguments of many calls."""
        found = {given: self._kept[given] for given in many if given in self._kept}
        groups: dict[Hashable, list[tuple]] = {}
        for given in dict.fromkeys(many):
            if given not in found:
                groups.setdefault(self._alike(*given), []).append(given)
        for group in groups.values():
            for first in range(0, len(group), COUNT):
                some = group[first : first + COUNT]
                found |= zip(some, self._find(some), strict=True)
        if groups:
            self._kept = dict([*{**self._kept, **found}.items()][-KEPT:])
        return [found[given] for given in many]


def shared(alike: Callable[..., Hashable]) -> Callable[[Find[Value]], Shared[Value]]:
    """Decorator of functions that compute the values of up to `COUNT` calls at once.

    alike : callable
        Maps the arguments of a call to a key; calls with equal keys are computed together.
    """
    return lambda find: Shared(find, alike)


DIGITS = 11  # panels that agree to so many digits have the same shape
TRIANGLE_MASS = (np.ones((3, 3)) + np.eye(3)) / 12.0  # total 1, linear between corners
Rows = tuple[tuple[float, float], ...]


class Outline(NamedTuple):
    """A panel: corners in its plane, counter-clockwise from the front, and its edge conditions.

    Edge k runs from corner k to corner k + 1. Clamped edges count as creased and straight: the
    sheet turns there uniformly.
    """

    corners: Rows  # m
    center: tuple[float, float] | None  # m; None in a triangle
    creased: tuple[bool, ...]
    straight: tuple[bool, ...]
    bowed: tuple[bool, ...]
    clamped: tuple[bool, ...]


def outline(
    x: NDArray, center: NDArray | None, creased: list[bool], straight: list[bool],
    bowed: Sequence[bool] = (), clamped: Sequence[bool] = (),
) -> Outline:  # fmt: skip
    """Outline of a panel with corners x (m, 3), with size 1 and its first edge along an axis.

    By default no edge is bowed or clamped.
    """
    middle = x.mean(axis=0)
    points = x if center is None else np.concatenate([x, center[None]])
    spokes = x - middle
    _, _, axes = np.linalg.svd(spokes, full_matrices=False)
    twisted = spokes.T @ np.roll(spokes, -1, axis=0)
    normal = (twisted - twisted.T)[[1, 2, 0], [2, 0, 1]]
    plane = axes[:2] if np.linalg.det([*axes[:2], normal]) > 0.0 else axes[1::-1]
    flat = (points - middle) @ plane.T
    edge = flat[1] - flat[0]
    e = edge / np.linalg.norm(edge)
    flat = flat @ np.array([[e[0], -e[1]], [e[1], e[0]]]) / np.sqrt(np.linalg.norm(normal))
    rows = tuple((float(a), float(b)) for a, b in flat.round(DIGITS) + 0.0)
    hub = None if center is None else rows[-1]
    none = (False,) * len(x)
    return Outline(
        rows[: len(x)], hub, tuple(creased), tuple(straight), tuple(bowed) or none,
        tuple(clamped) or none,
    )  # fmt: skip


def facets_of(points: NDArray, corners: int) -> list[tuple[int, int, int]]:
    """Triangles of the panel; triangle k is at edge k."""
    if len(points) == corners:
        return [(0, 1, 2)] * 3
    return [(k, (k + 1) % corners, corners) for k in range(corners)]


def mass_of(points: NDArray, triangles: NDArray, heights: NDArray) -> NDArray:
    """Mass matrix (k, k) of shapes with heights (points or more, k), linear on triangles."""
    shape, corners = heights[triangles], points[triangles]
    area = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
    return np.einsum("tak,ab,tbl,t->kl", shape, TRIANGLE_MASS, shape, area / area.sum())


def symmetric(matrices: NDArray) -> NDArray:
    """The symmetric part of matrices (..., k, k), read-only, as it is kept."""
    out = 0.5 * (matrices + np.swapaxes(matrices, -1, -2))
    out.setflags(write=False)
    return out


def meshed(
    x: NDArray, center: Sequence[float] | NDArray | None, n: int
) -> tuple[NDArray, NDArray, NDArray, list[NDArray]]:
    """Points (p, ...), triangles, points at corners and center, and points along each edge."""
    points = x if center is None else np.concatenate([x, np.asarray(center)[None]])
    facets = [(0, 1, 2)] if center is None else facets_of(points, len(x))
    sums = np.add.outer(np.arange(n + 1), np.arange(n + 1))
    i, j = np.nonzero(sums <= n)  # positions between the first corner and the two others, in n-ths
    place = np.full((n + 1, n + 1), -1)
    place[i, j] = np.arange(len(i))
    up, down = np.argwhere(sums < n), np.argwhere(sums < n - 1)
    rising = [place[*(up + step).T] for step in ((0, 0), (1, 0), (0, 1))]
    falling = [place[*(down + step).T] for step in ((1, 0), (1, 1), (0, 1))]
    small = np.concatenate([np.stack(rising, axis=1), np.stack(falling, axis=1)])
    weights = np.column_stack([n - i - j, i, j]) / n
    everywhere = np.concatenate([weights @ points[list(facet)] for facet in facets])
    _, first, same = np.unique(everywhere.round(7), axis=0, return_index=True, return_inverse=True)
    same = same.ravel()
    triangles = np.concatenate([same[small + k * len(i)] for k in range(len(facets))])
    nodes = everywhere[first]

    def found(wanted: NDArray) -> NDArray:
        return np.linalg.norm(nodes[None] - wanted[:, None], axis=2).argmin(axis=1)

    steps = np.linspace(0.0, 1.0, n + 1)[:, None]
    edges = [found(a + steps * (b - a)) for a, b in zip(x, np.roll(x, -1, axis=0), strict=True)]
    return nodes, triangles, found(points), edges


def sides_of(triangles: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Index and sign (nt, 3) of triangles' sides, positive if from low to high; ends (s, 2)."""
    pairs = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)
    ends, side = np.unique(np.sort(pairs, axis=2).reshape(-1, 2), axis=0, return_inverse=True)
    return side.reshape(-1, 3), np.where(pairs[:, :, 0] < pairs[:, :, 1], 1.0, -1.0), ends


def across_edges(edges: Sequence[NDArray], ends: NDArray, heights: int) -> list[tuple]:
    """For each edge the indices (n,) of the slopes across its sides, with their signs.

    edges : points along each edge; ends : end points of all sides. Slopes follow heights.
    """
    number = {pair: heights + k for k, pair in enumerate(map(tuple, ends.tolist()))}
    found = []
    for nodes in edges:
        pairs = np.sort(np.stack([nodes[:-1], nodes[1:]], axis=1), axis=1).tolist()
        sign = np.where(np.diff(nodes) > 0, 1.0, -1.0)
        found.append((np.array([number[a, b] for a, b in pairs]), sign))
    return found


def plane_slopes(corners: NDArray) -> NDArray:
    """Slopes (nt, 2, 3) of the planes over triangles (nt, 3, 2), for heights of the corners."""
    inverse = np.linalg.inv(corners[:, 1:] - corners[:, :1])
    return np.concatenate([-inverse.sum(axis=2, keepdims=True), inverse], axis=2)


def plate_blocks(corners: NDArray, sign: NDArray, poissons_ratio: float) -> NDArray:
    """Stiffness (nt, 6, 6) for heights of triangle corners (nt, 3, 2), and side slopes.

    sign : (nt, 3), 1 if slopes are outward.
    """
    flat = np.concatenate([corners, np.zeros((len(corners), 3, 1))], axis=2)
    elastic = isotropic(poissons_ratio)
    bending = triangle_stiffness(flat, elastic, elastic)[1]
    along = np.roll(corners, -1, axis=1) - corners
    outward = np.stack([along[:, :, 1], -along[:, :, 0]], axis=2)
    outward /= np.linalg.norm(along, axis=2)[:, :, None]
    turns = np.zeros((len(corners), 3, 6))  # turns beta of the sheet at each side
    turns[:, :, :3] = -outward @ plane_slopes(corners)
    turns[:, np.arange(3), 3 + np.arange(3)] = sign
    return turns.transpose(0, 2, 1) @ bending @ turns
