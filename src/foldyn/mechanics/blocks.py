"""The tangent of bars and hinges as 3x3 blocks, and orders that keep a factorization narrow."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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
        self, model: BarsHinges, pattern: Sparsity, u: NDArray, before: NDArray, again: bool,
        out: NDArray,
    ) -> None:  # fmt: skip
        """See `Blocks`."""
        put_tangent(model, pattern, u, before, again, out)

    def filled(self, pattern: Sparsity) -> NDArray:
        """See `Blocks`."""
        return np.ones((len(pattern.indices), 3, 3), bool)


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
