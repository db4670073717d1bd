"""A body whose hinges have memory, as solvers see it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.mechanics.body import Blocks, Body, Unstrained
from foldyn.mechanics.inelastic import (
    MemoryHinges,
    add_memory_forces,
    evaluate_at,
    make_last,
    memory_gradients,
    memory_tangents,
    memory_term,
)
from foldyn.mechanics.step_tangent import FLOOR
from foldyn.mechanics.tangent import Sparsity, block_keys, joined
from foldyn.mechanics.term import Term
from foldyn.mechanics.viscous import WIDTH
from foldyn.mechanics.wrapped_body import WrappedBody


class Memory:
    """The state of the branches of a body, which changes in place.

    Parameters
    ----------
    own : MemoryHinges
    settles : ndarray of bool, shape (b,)
        Branches that a motion finds settled where it starts, unless it is told otherwise.
    """

    def __init__(self, own: MemoryHinges, settles: NDArray) -> None:
        self.own, self.settles = own, settles

    def start(self, offset: NDArray, q: NDArray, state: NDArray | str | None = None) -> None:
        """Begin at the dofs q (rows, 3) in a state (b, 2), "fresh", or the default.

        offset : see `Body.series`.
        """
        own = self.own
        for array in (own.angle, own.state, own.elapsed, own.lost):
            array[:] = 0.0
        evaluate_at(own, offset, q)  # turned from rest in no time
        make_last(own)
        own.lost[:] = 0.0
        if isinstance(state, np.ndarray):
            own.state[:] = state
        elif state is None:
            own.state[self.settles] = 0.0
        evaluate_at(own, offset, q)

    def commit(self) -> None:
        """Accept the step that ends where the body was evaluated last."""
        make_last(self.own)

    def still(self) -> None:
        """Evaluate next at the last accepted step."""
        self.own.elapsed[0] = 0.0

    def snapshot(self) -> tuple[NDArray, ...]:
        """The last accepted step, to `recall`."""
        return tuple(array.copy() for array in self._kept)

    def recall(self, snapshot: Sequence[NDArray]) -> None:
        """Go back to an accepted step."""
        for array, kept in zip(self._kept, snapshot, strict=True):
            array[:] = kept
        self.still()

    @property
    def _kept(self) -> tuple[NDArray, ...]:
        return self.own.angle, self.own.state, self.own.lost

    def gradients(self, q: NDArray, size: int) -> sparse.csr_array:
        """Gradients (h, size) of the angles at the dofs q (m,)."""
        out = np.zeros((len(self.own.rest), WIDTH))
        memory_gradients(self.own, np.ascontiguousarray(q, float), out)
        row = np.repeat(np.arange(len(out)), WIDTH)
        entries = (out.ravel(), (row, self.own.dofs.ravel()))
        rates = sparse.csr_array(sparse.coo_array(entries, shape=(len(out), size)))
        rates.eliminate_zeros()
        return rates


class InelasticBody(WrappedBody):
    """A body whose hinges have memory; see `mechanics.body.Body`.

    Parameters
    ----------
    inner : Body
        The same with the elastic parts of the laws.
    memory : Memory
    """

    def __init__(self, inner: Body, memory: Memory) -> None:
        super().__init__(inner)
        self.memory = memory
        self.energy_groups = inner.energy_groups
        self._offset = inner.series()[1]

    def _rows(self, q: NDArray) -> NDArray:
        """Dofs (m,) or (rows, 3) as (rows, 3)."""
        flat = np.ascontiguousarray(q, float).ravel()
        return np.pad(flat, (0, 3 * self.rows - flat.size)).reshape(-1, 3)

    def around(self, inner: Body) -> InelasticBody:
        """See `WrappedBody`; the branches measure from the rest angles that they have had."""
        return InelasticBody(inner, self.memory)

    def energies(self, q: NDArray) -> NDArray:
        """See `Body`; with what the branches store."""
        own = self.memory.own
        evaluate_at(own, self._offset, self._rows(q))
        return self.inner.energies(q) + np.bincount(own.group, own.stored, len(self.energy_groups))

    def internal(self, q: NDArray, work: Any = None) -> NDArray:
        """See `Body`."""
        force = np.zeros((self.rows, 3))
        add_memory_forces(self.memory.own, self._offset, self._rows(q), force)
        return self.inner.internal(q, work) + force.ravel()[: self.size]

    def hinge_forces(self, q: NDArray, work: Any = None) -> NDArray:
        """See `Body`: of the elastic parts."""
        return self.inner.hinge_forces(q, work)

    def tangent(self, q: NDArray, floor: float = -np.inf) -> sparse.csr_array:
        """See `Body`."""
        return self._plus(self.inner.tangent(q, floor), q)

    def step_tangent(self, q: NDArray, before: NDArray | None = None) -> sparse.csr_array:
        """See `Body`; what yields without hardening keeps a little stiffness."""
        return self._plus(self.inner.step_tangent(q, before), q, FLOOR)

    def tangents(self, q: NDArray, floor: float = -np.inf) -> NDArray:
        """Derivatives (h, 14, 14) of the forces of the branches.

        floor : least slope per unit stiffness of a hinge whose elastic part has 1.
        """
        own, u = self.memory.own, self._rows(q)
        out = np.empty((len(own.rest), WIDTH, WIDTH))
        evaluate_at(own, self._offset, u)
        np.maximum(own.slope, (floor - 1.0) * own.stiffness, out=own.slope)
        memory_tangents(own, u, out)
        return out

    def _plus(
        self, matrix: sparse.csr_array, q: NDArray, floor: float = -np.inf
    ) -> sparse.csr_array:
        dofs = self.memory.own.dofs
        shape = (len(dofs), WIDTH, WIDTH)
        row = np.broadcast_to(dofs[:, :, None], shape).ravel()
        column = np.broadcast_to(dofs[:, None, :], shape).ravel()
        entries = (self.tangents(q, floor).ravel(), (row, column))
        return sparse.csr_array(matrix + sparse.coo_array(entries, shape=matrix.shape))

    def blocks(self) -> InelasticBlocks:
        """See `Body`."""
        return InelasticBlocks(self.inner.blocks(), self.memory.own, self.rows)

    def workspaces(self, threads: int) -> Sequence[Any]:
        """See `Body`: one thread."""
        return self.inner.workspaces(1)

    def terms(self, work: Any) -> list[Term]:
        """See `Body`."""
        own = memory_term(self.memory.own, self._offset, self.rows, len(self.energy_groups))
        return [*self.inner.terms(work), own]

    def nominal(self, q: NDArray) -> Body:
        """See `Body`: of the elastic parts, with the slopes of the branches."""
        return self.around(self.inner.nominal(q))

    def unstrained(self, q: NDArray) -> Unstrained | None:
        """See `Body`: of the elastic parts."""
        return self.inner.unstrained(q)


class InelasticBlocks:
    """Blocks of a body whose hinges have memory; see `mechanics.body.Blocks`."""

    def __init__(self, inner: Blocks, own: MemoryHinges, rows: int) -> None:
        self._inner = inner
        mine = np.ones(own.dofs.shape, bool)  # dofs that a hinge has
        mine[:, 12:] = own.hidden_turn > 0.0
        self._pairs = mine[:, :, None] & mine[:, None, :]
        self._row = np.broadcast_to(own.dofs[:, :, None], self._pairs.shape)[self._pairs]
        self._column = np.broadcast_to(own.dofs[:, None, :], self._pairs.shape)[self._pairs]
        self._keys = self._row // 3 * rows + self._column // 3
        self.pattern = joined(inner.pattern, self._keys)
        self.order, self.unused = inner.order, inner.unused

    def put(
        self, body: InelasticBody, pattern: Sparsity, u: NDArray, before: NDArray, again: bool,
        out: NDArray,
    ) -> None:  # fmt: skip
        """See `Blocks`."""
        self._inner.put(body.inner, pattern, u, before, again, out)
        values = body.tangents(u, FLOOR)[self._pairs]
        out.reshape(-1)[:] += np.bincount(self._slots(pattern), values, out.size)

    def filled(self, pattern: Sparsity) -> NDArray:
        """See `Blocks`."""
        filled = self._inner.filled(pattern)
        filled.reshape(-1)[self._slots(pattern)] = True
        return filled

    def _slots(self, pattern: Sparsity) -> NDArray:
        """Where the entries stand among those of a pattern's blocks."""
        block = np.searchsorted(block_keys(pattern.indptr, pattern.indices), self._keys)
        return 9 * block + 3 * (self._row % 3) + self._column % 3
