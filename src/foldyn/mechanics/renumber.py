"""Nodes and elements of a model in an order in which neighbors in space are neighbors in memory.

The numbering of a structure is its user's; a long motion of a large sheet is computed in another.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

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
