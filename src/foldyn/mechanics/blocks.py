"""Tangents as 3x3 blocks for the matrix of implicit steps, in orders that keep it narrow."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from foldyn.mechanics.body import Body
from foldyn.mechanics.model import BarsHinges
from foldyn.mechanics.renumber import node_order, ranks
from foldyn.mechanics.step_tangent import put_tangent
from foldyn.mechanics.tangent import Sparsity, sparsity


class BarsHingesBlocks:
    """Blocks of bars and hinges; see `mechanics.body.Blocks`."""

    def __init__(self, model: BarsHinges) -> None:
        self.pattern = sparsity(model)
        row = np.repeat(np.arange(len(model.rest)), np.diff(self.pattern.indptr))
        order = narrowest(node_order(model), model.rest, row, self.pattern.indices)
        self.order = (3 * order[:, None] + np.arange(3)).ravel()
        self.unused = np.zeros(0, np.int64)

    def put(
        self, body: Body, pattern: Sparsity, u: NDArray, before: NDArray, again: bool, out: NDArray
    ) -> None:
        """See `Blocks`."""
        put_tangent(body.model, pattern, u, before, again, out)

    def filled(self, pattern: Sparsity) -> NDArray:
        """See `Blocks`."""
        return np.ones((len(pattern.indices), 3, 3), bool)


class SparseBlocks:
    """Blocks of any sparse tangent, with hidden dofs three to a row.

    Parameters
    ----------
    tangent : csr_array, shape (m, m)
        Where its entries are: those of `Body.step_tangent`, in their order.
    rows : int
    position : ndarray, shape (3 rows, 3)
        Where the dofs are, m.
    """

    def __init__(self, tangent: sparse.csr_array, rows: int, position: NDArray) -> None:
        size = tangent.shape[0]
        self._row = np.repeat(np.arange(size), np.diff(tangent.indptr))
        self._column = tangent.indices.astype(np.int64)
        ones = sparse.csr_array((np.ones(len(self._row), np.int8), tangent.indices, tangent.indptr))
        ones.resize((3 * rows, 3 * rows))
        blocks = ones.tobsr((3, 3))
        blocks.sort_indices()
        empty = np.zeros(0, np.int64)
        self.pattern = Sparsity(
            blocks.indptr.astype(np.int32), blocks.indices.astype(np.int32),
            empty.reshape(0, 2, 2), empty.reshape(0, 4, 4),
        )  # fmt: skip
        self._place: tuple[Sparsity, NDArray] | None = None
        self.unused = np.arange(size, 3 * rows)
        order = reverse_cuthill_mckee(ones.tocsr(), symmetric_mode=True).astype(np.int64)
        self.order = narrowest(order, position, self._row, self._column)

    def put(
        self, body: Body, pattern: Sparsity, u: NDArray, before: NDArray, again: bool, out: NDArray
    ) -> None:
        """See `Blocks`."""
        out[:] = 0.0
        matrix = body.step_tangent(u, before if again else None)
        out.reshape(-1)[self._places(pattern)] = matrix.data

    def filled(self, pattern: Sparsity) -> NDArray:
        """See `Blocks`; three dofs that share a row of blocks may lie far apart."""
        found = np.zeros((len(pattern.indices), 3, 3), bool)
        found.reshape(-1)[self._places(pattern)] = True
        return found

    def _places(self, pattern: Sparsity) -> NDArray:
        """Where the entries stand among those of a pattern's blocks."""
        if self._place is None or self._place[0] is not pattern:
            rows = len(pattern.indptr) - 1
            node = np.repeat(np.arange(rows), np.diff(pattern.indptr))
            keys = node * rows + pattern.indices
            block = np.searchsorted(keys, self._row // 3 * rows + self._column // 3)
            self._place = pattern, 9 * block + 3 * (self._row % 3) + self._column % 3
        return self._place[1]


def narrowest(order: NDArray, position: NDArray, row: NDArray, column: NDArray) -> NDArray:
    """`order` of places (n,), or a sweep along an axis if it couples none as far apart.

    On a rectangular sheet a sweep along its longer side has half the width of other orders.

    position : (n, 3).
    row, column : places that are coupled.
    """
    size = np.ptp(position, axis=0).max()
    x, y, z = np.round(position / size, 6).T  # so that rows of nodes are straight
    sweeps = [np.lexsort(keys) for keys in ((z, y, x), (z, x, y), (y, x, z))]

    def width(order: NDArray) -> int:
        number = ranks(order)
        return int(np.abs(number[row] - number[column]).max())

    return min((order, *sweeps), key=width)
