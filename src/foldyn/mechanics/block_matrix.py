"""Matrices assembled from elements, and from 3x3 blocks at pairs of nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

BETWEEN = np.array([[1.0, -1.0], [-1.0, 1.0]])


def pairs_within(nodes: NDArray) -> NDArray:
    """Rows and columns (n k k, 2) that n elements couple, each with k nodes or dofs (n, k)."""
    count = nodes.shape[1]
    rows, columns = np.repeat(nodes, count, axis=1), np.tile(nodes, (1, count))
    return np.stack([rows, columns], axis=2).reshape(-1, 2)


def pairs_of_ends(ends: NDArray) -> NDArray:
    """Rows and columns (k, 2) of the blocks of elements between ends (s, 2)."""
    grounded = ends[:, 1] < 0
    return np.concatenate([pairs_within(ends[grounded, :1]), pairs_within(ends[~grounded])])


def blocks_of_ends(ends: NDArray, resistance: NDArray) -> NDArray:
    """Blocks (k, 3, 3), at `pairs_of_ends`, of elements between ends (s, 2).

    Elements with one end on the ground, marked -1, come first.

    resistance : (s, 3, 3) matrices for motions of one end while the other end is fixed.
    """
    grounded = ends[:, 1] < 0
    between = np.einsum("ij,sab->sijab", BETWEEN, resistance[~grounded]).reshape(-1, 3, 3)
    return np.concatenate([resistance[grounded], between])


def places_of(pairs: NDArray) -> tuple[NDArray, NDArray]:
    """Rows and columns (9 k,) of the entries of blocks (k, 3, 3) at pairs (k, 2) of nodes."""
    shape, axis = (len(pairs), 3, 3), np.arange(3)
    row = np.broadcast_to(3 * pairs[:, 0, None, None] + axis[:, None], shape)
    column = np.broadcast_to(3 * pairs[:, 1, None, None] + axis, shape)
    return row.ravel(), column.ravel()


def assembled(pairs: NDArray, blocks: NDArray, size: int) -> sparse.csr_array:
    """Matrix (size, size) of blocks (k, 3, 3) at pairs (k, 2) of nodes; duplicates are added."""
    return sparse.csr_array((blocks.ravel(), places_of(pairs)), (size, size))


def of_elements(dofs: NDArray, matrices: NDArray, size: int) -> sparse.csr_array:
    """Matrix (size, size) of elements with dofs (n, k) and matrices (n, k, k), which are added."""
    return sparse.csr_array((matrices.ravel(), tuple(pairs_within(dofs).T)), (size, size))
