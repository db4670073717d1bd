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

from foldyn.mechanics.body import Body
from foldyn.mechanics.renumber import ranks


class Numbering(NamedTuple):
    """Place k in memory holds node order[k]; node i stands at place rank[i].

    After the nodes come the rows of the dofs beside displacements, which keep their order.
    """

    order: NDArray  # (n,)
    rank: NDArray  # (n,)
    rows: int  # of arrays in memory, n or more

    def inward(self, values: NDArray) -> NDArray:
        """Values per node (n, ...) as they stand in memory, zero in further rows (rows, ...)."""
        out = np.zeros((self.rows, *values.shape[1:]), values.dtype)
        out[: len(self.order)] = values[self.order]
        return out

    def held(self, fixed: NDArray) -> NDArray:
        """Mask of held dofs (n, 3) as it stands in memory, True in further rows (rows, 3)."""
        out = self.inward(fixed)
        out[len(self.order) :] = True
        return out

    def outward(self, values: NDArray) -> NDArray:
        """Values per place (n, ...) by node."""
        return np.ascontiguousarray(values[self.rank])

    def dofs(self, dofs: NDArray) -> NDArray:
        """Numbers 3 place + axis of dofs 3 node + axis."""
        return (3 * self.rank[np.asarray(dofs) // 3] + np.asarray(dofs) % 3).astype(np.int64)

    def matrix(self, matrix: sparse.csr_array) -> sparse.csr_array:
        """Nodal (n, n) matrix, or one of all dofs, as it stands in memory."""
        places, size = self.order, self.rows
        if matrix.shape[0] > len(places):
            places = (3 * places[:, None] + np.arange(3)).ravel()
            places = np.concatenate([places, np.arange(len(places), matrix.shape[0])])
            size = 3 * self.rows
        found = sparse.csr_array(sparse.csr_array(matrix)[places][:, places])
        found.resize((size, size))
        found.sort_indices()
        return found


def renumbered(body: Body) -> tuple[Body, Numbering]:
    """The body as it stands in memory while a motion is computed."""
    body, order = body.renumbered()
    return body, Numbering(order, ranks(order), body.rows)
