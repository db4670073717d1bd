"""Bars and hinges as plain arrays, for the compiled kernels.

Elements are sorted into runs of one law, so that the law is selected once per block of elements,
and within a run by their lowest node, so that neighbors in memory are neighbors in space. The
lowest nodes are sorted by groups of 16 only: within a group, elements with the same lowest node are
kept apart, because an addition to a sum that has just been written must wait.

A structure numbers vertices before panel centers, so that neighbors on a large sheet are far apart
in memory; long motions therefore renumber the nodes.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from foldyn.materials.law import BarLaw, HingeLaw

BLOCK = 64
GROUP = 16


class BarsHinges(NamedTuple):
    """Arrays of a bar-and-hinge model, n nodes, nb bars, nh hinges (SI).

    A run is a row (start, end, law code, row of `addresses`).
    """

    rest: NDArray  # (n, 3) rest position of the nodes from their mean, m
    bars: NDArray  # (nb, 2) uint32: signed indices would be tested for wraparound at every access
    bar_vector: NDArray  # (nb, 3) rest vector from the first node to the second, m
    bar_per_length2: NDArray  # (nb,) 1 / L^2
    bar_stiffness: NDArray  # (nb,) E A / L, N/m
    bar_runs: NDArray  # (rb, 4) int64
    hinges: NDArray  # (nh, 4) uint32: axis j, k, wings i, l
    hinge_stiffness: NDArray  # (nh,) N m/rad, whole hinge
    hinge_rest: NDArray  # (nh,) rad
    hinge_parameters: NDArray  # (nh, 4)
    hinge_share: NDArray  # (nh,) share of the crease in small turns; the rest is the panels'
    hinge_offset: NDArray  # (nh, 4) added to the dihedral, see `SheetTerm.series`
    hinge_group: NDArray  # (nh,) int64: energies are summed per group
    hinge_runs: NDArray  # (rh, 4) int64
    addresses: NDArray  # (na, 3) int64: compiled user laws (energy, response, slope)


# arrays of `BarsHinges` with a row for each bar, and for each hinge
OF_BARS = "bars", "bar_vector", "bar_per_length2", "bar_stiffness"
OF_HINGES = (
    "hinges", "hinge_stiffness", "hinge_rest", "hinge_parameters", "hinge_share", "hinge_offset",
    "hinge_group",
)  # fmt: skip


class Hinges(NamedTuple):
    """Hinges of one law: rows (axis j, k, wings i, l), stiffness, rest angle and law.

    parameters : (nh, 4) of each hinge, if they differ from the law's.
    share : (nh,) the crease's share of a turn (`materials.series`), if adjacent panels are
    compliant.
    group : number of the energy to which they add.
    """

    nodes: NDArray
    stiffness: NDArray
    rest: NDArray
    law: HingeLaw
    parameters: NDArray | None = None
    share: NDArray | None = None
    group: int = 0


def element_order(nodes: NDArray) -> NDArray:
    """Order (ne,) of the elements of a run, rows of nodes (ne, k), in a model."""
    if not len(nodes):
        return np.zeros(0, np.int64)
    lowest = nodes.min(axis=1).astype(np.int64)
    order = np.argsort(lowest, kind="stable")
    lowest = lowest[order]
    turn = np.arange(len(order)) - np.searchsorted(lowest, lowest)  # first, second, ... of a node
    return order[np.lexsort((lowest, turn, lowest // GROUP))]


def build(
    rest: NDArray, bars: NDArray, stiffness: NDArray, law: BarLaw, groups: tuple[Hinges, ...]
) -> BarsHinges:
    """Sort and pack bars (nb, 2) with stiffness E A / L and groups of hinges into a model."""
    addresses: list[tuple[int, int, int]] = []

    def run(start: int, end: int, of: BarLaw | HingeLaw) -> tuple[int, int, int, int]:
        if of.addresses is None:
            return start, end, of.code, 0
        addresses.append(of.addresses)
        return start, end, of.code, len(addresses) - 1

    order = element_order(bars)
    bars = np.ascontiguousarray(bars[order], np.uint32).reshape(-1, 2)
    vector = rest[bars[:, 1]] - rest[bars[:, 0]]
    bar_runs = [run(0, len(bars), law)]

    # groups with equal laws share a run: fewer blocks, and spatial neighbors together
    members: list[list[int]] = []
    for number, group in enumerate(groups):
        same = [m for m in members if groups[m[0]].law == group.law]
        same[0].append(number) if same else members.append([number])
    hinge_runs, start, orders = [], 0, []
    for numbers in members:
        nodes = np.concatenate([np.asarray(groups[k].nodes).reshape(-1, 4) for k in numbers])
        orders.append(element_order(nodes))
        hinge_runs.append(run(start, start + len(nodes), groups[numbers[0]].law))
        start += len(nodes)

    def gather(column: Any, shape: Any, kind: Any = float) -> NDArray:
        parts = [
            np.concatenate([np.asarray(column(k, groups[k])) for k in numbers])[order]
            for numbers, order in zip(members, orders, strict=True)
        ]
        joined = np.concatenate(parts) if parts else np.zeros(0)
        return np.ascontiguousarray(joined.reshape(shape), kind)

    return BarsHinges(
        rest=np.ascontiguousarray(rest - rest.mean(axis=0)),  # digits are lost far from the origin
        bars=bars,
        bar_vector=np.ascontiguousarray(vector),
        bar_per_length2=1.0 / np.einsum("ij,ij->i", vector, vector),
        bar_stiffness=np.ascontiguousarray(stiffness[order], float),
        bar_runs=np.array(bar_runs, np.int64).reshape(-1, 4),
        hinges=gather(lambda k, g: g.nodes, (-1, 4), np.uint32),
        hinge_stiffness=gather(lambda k, g: g.stiffness, -1),
        hinge_rest=gather(lambda k, g: g.rest, -1),
        hinge_parameters=gather(
            lambda k, g: g.law.parameters(g.rest) if g.parameters is None else g.parameters, (-1, 4)
        ),
        hinge_share=gather(lambda k, g: np.ones(len(g.rest)) if g.share is None else g.share, -1),
        hinge_offset=np.zeros((start, 4)),
        hinge_group=gather(lambda k, g: np.full(len(g.rest), g.group), -1, np.int64),
        hinge_runs=np.array(hinge_runs, np.int64).reshape(-1, 4),
        addresses=np.array(addresses or [(0, 0, 0)], np.int64),
    )


def node_order(model: BarsHinges) -> NDArray:
    """Order (n,) of the nodes with small index differences within elements.

    The reverse Cuthill-McKee order of the bar graph, or the current order if that is better.
    Sweeping over a rectangular sheet along its edges halves the differences, but is no faster.
    """
    n, (a, b) = len(model.rest), model.bars.astype(np.int64).T
    graph = sparse.csr_array((np.ones(2 * len(a)), (np.r_[a, b], np.r_[b, a])), (n, n))
    order = reverse_cuthill_mckee(graph, symmetric_mode=True).astype(np.int64)
    number = ranks(order)
    better = np.abs(number[a] - number[b]).max(initial=0) < np.abs(a - b).max(initial=0)
    return order if better else np.arange(n)


def renumber(model: BarsHinges, order: NDArray) -> tuple[BarsHinges, NDArray]:
    """Model whose node k is node order[k] of `model`, and the old rows (nh,) of its hinges.

    Laws, groups and parameters stay; elements are sorted again within their runs.
    """
    number = ranks(order).astype(np.uint32)
    bars, hinges = number[model.bars], number[model.hinges]
    model = model._replace(rest=model.rest[order], bars=bars, hinges=hinges)
    bar, hinge = _rows(bars, model.bar_runs), _rows(hinges, model.hinge_runs)
    of_bars = {name: getattr(model, name)[bar] for name in OF_BARS}
    return model._replace(**of_bars, **{n: getattr(model, n)[hinge] for n in OF_HINGES}), hinge


def ranks(order: NDArray) -> NDArray:
    """Place (n,) of each number in an order."""
    number = np.empty(len(order), np.int64)
    number[order] = np.arange(len(order))
    return number


def _rows(nodes: NDArray, runs: NDArray) -> NDArray:
    """Old rows of elements after sorting within their runs."""
    parts = [start + element_order(nodes[start:end]) for start, end in runs[:, :2]]
    return np.concatenate([np.zeros(0, np.int64), *parts])
