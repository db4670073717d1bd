"""Entries added to sparse matrices repeatedly at the same places."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.compiled import kernel
from foldyn.mechanics.tangent import block_keys, distinct


class Slots:
    """Positions of entries at rows and columns (k,) in matrices that mostly share a pattern."""

    def __init__(self, row: NDArray, column: NDArray) -> None:
        self._row, self._column = row.astype(np.int64), column.astype(np.int64)
        self._found: tuple[NDArray, ...] = ()  # pattern of the last matrix, and derived data

    def added(self, matrix: sparse.csr_array, entries: NDArray) -> sparse.csr_array:
        """Add entries (k,) to the matrix, in place or in a matrix with more places; return it."""
        if not len(entries):
            return matrix
        matrix.sort_indices()
        of = matrix.indices, matrix.indptr
        if not self._found or not all(map(np.array_equal, of, self._found)):
            self._found = *of, *self._find(*of)
        indices, indptr, own, slots = self._found[2:]
        data = matrix.data
        if len(data) < len(indices):
            data = np.zeros(len(indices))
            data[own] = matrix.data
            matrix = sparse.csr_array((data, indices, indptr), matrix.shape)
        add_at(slots, entries, data)
        return matrix

    def _find(self, indices: NDArray, indptr: NDArray) -> tuple[NDArray, ...]:
        """Pattern of the sum, and the slots of the matrix's entries and of added entries in it."""
        size = len(indptr) - 1
        own, new = block_keys(indptr, indices), self._row * size + self._column
        both = distinct(np.concatenate([own, new]))
        row, column = np.divmod(both, size)
        ends = np.searchsorted(row, np.arange(size + 1))
        found = column, ends, np.searchsorted(both, own), np.searchsorted(both, new)
        return tuple(array.astype(np.int32) for array in found)


@kernel
def add_at(slots, values, out):
    """Add values (k,) to out[slots]."""
    for k in range(slots.size):
        out[slots[k]] += values[k]
