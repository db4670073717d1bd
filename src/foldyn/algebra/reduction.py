"""The block of the free dofs, taken from matrices with a fixed sparsity pattern."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

ROUNDING = 1e-12  # differences from the transpose below this share of the largest entry are zero


class Block(NamedTuple):
    """A block by columns, and its symmetric part; one object if it is symmetric to rounding."""

    exact: sparse.csc_array
    symmetric: sparse.csc_array

    @property
    def is_symmetric(self) -> bool:
        """Whether the block is symmetric to rounding."""
        return self.exact is self.symmetric


class Reduction:
    """Extracts the block of the free dofs from matrices of one sparsity pattern."""

    def __init__(self, free: NDArray) -> None:
        self.free = free
        self._pattern: tuple[NDArray, NDArray] | None = None

    def __call__(self, matrix: sparse.csr_array) -> Block:
        """Block of the free dofs."""
        pattern = (matrix.indptr, matrix.indices)
        if self._pattern is None or not all(map(np.array_equal, pattern, self._pattern)):
            self._prepare(matrix)
        values = matrix.data[self._take]
        if self._mirror is None:
            rows = sparse.csr_array((values, self._indices, self._indptr), shape=self._shape)
            return Block(rows.tocsc(), sparse.csc_array(0.5 * (rows + rows.T)))
        mirrored = values[self._mirror]
        apart, largest = np.abs(values - mirrored), np.abs(values)
        if not apart.max(initial=0.0) > ROUNDING * largest.max(initial=0.0):
            rows = self._by_columns(values)  # columns equal rows, as the matrix is symmetric
            return Block(rows, rows)
        return Block(self._by_columns(mirrored), self._by_columns(0.5 * (values + mirrored)))

    def _by_columns(self, values: NDArray) -> sparse.csc_array:
        return sparse.csc_array((values, self._indices, self._indptr), shape=self._shape)

    def _prepare(self, matrix: sparse.csr_array) -> None:
        self._pattern = (matrix.indptr.copy(), matrix.indices.copy())
        entries = np.arange(matrix.nnz, dtype=np.int64), matrix.indices, matrix.indptr
        numbered = sparse.csr_array(entries, shape=matrix.shape)
        block = numbered[self.free][:, self.free].tocsr()
        block.sort_indices()
        self._take, self._indices, self._indptr = block.data, block.indices, block.indptr
        self._shape = block.shape
        block.data = np.arange(block.nnz)
        other = block.T.tocsr()
        other.sort_indices()
        alike = np.array_equal(other.indptr, block.indptr)
        alike = alike and np.array_equal(other.indices, block.indices)
        self._mirror = other.data if alike else None  # position of each transposed entry
