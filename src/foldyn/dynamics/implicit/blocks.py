"""The tangent of a model as 3x3 blocks, whatever the kind of the model."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from foldyn.dynamics.implicit.tangent import put_tangent
from foldyn.dynamics.kinds import rows_of
from foldyn.mechanics import BarsHinges, Sparsity, node_order, sparsity
from foldyn.shells.extrapolated import add_extrapolated_strain
from foldyn.shells.kernels import ShellModel, shell_work
from foldyn.shells.sparsity import shell_pattern
from foldyn.shells.tangent import shell_tangent
from foldyn.statics.body import FLOOR


class Blocks(Protocol):
    """Blocks of a model's tangent.

    Attributes
    ----------
    pattern : Sparsity
        Where they stand.
    order : ndarray of int
        All dofs, 3 row + axis, in an order that keeps a factorization narrow.
    unused : ndarray of int
        Dofs that only fill up the last row.
    """

    pattern: Sparsity
    order: NDArray
    unused: NDArray

    def put(
        self, model: Any, pattern: Sparsity, u: NDArray, before: NDArray, again: bool, out: NDArray
    ) -> None:
        """Fill `out` (nnz, 3, 3) of a pattern that contains this one; see `put_tangent`."""
        ...

    def filled(self, pattern: Sparsity) -> NDArray:
        """Which entries (nnz, 3, 3) of a pattern that contains this one `put` may fill."""
        ...


class BarsHingesBlocks:
    """Blocks of bars and hinges; see `Blocks`."""

    def __init__(self, model: Any) -> None:
        self.pattern = sparsity(model)
        self.order = (3 * _narrow_order(model, self.pattern)[:, None] + np.arange(3)).ravel()
        self.unused = np.zeros(0, np.int64)

    def put(
        self, model: Any, pattern: Sparsity, u: NDArray, before: NDArray, again: bool, out: NDArray
    ) -> None:
        """See `Blocks`."""
        put_tangent(model, pattern, u, before, again, out)

    def filled(self, pattern: Sparsity) -> NDArray:
        """See `Blocks`."""
        return np.ones((len(pattern.indices), 3, 3), bool)


def _narrow_order(model: BarsHinges, pattern: Sparsity) -> NDArray:
    """Order of the nodes (n,) with the narrowest band: sweeps along the axes, or `node_order`."""
    row = np.repeat(np.arange(len(model.rest)), np.diff(pattern.indptr))
    return _narrowest(node_order(model), model.rest, row, pattern.indices)


def _narrowest(order: NDArray, position: NDArray, row: NDArray, column: NDArray) -> NDArray:
    """`order` of places (n,), or a sweep along an axis if it couples none as far apart.

    On a rectangular sheet a sweep along its longer side has half the width of other orders.

    position : (n, 3).
    row, column : places that are coupled.
    """
    size = np.ptp(position, axis=0).max()
    x, y, z = np.round(position / size, 6).T  # so that rows of nodes are straight
    sweeps = [np.lexsort(keys) for keys in ((z, y, x), (z, x, y), (y, x, z))]

    def width(order: NDArray) -> int:
        number = np.empty(len(position), np.int64)
        number[order] = np.arange(len(position))
        return int(np.abs(number[row] - number[column]).max())

    return min((order, *sweeps), key=width)


class ShellBlocks:
    """Blocks of a shell, whose rotations follow the nodes, three to a row; see `Blocks`."""

    def __init__(self, model: ShellModel) -> None:
        self._own, self._work, rows = shell_pattern(model), shell_work(model), rows_of(model)
        own = self._own
        row = np.repeat(np.arange(own.size), np.diff(own.indptr))
        ones = sparse.csr_array((np.ones(len(row), np.int8), own.indices, own.indptr))
        ones.resize((3 * rows, 3 * rows))
        blocks = ones.tobsr((3, 3))
        blocks.sort_indices()
        empty = np.zeros(0, np.int64)
        self.pattern = Sparsity(
            blocks.indptr.astype(np.int32), blocks.indices.astype(np.int32),
            empty.reshape(0, 2, 2), empty.reshape(0, 4, 4),
        )  # fmt: skip
        self._row, self._column = row, own.indices.astype(np.int64)
        self._place: tuple[Sparsity, NDArray] | None = None
        self.unused = np.arange(own.size, 3 * rows)
        order = reverse_cuthill_mckee(ones.tocsr(), symmetric_mode=True).astype(np.int64)
        self.order = _narrowest(order, _positions(model, 3 * rows), self._row, self._column)

    def put(
        self, model: ShellModel, pattern: Sparsity, u: NDArray, before: NDArray, again: bool,
        out: NDArray,
    ) -> None:  # fmt: skip
        """See `Blocks`."""
        n, end = model.nodes, 3 * model.nodes + model.rotations
        rotation = u.reshape(-1)[3 * n : end]
        floor = -np.inf if model.code < 0 else FLOOR
        matrix = shell_tangent(model, self._own, u[:n], rotation, self._work, floor)
        if again:
            add_extrapolated_strain(model, self._own, u[:n], before[:n], matrix.data)
        out[:] = 0.0
        out.reshape(-1)[self._places(pattern)] = matrix.data

    def filled(self, pattern: Sparsity) -> NDArray:
        """See `Blocks`; three rotations that share a row of blocks may lie far apart."""
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


def _positions(model: ShellModel, size: int) -> NDArray:
    """Where in the shell its dofs are (size, 3): rotations in the middle of their sides."""
    found = np.zeros((size, 3))
    n, tri = model.nodes, model.triangles
    found[: 3 * n] = np.repeat(model.rest[:n], 3, axis=0)
    middle = 0.5 * (model.rest[tri] + model.rest[np.roll(tri, -1, axis=1)])
    has = model.rotation >= 0
    found[3 * n + model.rotation[has]] = middle[has]
    return found


def blocks_of(model: Any) -> Blocks:
    """Blocks of a model."""
    return ShellBlocks(model) if isinstance(model, ShellModel) else BarsHingesBlocks(model)
