"""Nodes and elements in an order in which neighbors in space are neighbors in memory.

A structure numbers vertices before panel centers, so that neighbors on a large sheet stand far
apart in memory. While a motion is computed nodes stand along the sheet; what goes in and what comes
out has the structure's own numbers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from foldyn.mechanics.body import Body
from foldyn.mechanics.model import BarsHinges, element_order


def node_order(model: BarsHinges) -> NDArray:
    """Order (n,) of the nodes in which the numbers within an element differ little.

    The reverse Cuthill-McKee order of the graph of bars, or the order as it is, if that is better.
    Sweeping over a rectangular sheet along its edges halves the differences, but is no quicker.
    """
    n, (a, b) = len(model.rest), model.bars.astype(np.int64).T
    graph = sparse.csr_array((np.ones(2 * len(a)), (np.r_[a, b], np.r_[b, a])), (n, n))
    order = reverse_cuthill_mckee(graph, symmetric_mode=True).astype(np.int64)
    number = ranks(order)
    better = np.abs(number[a] - number[b]).max(initial=0) < np.abs(a - b).max(initial=0)
    return order if better else np.arange(n)


def renumber(model: BarsHinges, order: NDArray) -> tuple[BarsHinges, NDArray]:
    """Model whose node k is node order[k] of `model`, and the old rows (nh,) of its hinges.

    Laws, groups and parameters stay; elements are sorted anew within their runs.
    """
    number = ranks(order).astype(np.uint32)
    bars, hinges = number[model.bars], number[model.hinges]
    bar, hinge = _rows(bars, model.bar_runs), _rows(hinges, model.hinge_runs)
    moved = model._replace(
        rest=model.rest[order],
        bars=bars[bar],
        bar_vector=model.bar_vector[bar],
        bar_per_length2=model.bar_per_length2[bar],
        bar_stiffness=model.bar_stiffness[bar],
        hinges=hinges[hinge],
        hinge_stiffness=model.hinge_stiffness[hinge],
        hinge_rest=model.hinge_rest[hinge],
        hinge_parameters=model.hinge_parameters[hinge],
        hinge_group=model.hinge_group[hinge],
    )
    return moved, hinge


def ranks(order: NDArray) -> NDArray:
    """Place (n,) of each number in an order."""
    number = np.empty(len(order), np.int64)
    number[order] = np.arange(len(order))
    return number


def _rows(nodes: NDArray, runs: NDArray) -> NDArray:
    """Old rows of elements whose runs are sorted anew."""
    parts = [start + element_order(nodes[start:end]) for start, end in runs[:, :2]]
    return np.concatenate([np.zeros(0, np.int64), *parts])


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
