"""Tangents at many states as dense matrices, without a sparse one for each term and state."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.tangent import add_tangent
from foldyn.mechanics.term import Term, nodal
from foldyn.structures.bars_hinges import BarsHingesTerm


class Tangents:
    """Tangents of a body on the unknowns, or on vectors of them.

    Entries go straight to their places where nothing ties the dofs together; those of further terms
    and bodies take the way of sparse matrices.

    Parameters
    ----------
    body : Assembly
    basis : sparse (m, k)
        Displacements of all dofs per unknown.
    free : ndarray, shape (k,), or None
        Dofs of the unknowns where each is one by itself.
    vectors : ndarray, shape (k, r), optional
        On which tangents are projected.
    """

    def __init__(
        self, body: Assembly, basis: sparse.csr_array, free: NDArray | None,
        vectors: NDArray | None = None,
    ) -> None:  # fmt: skip
        self._basis, self._free, self._vectors, size = basis, free, vectors, basis.shape[1]
        kept: dict[int, tuple[NDArray, NDArray]] = {}  # of the sheet (-1) and of terms
        if free is not None:
            rank = np.full(body.size, -1)
            rank[free] = np.arange(size)
            if isinstance(body.sheet, BarsHingesTerm):
                kept[-1] = _places(rank, *_of_blocks(body.sheet))
            for k, term in enumerate(body.others):
                if type(term).tangent is Term.tangent:
                    kept[k] = _places(rank, *term.places)
        every = [np.zeros(0, np.int64), *(place for _, place in kept.values())]
        self._union = np.unique(np.concatenate(every))
        self._own = {k: (at, np.searchsorted(self._union, of)) for k, (at, of) in kept.items()}
        row, column = np.divmod(self._union, max(size, 1))
        ends = np.searchsorted(row, np.arange(size + 1))
        zeros = np.zeros(len(column))
        self._matrix = sparse.csr_array((zeros, column, ends), (size, size))

    def of(self, body: Assembly) -> Tangents:
        """Those of another body on the same unknowns."""
        return Tangents(body, self._basis, self._free, self._vectors)

    def put(self, body: Assembly, u: NDArray, out: NDArray) -> None:
        """Put the tangent at displacements u (m,) into `out`."""
        data, sheet, rest = np.zeros(len(self._union)), body.sheet, None
        if -1 in self._own and isinstance(sheet, BarsHingesTerm):
            kept, place = self._own[-1]
            blocks = np.zeros((len(sheet.sparsity.indices), 3, 3))
            add_tangent(sheet.model, sheet.sparsity, nodal(u), -np.inf, blocks)
            data[place] = blocks.ravel()[kept]
        else:
            rest = sheet.tangent(u)
        for k, term in enumerate(body.others):
            if k in self._own:
                kept, place = self._own[k]
                data += np.bincount(place, term.entries(u)[kept], len(data))
            else:
                found = term.tangent(u)
                if found.nnz:  # what touches nothing has no stiffness
                    rest = found if rest is None else rest + found
        if self._vectors is None:
            out[:] = 0.0
            out.reshape(-1)[self._union] = data
            if rest is not None:
                out += (self._basis.T @ rest @ self._basis).toarray()
            return
        self._matrix.data = data
        along = self._matrix @ self._vectors
        if rest is not None:
            along += self._basis.T @ (rest @ (self._basis @ self._vectors))
        out[:] = self._vectors.T @ along


def _of_blocks(sheet: BarsHingesTerm) -> tuple[NDArray, NDArray]:
    """Row and column of each entry of the blocks of a sheet's tangent."""
    pattern, axis = sheet.sparsity, np.arange(3)
    node = np.repeat(np.arange(len(pattern.indptr) - 1), np.diff(pattern.indptr))
    row = np.broadcast_to((3 * node[:, None] + axis)[:, :, None], (len(node), 3, 3))
    column = np.broadcast_to((3 * pattern.indices[:, None] + axis)[:, None], row.shape)
    return row.ravel(), column.ravel()


def _places(rank: NDArray, row: NDArray, column: NDArray) -> tuple[NDArray, NDArray]:
    """Which entries of a matrix of all dofs are kept, and their places among those kept."""
    kept = np.flatnonzero((rank[row] >= 0) & (rank[column] >= 0))
    return kept, rank[row[kept]] * (rank.max() + 1) + rank[column[kept]]
