"""A body whose parts touch each other and planes, as solvers see it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.mechanics.block_matrix import assembled, pairs_within
from foldyn.mechanics.body import Blocks, Body, Unstrained
from foldyn.mechanics.contact.approach import KEEP, clear_share
from foldyn.mechanics.contact.forces import add_contact
from foldyn.mechanics.contact.friction import Friction, stored
from foldyn.mechanics.contact.holding import held_by_panels, held_by_planes
from foldyn.mechanics.contact.memory import Memory, memories, memory
from foldyn.mechanics.contact.model import TouchingWork, contact_term
from foldyn.mechanics.contact.pairs import VERTEX
from foldyn.mechanics.contact.rubbing import add_rubs
from foldyn.mechanics.contact.tables import HISTORY, NORMAL, Sheets, Tables, tables
from foldyn.mechanics.contact.tangent import (
    guard_tangents,
    pair_tangents,
    plane_tangents,
    touching_pairs,
)
from foldyn.mechanics.tangent import Sparsity
from foldyn.mechanics.term import Term
from foldyn.mechanics.wrapped_body import WrappedBody

GROUP = "contact"


class TouchingBody(WrappedBody):
    """A body with contact; see `mechanics.body.Body`.

    Friction acts where springs are tied: on paths of equilibria (`rubbing`), and in motions, which
    have memory of their own. Elsewhere there is none.

    Parameters
    ----------
    inner : Body
    sheets : Sheets
        What may touch.
    like : TouchingBody, optional
        One with the same nodes and hinges.
    """

    def __init__(self, inner: Body, sheets: Sheets, like: TouchingBody | None = None) -> None:
        super().__init__(inner)
        self.sheets, self._like = sheets, like
        self._moved = np.zeros((len(sheets.planes), 3))
        self.energy_groups = (*inner.energy_groups, GROUP)

    @property
    def has_discrete_gradient(self) -> bool:  # type: ignore[override]
        """See `Body`: that of contact is the solver's."""
        return self.inner.has_discrete_gradient

    @cached_property
    def tables(self) -> Tables:
        """What may touch, as arrays."""
        if self._like is not None:
            return self._like.tables
        return tables(self.sheets, self.inner.hinges.astype(np.int64))

    @cached_property
    def _memory(self) -> Memory:
        """Lists of pairs for the evaluations below, which they find again where they serve."""
        if self._like is not None:
            return self._like._memory
        return memory(self.tables, self.sheets.panels)

    def around(self, inner: Body) -> TouchingBody:
        """See `WrappedBody`."""
        body = TouchingBody(inner, self.sheets, self)
        body._moved = self._moved
        return body

    def displaced(self, moved: NDArray) -> TouchingBody:
        """The same with planes displaced by `moved` (p, 3), m."""
        body = self.around(self.inner)
        body._moved = np.asarray(moved, float)
        return body

    def rubbing(self) -> tuple[TouchingBody, Friction]:
        """The same with springs of friction, and what keeps where they are tied."""
        body = self.around(self.inner)
        body._memory = memory(self.tables, self.sheets.panels)
        return body, Friction(body.tables, body._memory)

    def driven(self, rows: Mapping[int, int]) -> TouchingBody:
        """The same with planes, by number, that move with histories of these numbers."""
        planes = self.sheets.planes.copy()
        for plane, row in rows.items():
            planes[plane, HISTORY] = row
        return TouchingBody(self.inner, replace(self.sheets, planes=planes))

    # ------------------------------------------------------------------ mechanics
    def contact(self, q: NDArray) -> tuple[float, NDArray]:
        """Energy (J) of contact alone and the force (n, 3), N, against it, friction included."""
        u = self.nodal(q)
        force = np.zeros_like(u)
        add_contact(self.tables, u, self.inner.angles(q), force, self._placed())
        return float(self._memory.facts.energy), force

    def nearest(self, q: NDArray) -> tuple[float, float, NDArray]:
        """Energy (J) of contact between panels, and which of them are nearest to each other.

        That is the least distance over the one at which they begin to touch, and the panels
        (1, 2), the lower first; inf and none, (0, 2), where no panels are near.
        """
        body = self.around(self.inner)
        own = body.tables = self.tables._replace(planes=self.tables.planes[:0])
        kept = body._memory = memory(own, self.sheets.panels)  # pairs are listed here
        body._moved = np.zeros((0, 3))
        energy = body.contact(q)[0]
        counts = int(kept.counts.listed_first), int(kept.counts.listed_second)
        share = np.concatenate(
            [1.0 + kept.gap[k, :n] / kept.d0[k, :n] for k, n in enumerate(counts)]
        )
        if not share.size:
            return energy, np.inf, np.zeros((0, 2), np.int64)
        worst = int(share.argmin())
        kind, row = (0, worst) if worst < counts[0] else (1, worst - counts[0])
        one, other = kept.pairs[kind, row]
        panels = own.edge_panels[[one, other], 0]
        if kind == VERTEX:
            panels = np.array([own.ranges.own[own.ranges.own_start[one]], own.panel[other]])
        return energy, float(share[worst]), np.sort(panels)[None]

    def _placed(self) -> Memory:
        """The memory with the planes where they are."""
        self._memory.moved[:, :3] = self._moved
        return self._memory

    def touch(self, q: NDArray) -> NDArray:
        """Size (n,), N, of the force of contact on each node, without friction."""
        force = self.contact(q)[1]
        rub = np.zeros_like(force)
        if self.tables.friction > 0.0:
            add_rubs(self.tables, self._memory, rub)
        return np.linalg.norm(force - rub - self._memory.friction[:, :, :3].sum(axis=0), axis=1)

    def energies(self, q: NDArray) -> NDArray:
        """See `Body`; what springs of friction store counts to contact."""
        energy = self.contact(q)[0] + stored(self.tables, self._memory)
        return np.append(self.inner.energies(q), energy)

    def internal(self, q: NDArray, work: TouchingWork | None = None) -> NDArray:
        """See `Body`."""
        inner = self.inner.internal(q, work.inner if work else None)
        return inner + self.added(self.contact(q)[1])

    def hinge_forces(self, q: NDArray, work: TouchingWork | None = None) -> NDArray:
        """See `Body`."""
        return self.inner.hinge_forces(q, work.inner if work else None)

    def tangent(self, q: NDArray, floor: float = -np.inf) -> sparse.csr_array:
        """See `Body`."""
        return sparse.csr_array(self.inner.tangent(q, floor) + self.contact_tangent(q))

    def step_tangent(self, q: NDArray, before: NDArray | None = None) -> sparse.csr_array:
        """See `Body`."""
        return sparse.csr_array(self.inner.step_tangent(q, before) + self.contact_tangent(q))

    def contact_tangent(self, q: NDArray) -> sparse.csr_array:
        """The derivative (m, m), N/m, of the forces of contact."""
        self.contact(q)
        return contact_tangent(self.tables, self._memory, self.size)

    def clear(self, q: NDArray, step: NDArray, moves: NDArray, keep: float = KEEP) -> float:
        """Share of a step (m,) from q in which nothing crosses, while planes move (p, 3), m."""
        u, motion = self.nodal(q), self.nodal(step)
        return clear_share(self.tables, self._placed(), u, motion, moves, keep)

    def plane_forces(self, q: NDArray) -> NDArray:
        """Force (p, 3), N, of each plane on the nodes, without friction."""
        self.contact(q)
        pressed = self._memory.friction[:, :, 3].sum(axis=1)
        return pressed[:, None] * self.tables.planes[:, NORMAL : NORMAL + 3]

    def plane_friction(self, q: NDArray) -> NDArray:
        """Friction (p, 3), N, of each plane on the nodes."""
        self.contact(q)
        return -self._memory.friction[:, :, :3].sum(axis=1)

    def plane_tangents(self, q: NDArray) -> NDArray:
        """Derivatives (p, n, 3, 3), N/m, of the forces against each plane."""
        self.contact(q)
        return plane_tangents(self.tables, self._memory.x, self._memory)

    def blocks(self) -> InnerBlocks:
        """See `Body`: of the body within; which nodes touch changes, so contact is apart."""
        return InnerBlocks(self.inner.blocks())

    def workspaces(self, threads: int) -> Sequence[TouchingWork]:
        """See `Body`."""
        works: Sequence[Any] = self.inner.workspaces(threads)
        if len(works) == 1:  # which owns further rows, if there are some
            kept = [memory(self.tables, self.sheets.panels)]
        else:
            teams, own = [work.team for work in works], [work.strips.own for work in works]
            kept = memories(self.tables, self.sheets.panels, teams, own)
        return [
            TouchingWork(work, work.angle, work.fold_angle, work.strips, work.team, own)
            for work, own in zip(works, kept, strict=True)
        ]

    def terms(self, work: TouchingWork) -> list[Term]:
        """See `Body`."""
        group = len(self.inner.energy_groups)
        own = contact_term(self.tables, work.memory, work.angle, group, self.rows)
        return [*self.inner.terms(work.inner), own]

    @property
    def threads(self) -> int:
        """See `Body`."""
        return self.inner.threads

    # ------------------------------------------------------------------ other bodies
    def renumbered(self) -> tuple[TouchingBody, NDArray]:
        """See `Body`."""
        inner, order = self.inner.renumbered()
        return TouchingBody(inner, self.sheets.placed(order)), order

    def nominal(self, q: NDArray) -> Body:
        """See `Body`: without contact."""
        return self.inner.nominal(q)

    def holds(self, q: NDArray) -> sparse.csr_array:
        """See `Body`: planes hold nodes that touch them, and panels each other."""
        return sparse.csr_array(sparse.vstack([self.inner.holds(q), self._held(q)]))

    def _held(self, q: NDArray) -> sparse.csr_array:
        """Rows (s, m): distances of what touches, and motions along all axes where it rubs."""
        self.contact(q)
        on_planes = held_by_planes(self.tables, self._memory, self.size)
        return sparse.csr_array(
            sparse.vstack([on_planes, held_by_panels(self.tables, self._memory, self.size)])
        )

    def unstrained(self, q: NDArray) -> Unstrained | None:
        """See `Body`: of contact, what holds."""
        inner, held = self.inner.unstrained(q), self._held(q)
        if inner is None or not held.shape[0]:
            return inner

        def stretch(mode: NDArray) -> float:
            return max(inner.stretch(mode), float(np.abs(held @ mode).max() / np.abs(mode).max()))

        own = self.tables.stiffness * (held.T @ held)
        return inner._replace(tangent=sparse.csr_array(inner.tangent + own), stretch=stretch)


class InnerBlocks:
    """Blocks of the body within one with contact; see `mechanics.body.Blocks`."""

    def __init__(self, inner: Blocks) -> None:
        self._inner = inner
        self.pattern, self.order, self.unused = inner.pattern, inner.order, inner.unused

    def put(
        self, body: Body, pattern: Sparsity, u: NDArray, before: NDArray, again: bool, out: NDArray
    ) -> None:
        """See `Blocks`."""
        own = body.inner if isinstance(body, TouchingBody) else body
        self._inner.put(own, pattern, u, before, again, out)

    def filled(self, pattern: Sparsity) -> NDArray:
        """See `Blocks`."""
        return self._inner.filled(pattern)


def contact_tangent(own: Tables, kept: Memory, size: int) -> sparse.csr_array:
    """The derivative (size, size), N/m, of the forces of contact where they were last found."""
    first, second = touching_pairs(own, kept)
    nodes = np.empty((len(first) + len(second), 4), np.int64)
    blocks = np.zeros((len(nodes), 12, 12))
    pair_tangents(own, kept, first, second, nodes, blocks)
    guards = np.zeros((len(own.hinge_limit), 4, 3, 4, 3))
    acts = guard_tangents(own, kept.x, guards)
    nodes = np.concatenate([nodes, own.hinges[acts]])
    four = np.concatenate([blocks.reshape(-1, 4, 3, 4, 3), guards[acts]])
    pairs, entries = [pairs_within(nodes)], [four.swapaxes(2, 3).reshape(-1, 3, 3)]
    if len(own.planes):
        normal = plane_tangents(own, kept.x, kept).sum(axis=0)
        met = np.flatnonzero(normal.any(axis=(1, 2)))
        pairs.append(np.column_stack([met, met]))
        entries.append(normal[met])
    return assembled(np.concatenate(pairs), np.concatenate(entries), size)
