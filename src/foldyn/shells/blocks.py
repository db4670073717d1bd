"""The tangent of a shell as 3x3 blocks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from foldyn.mechanics import Sparsity
from foldyn.mechanics.blocks import narrowest
from foldyn.shells.kernels import ShellModel, shell_work
from foldyn.shells.sparsity import ShellPattern
from foldyn.shells.step_tangent import shell_step_tangent


class ShellBlocks:
    """Blocks of a shell, whose rotations follow the nodes, three to a row.

    See `mechanics.body.Blocks`. `own` is the pattern of its tangent.
    """

    def __init__(self, model: ShellModel, own: ShellPattern) -> None:
        self._own, self._work, rows = own, shell_work(model), model.rows
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
        self.order = narrowest(order, _positions(model, 3 * rows), self._row, self._column)

    def put(
        self, model: ShellModel, pattern: Sparsity, u: NDArray, before: NDArray, again: bool,
        out: NDArray,
    ) -> None:  # fmt: skip
        """See `Blocks`."""
        n, end = model.nodes, 3 * model.nodes + model.rotations
        x, old = u.reshape(-1)[3 * n : end], before[:n] if again else None
        matrix = shell_step_tangent(model, self._own, u[:n], x, self._work, old)
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
