"""Panels as coupled bars, as solvers see them; see `mechanics.membranes`."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.block_matrix import pairs_within, places_of
from foldyn.mechanics.membranes import (
    Back,
    Membranes,
    Packed,
    add_membrane_forces,
    back,
    give_entries,
    membrane_blocks,
    packed,
    pull_membranes,
    strain_of,
    strains_toward,
    taken,
)
from foldyn.mechanics.model import ranks
from foldyn.mechanics.pullback import Arrays, Pulled, arrays_of, pullback
from foldyn.mechanics.term import (
    ENERGIES,
    FORCES,
    MEAN_FORCES,
    CompiledTerm,
    Strains,
    Term,
    Unstrained,
    Way,
    energies,
    forces,
    mean_forces,
    nodal,
)
from foldyn.mechanics.threads import Team, wait

GROUP = 0  # energy group of the bars, which membranes replace


class _Backward(NamedTuple):
    own: Packed
    back: Back
    rows: int


@pullback
def _pullback(own, u, v, t, weight, product, rate):
    moved, weights, out = (
        rows_at(u, own.rows), rows_at(weight, own.rows), rows_at(product, own.rows)
    )  # fmt: skip
    pull_membranes(own.own, own.back, flat(moved), flat(weights), flat(out))


class _Context(NamedTuple):
    own: Packed  # with nodes of the thread
    whole: Membranes
    low: int  # first and last + 1 of the thread's nodes
    high: int
    rows: int
    team: Team


@forces
def _forces(own, u, v, t, force, powers):
    moved, out = flat(rows_at(u, own.rows)), flat(rows_at(force, own.rows))
    add_membrane_forces(own.own, moved, own.low, own.high, out)
    wait(own.team)  # until all have read the displacements that other members change next


@energies
def _energies(own, u, out):
    membranes, moved, energy = own.whole, rows_at(u, own.rows), 0.0
    bars = membranes.ends.shape[0]
    strain, along = np.empty(bars + membranes.gives.shape[1]), np.empty(3)
    for p in range(membranes.nodes.shape[0]):
        for i in range(bars):
            strain[i] = strain_of(membranes, moved, p, i, along)
        for k in range(membranes.gives.shape[1]):
            strain[bars + k] = flat(moved)[membranes.gives[p, k]]
        for i in range(strain.size):
            for j in range(strain.size):
                energy += 0.5 * strain[i] * membranes.stiffness[i, j, p] * strain[j]
    numbers_at(out, GROUP + 1)[GROUP] += energy


@mean_forces
def _mean_forces(own, u0, u1, before, h, t, force, powers):
    """Uses mean strains and mid-step vectors, as energies are quadratic in strains and gives."""
    membranes, out = own.whole, rows_at(force, own.rows)
    start, end = rows_at(u0, own.rows), rows_at(u1, own.rows)
    bars, ends, given = membranes.ends.shape[0], membranes.ends, membranes.gives.shape[1]
    strain, along = np.empty(bars + given), np.empty((bars, 3))
    one, other = np.empty(3), np.empty(3)
    for p in range(membranes.nodes.shape[0]):
        for i in range(bars):
            strain[i] = 0.5 * strain_of(membranes, start, p, i, one)
            strain[i] += 0.5 * strain_of(membranes, end, p, i, other)
            for c in range(3):
                along[i, c] = 0.5 * (one[c] + other[c])
        for k in range(given):
            dof = membranes.gives[p, k]
            strain[bars + k] = 0.5 * (flat(start)[dof] + flat(end)[dof])
        for i in range(bars + given):
            pull = 0.0
            for j in range(bars + given):
                pull += membranes.stiffness[i, j, p] * strain[j]
            if i >= bars:
                flat(out)[membranes.gives[p, i - bars]] += pull
                continue
            pull *= membranes.per_length2[i, p]
            a, b = membranes.nodes[p, ends[i, 0]], membranes.nodes[p, ends[i, 1]]
            for c in range(3):
                out[b, c] += pull * along[i, c]
                out[a, c] -= pull * along[i, c]


class MembranesTerm(Term):
    """Panels of one kind; their energy counts as energy of the sheet's bars.

    Parameters
    ----------
    membranes : Membranes
    rows : int
        Number of rows of the arrays that hold the dofs.
    """

    shared = True

    def __init__(self, membranes: Membranes, rows: int) -> None:
        self.membranes, self.rows = membranes, rows
        self.owns_hidden = membranes.gives.size > 0

    def memories(self, parts: Sequence[Any]) -> list[Packed]:
        """See `Term`: each thread has the panels that its nodes belong to."""
        nodes, ends = self.membranes.nodes, [part.own for part in parts]
        here = [np.any((nodes >= low) & (nodes < high), axis=1) for low, high in ends]
        return [packed(taken(self.membranes, np.flatnonzero(own))) for own in here]

    @cached_property
    def memory(self) -> Packed:
        """See `Term`."""
        return packed(self.membranes)

    def compiled(self, part: Any, kept: Packed, group: int) -> CompiledTerm:
        """See `Term`."""
        low, high = (int(end) for end in part.own)
        context = _Context(kept, self.membranes, low, high, self.rows, part.team)
        return CompiledTerm(
            Context(context), {FORCES: _forces, ENERGIES: _energies, MEAN_FORCES: _mean_forces}
        )

    def arrays(self) -> Arrays:
        """See `Term`."""
        return arrays_of(self.membranes)

    def pulled(self) -> Pulled:
        """See `Term`."""
        own = back(self.membranes)
        gradient = {  # without the padding
            name: getattr(own, name).reshape(*array.shape[:-1], -1)[..., : array.shape[-1]]
            for name, array in self.arrays().numbers.items()
        }
        context = Context(_Backward(packed(self.membranes), own, self.rows))
        return Pulled(context, _pullback, gradient)

    @cached_property
    def places(self) -> tuple[NDArray, NDArray]:
        """See `Term`: between nodes, then nodes and gives, gives and nodes, and gives."""
        membranes = self.membranes
        row, column = places_of(pairs_within(membranes.nodes))
        nodal = (3 * membranes.nodes[:, :, None] + np.arange(3)).reshape(len(membranes.nodes), -1)
        rows, columns = [row], [column]
        gives = membranes.gives
        for one, other in ((nodal, gives), (gives, nodal), (gives, gives)):
            pairs = np.broadcast_arrays(one[:, :, None], other[:, None, :])
            rows.append(pairs[0].ravel())
            columns.append(pairs[1].ravel())
        return np.concatenate(rows), np.concatenate(columns)

    def entries(self, q: NDArray, floor: float = -np.inf) -> NDArray:
        """See `Term`."""
        return self.step_entries(q, (q, q), floor)

    def step_entries(self, q: NDArray, way: Way, floor: float) -> NDArray:
        """See `Term`."""
        return self._entries(q, q, self._strains(*way))

    def mean_entries(self, q0: NDArray, q1: NDArray, way: Way, floor: float) -> NDArray:
        """See `Term`."""
        strain = 0.5 * (self._strains(q0, q0) + self._strains(*way))
        return 0.5 * self._entries(q0, q1, strain)

    def _strains(self, q0: NDArray, q1: NDArray) -> NDArray:
        given = np.ravel(q1)[self.membranes.gives.T]
        return np.concatenate([strains_toward(self.membranes, nodal(q0), nodal(q1)), given])

    def _entries(self, q0: NDArray, q1: NDArray, strain: NDArray) -> NDArray:
        given = self.membranes, nodal(q0), nodal(q1)
        entries = [membrane_blocks(*given, strain)]
        if self.membranes.gives.size:
            entries += give_entries(*given)
        return np.concatenate([each.ravel() for each in entries])

    def unstrained(self, q: NDArray) -> Unstrained:
        """See `Term`."""
        size, gives = (q.size, q.size), self.membranes.gives
        strain = np.zeros(self.membranes.stiffness.shape[1:])
        entries = (self._entries(q, q, strain), self.places)
        tangent = sparse.csr_array(sparse.coo_array(entries, size))
        first = len(entries[0]) - gives.size * gives.shape[1]  # gives come last
        alone = entries[0][first:], tuple(place[first:] for place in self.places)
        kept = sparse.csr_array(sparse.coo_array(alone, size))
        return Unstrained(tangent, kept, lambda motion: 0.0)

    def strains(self, others: Strains) -> Strains:
        """See `Term`."""
        return others._replace(membranes=(*others.membranes, self.membranes))

    def placed(self, order: NDArray, before: Any) -> MembranesTerm:
        """See `Term`."""
        nodes = ranks(order)[self.membranes.nodes]
        first = np.argsort(nodes.min(axis=1), kind="stable")  # neighbors stand near each other
        return MembranesTerm(taken(self.membranes._replace(nodes=nodes), first), self.rows)
