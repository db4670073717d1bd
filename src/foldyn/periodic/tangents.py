"""Tangents at many states as dense matrices, without a sparse matrix per term and state."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.tangent import add_tangent
from foldyn.mechanics.term import Term, nodal
from foldyn.structures.bars_hinges import BarsHingesTerm


class Tangents:
    """Tangents of a body with respect to the unknowns, or along vectors of them.

    Entries are added directly in their places; terms with unknown places, such as contact, and
    sheets other than bars and hinges go through sparse matrices.

    Parameters
    ----------
    body : Assembly
    basis : sparse (m, k)
        Displacements of all dofs per unknown.
    vectors : ndarray, shape (k, r), optional
        Vectors on which tangents are projected.
    """

    def __init__(
        self, body: Assembly, basis: sparse.csr_array, vectors: NDArray | None = None
    ) -> None:
        self._basis, self._vectors, size = basis, vectors, basis.shape[1]
        places: dict[int, tuple[NDArray, NDArray]] = {}  # of the sheet (-1) and of terms
        if isinstance(body.sheet, BarsHingesTerm):
            places[-1] = _of_blocks(body.sheet)
        for k, term in enumerate(body.others):
            if type(term).tangent is Term.tangent:
                places[k] = term.places
        spread = {k: _spread(basis, *at) for k, at in places.items()}
        every = [np.zeros(0, np.int64), *(place for place, _, _ in spread.values())]
        self._union = union = np.unique(np.concatenate(every))
        self._own = {
            k: sparse.csr_array(
                (weight, (np.searchsorted(union, place), entry)), (len(union), len(places[k][0]))
            )
            for k, (place, entry, weight) in spread.items()
        }
        row, column = np.divmod(self._union, max(size, 1))
        ends = np.searchsorted(row, np.arange(size + 1))
        zeros = np.zeros(len(column))
        self._matrix = sparse.csr_array((zeros, column, ends), (size, size))

    def of(self, body: Assembly) -> Tangents:
        """Tangents of another body with respect to the same unknowns."""
        return Tangents(body, self._basis, self._vectors)

    def put(self, body: Assembly, u: NDArray, out: NDArray) -> None:
        """Write the tangent at displacements u (m,) into `out`."""
        data, sheet, rest = np.zeros(len(self._union)), body.sheet, None
        if -1 in self._own and isinstance(sheet, BarsHingesTerm):
            blocks = np.zeros((len(sheet.sparsity.indices), 3, 3))
            add_tangent(sheet.model, sheet.sparsity, nodal(u), -np.inf, blocks)
            data += self._own[-1] @ blocks.ravel()
        else:
            rest = sheet.tangent(u)
        for k, term in enumerate(body.others):
            if k in self._own:
                data += self._own[k] @ term.entries(u)
            else:
                found = term.tangent(u)
                if found.nnz:  # without contact there is no stiffness
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


def _spread(
    basis: sparse.csr_array, row: NDArray, column: NDArray
) -> tuple[NDArray, NDArray, NDArray]:
    """Contributions of entries at rows and columns (e,) to a matrix of the k unknowns.

    Returns their places k row + column in it, the numbers of the entries, and factors on these.
    """
    one, other = basis[row], basis[column]
    width = np.diff(other.indptr)
    count = np.diff(one.indptr) * width
    entry = np.repeat(np.arange(len(row)), count)
    turn = np.arange(len(entry)) - np.repeat(np.cumsum(count) - count, count)
    i = one.indptr[entry] + turn // width[entry]
    j = other.indptr[entry] + turn % width[entry]
    place = one.indices[i].astype(np.int64) * basis.shape[1] + other.indices[j]
    return place, entry, one.data[i] * other.data[j]
