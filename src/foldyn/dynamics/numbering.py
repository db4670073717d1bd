"""The order of the nodes in memory while a motion is computed.

A case numbers vertices before panel centers, so that neighbors on a large sheet stand far apart in
memory. Inside the compiled loops nodes stand along the sheet; what goes in and what comes out has
the case's own numbers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.mechanics import BarsHinges, node_order, renumber

SMALL = 300  # nodes below which all values are in the cache anyway


class Numbering(NamedTuple):
    """Place k in memory holds node order[k]; node i stands at place rank[i]."""

    order: NDArray  # (n,)
    rank: NDArray  # (n,)
    hinge: NDArray  # (nh,) row of each hinge of the case's model in the renumbered one

    def inward(self, values: NDArray) -> NDArray:
        """Values per node (n, ...) as they stand in memory."""
        return np.ascontiguousarray(values[self.order])

    def outward(self, values: NDArray) -> NDArray:
        """Values per place (n, ...) by node."""
        return np.ascontiguousarray(values[self.rank])

    def dofs(self, dofs: NDArray) -> NDArray:
        """Numbers 3 place + axis of dofs 3 node + axis."""
        return (3 * self.rank[np.asarray(dofs) // 3] + np.asarray(dofs) % 3).astype(np.int64)

    def matrix(self, matrix: sparse.csr_array) -> sparse.csr_array:
        """Nodal (n, n) or dof (3n, 3n) matrix as it stands in memory."""
        places = self.order
        if matrix.shape[0] == 3 * len(places):
            places = (3 * places[:, None] + np.arange(3)).ravel()
        found = sparse.csr_array(matrix[places][:, places])
        found.sort_indices()
        return found


def renumbered(model: BarsHinges) -> tuple[BarsHinges, Numbering]:
    """Model with its nodes along the sheet, if it is large enough to gain from it."""
    if len(model.rest) < SMALL:
        nodes = np.arange(len(model.rest))
        return model, Numbering(nodes, nodes, np.arange(len(model.hinges)))
    order = node_order(model)
    model, rows = renumber(model, order)
    return model, Numbering(order, _inverse(order), _inverse(rows))


def _inverse(order: NDArray) -> NDArray:
    places = np.empty(len(order), np.int64)
    places[order] = np.arange(len(order))
    return places
