"""The free dofs' block of matrices that keep their sparsity pattern."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse


class Reduction:
    """Takes the block of the free dofs out of matrices of one sparsity pattern."""

    def __init__(self, free: NDArray) -> None:
        self.free = free
        self._pattern: tuple[NDArray, NDArray] | None = None

    def __call__(self, matrix: sparse.csr_array) -> sparse.csc_array:
        """Block of the free dofs, by columns (which, the matrix being symmetric, are its rows)."""
        pattern = (matrix.indptr, matrix.indices)
        if self._pattern is None or not all(map(np.array_equal, pattern, self._pattern)):
            self._prepare(matrix)
        size = len(self.free)
        return sparse.csc_array(
            (matrix.data[self._take], self._indices, self._indptr), shape=(size, size)
        )

    def _prepare(self, matrix: sparse.csr_array) -> None:
        self._pattern = (matrix.indptr.copy(), matrix.indices.copy())
        numbered = sparse.csr_array(
            (np.arange(matrix.nnz, dtype=np.int64), matrix.indices, matrix.indptr),
            shape=matrix.shape,
        )
        block = numbered[self.free][:, self.free].tocsr()
        block.sort_indices()
        self._take, self._indices, self._indptr = block.data, block.indices, block.indptr
