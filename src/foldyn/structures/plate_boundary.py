"""A panel's plate, condensed to the edges of the panel and its center.

`PanelPlate` cuts each facet of a panel evenly. Four facets with n pieces of each edge make one with
2 n, twice as large: all four are the same, one of them turned by 180 degrees. So the stiffness of
a facet that its edges feel is found from that of half of it, with few unknowns each time, and its
inside is never assembled.

The edges' unknowns, around a facet from its first corner: the heights of its points, then the
outward slopes of its sides. A scale of 1/2 makes the stiffness of heights four times as large, and
leaves that of slopes.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.structures.panel_plate import Outline, edge_functions, facets_of, plate_blocks, rows_of

Place = tuple[int, int]


class Joint(NamedTuple):
    """How parts with k unknowns make a whole: the first of its unknowns are its edges'."""

    number: NDArray  # (parts, k) unknown of the whole
    sign: NDArray  # (parts, k)
    kept: int
    size: int


class Numbering:
    """Numbers of what parts share; a slope seen from the other side has the other sign."""

    def __init__(self, first: Sequence[object]) -> None:
        self._number = {key: k for k, key in enumerate(first)}
        self._kept, self._seen = len(self._number), set()

    def joint(self, parts: Sequence[Sequence[object]], slopes: int) -> Joint:
        """Joint of parts with these keys of their unknowns, the last of which are slopes."""
        number, sign = [], []
        for keys in parts:
            number.append([self._number.setdefault(key, len(self._number)) for key in keys])
            heights = len(keys) - slopes
            sign.append(
                [-1.0 if k >= heights and key in self._seen else 1.0 for k, key in enumerate(keys)]
            )
            self._seen.update(keys[heights:])
        return Joint(np.array(number), np.array(sign), self._kept, len(self._number))


def _around(corners: Sequence[Place], n: int) -> tuple[list[Place], list[Place]]:
    """Points around a triangle on a lattice, and the middles of its sides, times 2."""
    points, middles = [], []
    for k in range(3):
        (i, j), (p, q) = corners[k], corners[(k + 1) % 3]
        step = (p - i) // n, (q - j) // n
        points += [(i + s * step[0], j + s * step[1]) for s in range(n)]
        middles += [
            (2 * i + (2 * s + 1) * step[0], 2 * j + (2 * s + 1) * step[1]) for s in range(n)
        ]
    return points, middles


def _keys(corners: Sequence[Place], n: int) -> list[object]:
    points, middles = _around(corners, n)
    return [*(("height", p) for p in points), *(("slope", p) for p in middles)]


@lru_cache(maxsize=16)
def _quarters(n: int) -> Joint:
    """Of four facets with n pieces of each edge."""
    a, b, c = (0, 0), (2 * n, 0), (0, 2 * n)
    ab, bc, ca = (n, 0), (n, n), (0, n)
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (bc, ca, ab)]
    return Numbering(_keys((a, b, c), 2 * n)).joint([_keys(part, n) for part in parts], 3 * n)


@lru_cache(maxsize=64)
def _facets(corners: int, n: int) -> Joint:
    """Of the facets about the center: heights along the edges and in the center, then slopes."""
    heights = [("edge", k, s) for k in range(corners) for s in range(n)]
    slopes = [("side", k, s) for k in range(corners) for s in range(n)]
    parts = []
    for k in range(corners):
        after = (k + 1) % corners
        out = [("spoke", after, s) for s in range(1, n)]  # from the corner to the center
        back = [("spoke", k, s) for s in range(n - 1, 0, -1)]
        points = [*heights[k * n : (k + 1) * n], ("edge", after, 0), *out, "center", *back]
        sides = [*slopes[k * n : (k + 1) * n], *(("across", after, s) for s in range(n))]
        parts.append([*points, *sides, *(("across", k, s) for s in range(n - 1, -1, -1))])
    return Numbering([*heights, "center", *slopes]).joint(parts, 3 * n)


def _joined(parts: NDArray, joint: Joint) -> NDArray:
    """Stiffness (..., kept, kept) of a whole of parts (..., parts, k, k)."""
    whole = np.zeros((*parts.shape[:-3], joint.size, joint.size))
    for k, (number, sign) in enumerate(zip(joint.number, joint.sign, strict=True)):
        whole[..., number[:, None], number] += sign[:, None] * parts[..., k, :, :] * sign
    own, other = whole[..., : joint.kept, : joint.kept], whole[..., joint.kept :, joint.kept :]
    across = whole[..., joint.kept :, : joint.kept]
    return own - np.swapaxes(across, -1, -2) @ np.linalg.solve(other, across)


def facet_stiffness(corners: NDArray, poissons_ratio: float, levels: int) -> list[NDArray]:
    """Stiffness (f, 6 n, 6 n) of facets with corners (f, 3, 2), n = 1, 2, 4, ... 2^levels."""
    found = [plate_blocks(corners, np.ones((len(corners), 3)), poissons_ratio)]
    for level in range(levels):
        n = 2**level
        scale = np.repeat([2.0, 1.0], 3 * n)
        quarter = scale[:, None] * found[-1] * scale
        parts = np.broadcast_to(quarter[:, None], (len(quarter), 4, 6 * n, 6 * n))
        found.append(_joined(parts, _quarters(n)))
    return found


def edge_stiffness(panel: Outline, poissons_ratio: float, pieces: Sequence[int]) -> list[NDArray]:
    """Stiffness that the edges and the center of a panel feel, G = 1, in meshes of different sizes.

    In the order: heights around the panel, that of its center, if it has one, and slopes.

    pieces : of each edge in each mesh, powers of 2.
    """
    levels, corners = [n.bit_length() - 1 for n in pieces], np.array(panel.corners)
    if panel.center is None:
        found = facet_stiffness(corners[None], poissons_ratio, max(levels))
        return [found[level][0] for level in levels]
    points = np.concatenate([corners, [panel.center]])
    facets = points[np.array(facets_of(points, len(corners)))]
    found = facet_stiffness(facets, poissons_ratio, max(levels))
    return [
        _joined(found[level], _facets(len(corners), n))
        for level, n in zip(levels, pieces, strict=True)
    ]


def condensed(panel: Outline, poissons_ratio: float, pieces: Sequence[int]) -> list[NDArray]:
    """Stiffness of the heights of corners and center, mean outward slopes of creases, and bows.

    Arguments as of `edge_stiffness`.
    """
    felt = edge_stiffness(panel, poissons_ratio, pieces)
    return [_held(panel, each, n) for each, n in zip(felt, pieces, strict=True)]


def _held(panel: Outline, stiffness: NDArray, n: int) -> NDArray:
    """The same, of what edges with n pieces each feel."""
    m = len(panel.corners)
    around = np.append(np.arange(m * n), 0)
    nodes = [around[k * n : (k + 1) * n + 1] for k in range(m)]
    sides = [len(stiffness) - m * n + np.arange(k * n, (k + 1) * n) for k in range(m)]
    functions = edge_functions(panel, nodes, [(side, np.ones(n)) for side in sides])
    first = n * np.arange(m + (panel.center is not None))
    count, held = len(first), len(functions.slopes) + len(functions.bows)
    others = np.setdiff1d(np.arange(len(stiffness)), first)
    rows = rows_of([*functions.slopes, *functions.bows, *functions.lines], len(stiffness)).toarray()
    # the least energy of x with C x = g, by its multipliers
    inner, across = stiffness[np.ix_(others, others)], stiffness[np.ix_(others, first)]
    loose = np.linalg.solve(inner, np.column_stack([across, rows[:, others].T]))
    moved, pulled = loose[:, :count], loose[:, count:]
    wanted = np.zeros((len(rows), count + held))
    wanted[:, :count] = rows[:, others] @ moved - rows[:, first]
    wanted[:held, count:] = np.eye(held)
    whole = np.zeros((len(stiffness), count + held))
    whole[first, :count] = np.eye(count)
    whole[others] = pulled @ np.linalg.solve(rows[:, others] @ pulled, wanted)
    whole[others, :count] -= moved
    return whole.T @ stiffness @ whole
