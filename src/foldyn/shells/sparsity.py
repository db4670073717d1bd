"""Where the entries of a shell's tangent stand.

Dofs are 3 node + axis, then the rotations. A *place* is a node, with three dofs, or a rotation,
with one; what couples two places is a block of adjacent entries in each of its rows, so that a
triangle with its three neighbors, 21 dofs, needs the first entries of 9 x 9 blocks only.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.shells.kernels import ShellModel


class ShellPattern(NamedTuple):
    """Pattern of the tangent, and where the elements' blocks go; -1 where there is no place.

    Entry (a, b) of block (i, j) stands a * (indptr[d + 1] - indptr[d]) + b behind the block's
    first entry, d the first dof of place i.
    """

    size: int  # of the matrix
    indptr: NDArray  # (size + 1,)
    indices: NDArray  # (nnz,)
    corner: NDArray  # (nt, 3, 4) which of a triangle's six nodes the nodes of its hinges are
    triangle_dof: NDArray  # (nt, 9) first dofs of its six nodes and three rotations
    triangle: NDArray  # (nt, 9, 9) first entries
    owner: NDArray  # (nh,) 3 t + k of a triangle with the hinge on its side k; -1 on creases
    piece_dof: NDArray  # (c, 6) first dofs of a crease's four nodes and two rotations
    piece: NDArray  # (c, 6, 6) first entries


def shell_pattern(model: ShellModel) -> ShellPattern:
    """Pattern of the tangent."""
    n, count = model.nodes, model.nodes + model.rotations
    nodes, corner = _neighborhoods(model)
    triangle = np.concatenate([nodes, np.where(model.rotation >= 0, n + model.rotation, -1)], 1)
    piece = np.concatenate([model.hinges[model.piece_hinge], n + model.piece_rotations], axis=1)
    owner = np.full(len(model.hinges), -1, np.int64)
    side = np.flatnonzero(model.hinge.ravel() >= 0)
    owner[model.hinge.ravel()[side]] = side

    coupled = _coupled((triangle, piece), count)
    row, column = np.repeat(np.arange(count), np.diff(coupled.indptr)), coupled.indices
    pairs = row * count + column
    width = np.where(np.arange(count) < n, 3, 1)
    dof = np.concatenate([[0], np.cumsum(width)])  # first of each place
    behind = np.concatenate([[0], np.cumsum(width[column])])  # entries of one row of each place
    start = behind[coupled.indptr]
    length = np.repeat(np.diff(start), width)  # of the rows of the matrix
    indptr = np.concatenate([[0], np.cumsum(length)])
    first = indptr[dof[row]] + behind[:-1] - start[row]  # entry of each pair

    once = np.repeat(dof[column] - behind[:-1], width[column]) + np.arange(behind[-1])
    copy = np.arange(indptr[-1]) + np.repeat(np.repeat(start[:-1], width) - indptr[:-1], length)
    return ShellPattern(
        size=int(dof[-1]),
        indptr=indptr.astype(np.int32),
        indices=once.astype(np.int32)[copy],
        corner=corner,
        triangle_dof=_at(triangle, dof),
        triangle=_found(triangle, pairs, first, count),
        owner=owner,
        piece_dof=_at(piece, dof),
        piece=_found(piece, pairs, first, count),
    )


def _coupled(elements: tuple[NDArray, ...], count: int) -> sparse.csr_array:
    """Which places occur in one element (e, k) together, sorted; each with itself."""
    places = np.concatenate([np.arange(count), *(element.ravel() for element in elements)])
    sizes = [np.ones(count, np.int64), *(np.full(len(e), e.shape[1]) for e in elements)]
    number = np.repeat(np.arange(sum(map(len, sizes))), np.concatenate(sizes))
    known = places >= 0
    within = sparse.csr_array((np.ones(known.sum(), np.int32), (number[known], places[known])))
    together = sparse.csr_array(within.T @ within)
    together.sort_indices()
    return together


def _at(places: NDArray, dof: NDArray) -> NDArray:
    return np.where(places >= 0, dof[places], -1).astype(np.int32)


def _found(places: NDArray, pairs: NDArray, first: NDArray, count: int) -> NDArray:
    """First entries (e, k, k) of the blocks of places (e, k); -1 without one of them."""
    row, column = places[:, :, None], places[:, None, :]
    key = np.where((row >= 0) & (column >= 0), row * count + column, -1)
    entry = np.where(key >= 0, first[np.searchsorted(pairs, key)], -1)
    return entry.astype(np.int32)


def _neighborhoods(model: ShellModel) -> tuple[NDArray, NDArray]:
    """Nodes (nt, 6): corners, then the far wing of each side's hinge (-1: none); and `corner`."""
    tri = model.triangles
    nodes = np.concatenate([tri, np.full_like(tri, -1)], axis=1)
    corner = np.zeros((len(tri), 3, 4), np.int8)
    for k in range(3):
        has = np.flatnonzero(model.hinge[:, k] >= 0)
        row = model.hinges[model.hinge[has, k]]
        own = row[:, :, None] == tri[has][:, None, :]
        nodes[has, 3 + k] = row[~own.any(axis=2)]
        corner[has, k] = np.where(own.any(axis=2), own.argmax(axis=2), 3 + k)
    return np.where(nodes < model.nodes, nodes, -1), corner
