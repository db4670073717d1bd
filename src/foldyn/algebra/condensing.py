"""Condensing definite matrices of equal sparsity to their last unknowns, eight at a time.

The symbolic Cholesky factorization is done once, in an order with little fill-in. The values of
eight matrices are stored side by side, so that one pass over the entries factorizes all eight.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.superlu import SingularTangentError, factorize
from foldyn.jit.compiled import kernel
from foldyn.jit.eights import COUNT, eight, put


class Condensing:
    """Condenses matrices (size, size) to the `kept` last unknowns.

    Parameters
    ----------
    pairs : (k, 2)
        Pairs of unknowns with an entry, each pair once, in any order, including the whole diagonal.
    size, kept : int

    Attributes
    ----------
    entries : int
        Number of entries of the factors.
    places : (k,)
        Position of each pair among the entries of the factors.
    """

    def __init__(self, pairs: NDArray, size: int, kept: int) -> None:
        free = size - kept
        rank = np.append(_order(pairs[(pairs < free).all(axis=1)], free), np.arange(free, size))
        row, column = rank[pairs].max(axis=1), rank[pairs].min(axis=1)
        last = np.arange(free, size)
        below = [set() for _ in range(free)] + [set(range(j, size)) for j in range(free, size)]
        for i, j in zip(row.tolist(), column.tolist(), strict=True):
            below[j].add(i)
        found: list[int] = []
        for own in below:  # fill-in: eliminating an unknown couples all neighbors of it
            coupled = sorted(own)
            found += coupled
            if len(coupled) > 1:
                below[coupled[1]].update(coupled[1:])
        rows = np.array(found)
        columns = np.repeat(np.arange(size), [len(own) for own in below])
        keys = columns * size + rows
        self.places = np.searchsorted(keys, column * size + row)
        low, high = np.minimum.outer(last, last), np.maximum.outer(last, last)
        self._block = np.searchsorted(keys, low * size + high)
        pointers = np.searchsorted(columns, np.arange(size + 1))
        entry = np.flatnonzero((rows > columns) & (columns < free))
        entry = entry[np.argsort(rows[entry], kind="stable")]
        starts = np.searchsorted(rows[entry], np.arange(size + 1))
        factors = rows, pointers, entry, pointers[columns[entry] + 1], starts
        self._factors = tuple(part.astype(np.int32) for part in factors)
        self.entries = len(rows)
        self._free, self._size = free, size

    def __call__(self, values: NDArray) -> NDArray:
        """Condensed matrices (c, kept, kept) of at most eight matrices with entries (k, c)."""
        numbers = np.zeros((self.entries, COUNT))
        numbers[self.places] = values[:, np.minimum(np.arange(COUNT), values.shape[1] - 1)]
        return self.left(numbers)[: values.shape[1]]

    def left(self, numbers: NDArray) -> NDArray:
        """Condense eight matrices with `numbers` (`entries`, 8) to (8, kept, kept).

        The factors overwrite `numbers`.

        Raises
        ------
        SingularTangentError
            A matrix is not positive definite.
        """
        condense(*self._factors, self._free, np.zeros(self._size, np.int64), numbers.reshape(-1))
        out = np.moveaxis(numbers[self._block], -1, 0)
        if not np.isfinite(out).all():
            raise SingularTangentError("the matrix is not positive definite")
        return out


def _order(pairs: NDArray, size: int) -> NDArray:
    """Positions (size,) of the unknowns in an order with little fill-in.

    The order is found from some definite matrix with these pairs of unknowns.
    """
    off = pairs[pairs[:, 0] != pairs[:, 1]]
    diagonal = np.arange(size)
    rows = np.concatenate([off[:, 0], off[:, 1], diagonal])
    columns = np.concatenate([off[:, 1], off[:, 0], diagonal])
    values = np.append(-np.ones(2 * len(off)), np.full(size, float(size)))
    matrix = sparse.csc_array(sparse.coo_array((values, (rows, columns)), shape=(size, size)))
    return factorize(matrix).perm_c


@kernel
def condense(rows, pointers, entry, until, starts, free, where, numbers):
    """Eliminate the first `free` unknowns of eight matrices.

    rows, pointers : (k,) rows of the entries by columns, the diagonal first; (n + 1,) first entry
    of each column.
    entry, until, starts : (e,) off-diagonal entries by rows, in eliminated columns only; (e,) ends
    of the columns that they are in; (n + 1,) first of them in each row.
    where : (n,) scratch memory.
    numbers : (8 k,) entries; overwritten by the factors and, in the last columns, by the condensed
    matrices.
    """
    for j in range(starts.size - 1):
        for p in range(pointers[j], pointers[j + 1]):
            where[rows[p]] = COUNT * p
        for e in range(starts[j], starts[j + 1]):
            factor = eight(numbers, COUNT * np.int64(entry[e]))
            for p in range(entry[e], until[e]):
                at = where[rows[p]]
                product = factor * eight(numbers, COUNT * np.int64(p))
                put(numbers, at, eight(numbers, at) - product)
        if j < free:
            scale = 1.0 / math.sqrt(eight(numbers, COUNT * np.int64(pointers[j])))
            for p in range(pointers[j] + 1, pointers[j + 1]):
                at = COUNT * np.int64(p)
                put(numbers, at, scale * eight(numbers, at))
