"""Plates of panels, condensed to corners, center, edge turns, and bows.

`PanelPlate` cuts each facet of a panel evenly: all its triangles are the same, half of them turned
by 180 degrees. So each entry of a panel's stiffness is a sum of entries for its facets, as single
triangles, with factors that are equal for all panels with the same number of corners. A scale of
1/n multiplies the stiffness of heights by n^2, and leaves the stiffness of slopes unchanged.

The unknowns at an edge of n pieces, for any edge condition:

    heights   w_i = (1 - i/n) w_0 + i/n w_n + n/(n - 1) L b + e_i - e_(i-1),    i = 1 ... n - 1
    slopes    s_i = s + d_i - d_(i-1),                                          i = 1 ... n

with the bow b, the mean slope s, and e and d, which are 0 at both ends of the edge. On a straight
edge, b and all e are 0, on a clamped edge all d. Such unknowns are uncoupled in the matrix, with
the stiffness 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.condensing import Condensing
from foldyn.structures.panel_plate import (
    Outline,
    across_edges,
    facets_of,
    meshed,
    plate_blocks,
    sides_of,
)


class Cut(NamedTuple):
    """How plates of panels with m corners are cut and condensed.

    Attributes
    ----------
    pairs : (k, 2)
        Unknowns with an entry in the stiffness. The kept ones are last: heights of corners and
        center, s of the edges, L b of the edges.
    factors : (k, 36 facets)
        Factors from entries of the facets' stiffness to these entries.
    edge : (size,)
        Condition under which an unknown is 0: k if edge k is straight, m + k if it is clamped, 2 m
        never.
    condensing : Condensing
    """

    pairs: NDArray
    factors: sparse.csr_array
    edge: NDArray
    condensing: Condensing


@lru_cache(maxsize=64)
def _cut(m: int, center: bool, n: int) -> Cut:
    """Cut of panels with or without a center, with n pieces per edge, at least 2."""
    unit, facets = np.eye(m + center), m if center else 1
    points, triangles, at, edges = meshed(unit[:m], unit[-1] if center else None, n)
    # inverted triangles start at another corner, so that their sides match the facet's numbering
    triangles = triangles.reshape(facets, n * n, 3)
    turned = n * (n + 1) // 2
    triangles[:, turned:] = np.roll(triangles[:, turned:], -1, axis=2)
    triangles = triangles.reshape(-1, 3)
    side, sign, ends = sides_of(triangles)
    basis, edge = _basis(at, edges, across_edges(edges, ends, len(points)), len(points) + len(ends))
    size, count = len(edge), 36 * facets
    dofs = np.concatenate([triangles, len(points) + side], axis=1)
    scale = np.concatenate([np.full(triangles.shape, float(n)), sign], axis=1)
    value = (scale[:, :, None] * scale[:, None, :]).ravel()
    row, column = np.repeat(dofs, 6, axis=1).ravel(), np.tile(dofs, (1, 6)).ravel()
    source = (36 * np.repeat(np.arange(facets), n * n)[:, None] + np.arange(36)).ravel()
    for _ in range(2):  # basis' A basis: first by rows, then by columns
        places = row, count * column + source
        part = sparse.coo_array((value, places), shape=(size, count * size))
        found = sparse.coo_array(basis.T @ sparse.csr_array(part))
        value, (column, rest) = found.data, found.coords
        row, source = np.divmod(rest, count)
    lower = row >= column
    keys, place = np.unique(row[lower] * size + column[lower], return_inverse=True)
    pairs = np.stack(np.divmod(keys, size), axis=1)
    factors = sparse.csr_array((value[lower], (place, source[lower])), (len(pairs), count))
    return Cut(pairs, factors, edge, Condensing(pairs, size, len(at) + 2 * m))


def _basis(
    at: NDArray, edges: Sequence[NDArray], sides: Sequence[tuple[NDArray, NDArray]], size: int
) -> tuple[sparse.csr_array, NDArray]:
    """Matrix from unknowns to heights and slopes (size,); when unknowns are 0, see `Cut.edge`.

    at, edges, sides : heights of corners and center; of the points on each edge (n + 1,); slopes
    across the sides of each edge and their signs (n,), 1 if outward.
    """
    m, n = len(edges), len(sides[0][0])
    first = size - len(at) - 2 * m  # first of the kept unknowns
    own = 2 * n - 3  # e and d of an edge
    steps = np.arange(1, n) / n
    where = np.full(size, 2 * m)
    inside = np.setdiff1d(np.arange(size), np.concatenate([at, *edges, *(s for s, _ in sides)]))
    stay = np.arange(first, size)
    parts = [(inside, np.arange(len(inside)), 1.0), (at, stay[: len(at)], 1.0)]
    for k, (points, (across, sign)) in enumerate(zip(edges, sides, strict=True)):
        between = points[1:-1]
        e, d = np.split(len(inside) + own * k + np.arange(own), [n - 2])
        mean, bow = stay[len(at) + k], stay[len(at) + m + k]
        where[[*e, bow]], where[d] = k, m + k
        parts += [
            (between, stay[k], 1.0 - steps), (between, stay[(k + 1) % m], steps),
            (between, bow, n / (n - 1.0)), (between[:-1], e, 1.0), (between[1:], e, -1.0),
            (across, mean, sign), (across[:-1], d, sign[:-1]), (across[1:], d, -sign[1:]),
        ]  # fmt: skip
    rows, columns, values = (
        np.concatenate(each)
        for each in zip(*(np.broadcast_arrays(*part) for part in parts), strict=True)
    )
    return sparse.csr_array((values, (rows, columns)), (size, size)), where


def condensed(panels: Sequence[Outline], poissons_ratio: float, n: int) -> list[NDArray]:
    """Stiffness of heights of corners and center, mean outward slopes of creases, and bows.

    For G = 1, and up to eight panels with the same number of corners.

    n : pieces of each edge.
    """
    m, center = len(panels[0].corners), panels[0].center is not None
    cut = _cut(m, center, n)
    corners = np.array([[*panel.corners, *([panel.center] if center else [])] for panel in panels])
    facets = corners[:, facets_of(corners[0], m)[: None if center else 1]].reshape(-1, 3, 2)
    blocks = plate_blocks(facets, np.ones((len(facets), 3)), poissons_ratio)
    straight, bowed, creased, clamped = (
        np.array([getattr(panel, name) for panel in panels])
        for name in ("straight", "bowed", "creased", "clamped")
    )
    free = 1.0 - np.concatenate([straight, clamped, np.zeros((len(panels), 1))], axis=1).T[cut.edge]
    row, column = cut.pairs.T
    values = cut.factors @ blocks.reshape(len(panels), -1).T * (free[row] * free[column])
    values[row == column] += 1.0 - free
    stiffness = cut.condensing(values)
    lengths = np.linalg.norm(np.roll(corners[:, :m], -1, axis=1) - corners[:, :m], axis=2)
    scale = np.concatenate([np.ones((len(panels), len(corners[0]) + m)), lengths], axis=1)
    stiffness *= scale[:, :, None] * scale[:, None, :]
    held = np.concatenate([np.ones((len(panels), len(corners[0])), bool), creased, bowed], axis=1)
    return _held(stiffness, held)


def _held(stiffness: NDArray, held: NDArray) -> list[NDArray]:
    """Stiffness of the held unknowns (c, k), with the others in balance."""
    rows, columns = held[:, :, None], held[:, None, :]
    loose = np.where(rows | columns, 0.0, stiffness) + held[:, :, None] * np.eye(held.shape[1])
    across = np.where(~rows & columns, stiffness, 0.0)
    found = stiffness - np.swapaxes(across, 1, 2) @ np.linalg.solve(loose, across)
    return [own[np.ix_(kept, kept)] for own, kept in zip(found, held, strict=True)]
