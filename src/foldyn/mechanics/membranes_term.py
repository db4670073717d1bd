"""Panels as coupled bars, as solvers see them; see `mechanics.membranes`."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.compiled import inner_scalar
from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.lanes import WIDTH
from foldyn.mechanics.membranes import (
    Back,
    Membranes,
    Packed,
    add_membrane_forces,
    add_pulls,
    back,
    membrane_blocks,
    multiply,
    packed,
    pull_membranes,
    put_strains,
    strain_places,
    strains_toward,
    taken,
    work_of,
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
    moved, weights = flat(rows_at(u, own.rows)), flat(rows_at(weight, own.rows))
    out = flat(rows_at(product, own.rows))
    pull_membranes(own.own, own.back, moved, weights, own.rows, out)


class _Context(NamedTuple):
    own: Packed  # with nodes of the thread
    whole: Packed
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
    panels, moved, energy = own.whole, flat(rows_at(u, own.rows)), 0.0
    for first in range(0, panels.count, WIDTH):
        put_strains(panels, first, moved, panels.apart, panels.strain)
        multiply(panels, first, panels.strain, panels.stress)
        energy += 0.5 * work_of(panels)
    numbers_at(out, GROUP + 1)[GROUP] += energy


@mean_forces
def _mean_forces(own, u0, u1, before, h, t, force, powers):
    """Uses mean strains and mid-step vectors, as energies are quadratic in strains and gives."""
    panels, out = own.whole, flat(rows_at(force, own.rows))
    start, end = flat(rows_at(u0, own.rows)), flat(rows_at(u1, own.rows))
    for first in range(0, panels.count, WIDTH):
        put_strains(panels, first, start, panels.apart, panels.strain)
        put_strains(panels, first, end, panels.other_apart, panels.other_strain)
        _take_mean(panels.apart, panels.other_apart)
        _take_mean(panels.strain, panels.other_strain)
        multiply(panels, first, panels.strain, panels.stress)
        add_pulls(panels, first, panels.apart, 0, own.rows, out)


@inner_scalar
def _take_mean(one, other):
    """Put the mean of both into the first."""
    for k in range(one.size):
        one[k] = 0.5 * (one[k] + other[k])


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
        whole = kept if kept.count == len(self.membranes.nodes) else packed(self.membranes)
        low, high = (int(end) for end in part.own)
        context = Context(_Context(kept, whole, low, high, self.rows, part.team))
        kernels = {FORCES: _forces, ENERGIES: _energies, MEAN_FORCES: _mean_forces}
        return CompiledTerm(context, kernels)

    def arrays(self) -> Arrays:
        """See `Term`."""
        return arrays_of(self.membranes)

    def pulled(self) -> Pulled:
        """See `Term`."""
        out = back(self.membranes)
        context = Context(_Backward(packed(self.membranes), out, self.rows))
        return Pulled(context, _pullback, out.of(self.membranes))

    @cached_property
    def places(self) -> tuple[NDArray, NDArray]:
        """See `Term`."""
        return strain_places(self.membranes)

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
        return membrane_blocks(self.membranes, nodal(q0), nodal(q1), strain).ravel()

    def unstrained(self, q: NDArray) -> Unstrained:
        """See `Term`."""
        size, places = (q.size, q.size), np.array(self.places)
        entries = self._entries(q, q, np.zeros(self.membranes.stiffness.shape[1:]))
        alone = np.isin(places, self.membranes.gives).all(axis=0)
        tangent = sparse.csr_array((entries, tuple(places)), size)
        kept = sparse.csr_array((entries[alone], tuple(places[:, alone])), size)
        return Unstrained(tangent, kept, lambda motion: 0.0)

    def strains(self, others: Strains) -> Strains:
        """See `Term`."""
        return others._replace(membranes=(*others.membranes, self.membranes))

    def anchored(self, place: NDArray) -> MembranesTerm:
        """See `Term`."""
        here = place[::3][self.membranes.nodes].min(axis=1) == 0
        stiffness = self.membranes.stiffness * here
        return MembranesTerm(self.membranes._replace(stiffness=stiffness), self.rows)

    def placed(self, order: NDArray, before: Any) -> MembranesTerm:
        """See `Term`."""
        nodes = ranks(order)[self.membranes.nodes]
        first = np.argsort(nodes.min(axis=1), kind="stable")  # neighbors stand near each other
        return MembranesTerm(taken(self.membranes._replace(nodes=nodes), first), self.rows)
