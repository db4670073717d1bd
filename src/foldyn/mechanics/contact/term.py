"""Contact of a sheet with itself and with planes, as solvers see it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.context import Context
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.contact.candidates import HISTORY, NORMAL, Sheets, Tables, tables
from foldyn.mechanics.contact.ccd import KEEP, clear_share
from foldyn.mechanics.contact.contact_state import Memory, memories, memory
from foldyn.mechanics.contact.distances import VERTEX
from foldyn.mechanics.contact.friction import Friction, stored
from foldyn.mechanics.contact.kernels import add_contact, contact_kernels
from foldyn.mechanics.contact.panel_friction import add_rubs
from foldyn.mechanics.contact.tangent import (
    guard_tangents,
    held_by_panels,
    held_by_planes,
    of_contacts,
    pair_tangents,
    plane_tangents,
    touching_pairs,
)
from foldyn.mechanics.term import CompiledTerm, Term, Unstrained, nodal

GROUP = "contact"


class ContactTerm(Term):
    """Contact; see `Term`.

    Friction acts only if its springs are tied: on paths of equilibria (`rubbing`), and in motions,
    which have their own memory.

    The set of touching nodes changes, so the entries of the tangent have no fixed places in a
    step's matrix.

    Parameters
    ----------
    sheets : Sheets
        Contact surfaces.
    guarded : Assembly
        The preceding terms, whose hinges the contact guards.

    Attributes
    ----------
    eased : bool
        Whether slow contacts may get inertia.
    """

    energy_groups: ClassVar[Mapping[str, str]] = {GROUP: "energy of contact"}
    shared = True
    eased: ClassVar[bool] = True
    undifferentiated: ClassVar[str] = "contact"

    def __init__(self, sheets: Sheets, guarded: Assembly) -> None:
        self.sheets, self._guarded = sheets, guarded
        self._moved = np.zeros((len(sheets.planes), 3))

    @cached_property
    def tables(self) -> Tables:
        """Contact surfaces as arrays."""
        return tables(self.sheets, self._guarded.hinges)

    @cached_property
    def memory(self) -> Memory:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Memory with pair lists, which evaluations reuse while valid; see `Term`."""
        return memory(self.tables, self.sheets.panels)

    def _copy(self, **changes: Any) -> ContactTerm:
        """Copy with changed attributes, but the same tables and, unless given, lists."""
        _ = self._contexts  # creates tables and lists as well
        other = copy(self)
        if not changes.keys() & {"tables", "memory"}:
            other._contexts = self._contexts
        vars(other).update(changes)
        return other

    @cached_property
    def _contexts(self) -> tuple[Context, Context]:
        """Contexts of tables and memory, so that Python and loops call the same kernels."""
        return Context(self.tables), Context(self.memory)

    def __getstate__(self) -> dict[str, Any]:
        """State without objects that hold addresses of this process."""
        return {name: value for name, value in vars(self).items() if name != "_contexts"}

    def displaced(self, moved: NDArray) -> ContactTerm:
        """Copy with planes displaced by `moved` (p, 3), m."""
        return self._copy(_moved=np.asarray(moved, float))

    def rubbing(self) -> tuple[ContactTerm, Friction]:
        """Copy with friction springs, and the `Friction` that holds their anchors."""
        own = memory(self.tables, self.sheets.panels)
        return self._copy(memory=own), Friction(self.tables, own)

    def driven(self, rows: Mapping[int, int]) -> ContactTerm:
        """Copy whose planes follow histories; `rows` has each history's row by plane index."""
        planes = self.sheets.planes.copy()
        for plane, row in rows.items():
            planes[plane, HISTORY] = row
        return type(self)(replace(self.sheets, planes=planes), self._guarded)

    # ------------------------------------------------------------------ as a term
    def compiled(self, part: Any, kept: Memory, group: int) -> CompiledTerm:
        """Context and kernels for a thread; see `Term`."""
        return contact_kernels(self.tables, kept, part.angle, group)

    def memories(self, parts: Sequence[Any]) -> list[Memory]:
        """Kernel memory for each thread; see `Term`."""
        if len(parts) == 1:  # a single thread owns further rows, too
            return [memory(self.tables, self.sheets.panels)]
        teams, own = [part.team for part in parts], [part.own for part in parts]
        return memories(self.tables, self.sheets.panels, teams, own)

    def prepare(self) -> None:
        """Set the planes to their current displacements; see `Term`."""
        self.memory.moved[:, :3] = self._moved

    def stored(self) -> float:
        """Energy (J) stored in friction springs; see `Term`."""
        return stored(self.tables, self.memory)

    def tangent(self, q: NDArray, floor: float = -np.inf) -> sparse.csr_array:
        """Tangent (m, m), N/m; see `Term`."""
        if self.contact(q)[0] == 0.0:  # nothing touches
            return sparse.csr_array((q.size, q.size))
        return self.tangent_at(q, self.memory)

    def tangent_at(self, q: NDArray, kept: Memory) -> sparse.csr_array:
        """Tangent at q (m,) or (rows, 3), where contact was last evaluated with this memory."""
        return contact_tangent(self.tables, kept, q.size)

    def placed(self, order: NDArray, before: Assembly) -> ContactTerm:
        """The term with nodes in memory order; see `Term`."""
        return type(self)(self.sheets.placed(order), before)

    def nominal(self, q: NDArray) -> None:
        """None: contact has no nominal stiffness. See `Term`."""

    def holds(self, q: NDArray) -> sparse.csr_array:
        """Internal constraints: planes hold touching nodes, panels each other; see `Term`."""
        return self.held(q, q.size)

    def held(self, q: NDArray, size: int) -> sparse.csr_array:
        """Unit rows (s, size) of the internal constraints for motions of the contact points."""
        self.contact(q)
        on_planes = held_by_planes(self.tables, self.memory, size)
        on_panels = held_by_panels(self.tables, self.memory, size)
        return sparse.csr_array(sparse.vstack([on_planes, on_panels]))

    def unstrained(self, q: NDArray) -> Unstrained | None:
        """Contact as linear springs along its internal constraints; see `Term`."""
        held = self.holds(q)
        if not held.shape[0]:
            return None
        return Unstrained(
            sparse.csr_array(self.tables.stiffness * (held.T @ held)),
            sparse.csr_array((q.size, q.size)),
            lambda motion: float(np.abs(held @ motion).max() / np.abs(motion).max()),
        )

    # ------------------------------------------------------------------ points that touch
    def points(self, q: NDArray) -> NDArray:
        """Displacements (m, 3), m, of the contact points, here the nodes."""
        return nodal(q)[: len(self.tables.rest)]

    @property
    def nodes(self) -> NDArray:
        """Node (m,) that each contact point belongs to."""
        return np.arange(len(self.tables.rest))

    def carried(self, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Contact points (m,) that depend on the chosen nodes (n,) only."""
        return chosen

    def on_nodes(self, q: NDArray, force: NDArray) -> NDArray:
        """Nodal forces (n, 3), N, that are equivalent to forces (m, 3) on the contact points."""
        return force

    def step_back(self, u0: NDArray, u1: NDArray, force: NDArray) -> NDArray:
        """Nodal forces (n, 3), N, that do the work of the contact points' forces in a step."""
        return force

    def step_tangent(
        self, u0: NDArray, u1: NDArray, force: NDArray, inner: sparse.csr_array
    ) -> sparse.csr_array:
        """Derivative (m, m), N/m, of `step_back` with respect to u1.

        inner : derivative of the forces with respect to the displacements of the contact points.
        """
        inner.resize((u0.size, u0.size))
        return inner

    # ------------------------------------------------------------------ forces
    def contact(self, q: NDArray) -> tuple[float, NDArray]:
        """Contact energy (J) at q, and its gradient (n, 3), N, friction included."""
        energy, force = self.touching(q)
        return energy, self.on_nodes(q, force)

    def touching(self, q: NDArray) -> tuple[float, NDArray]:
        """Contact energy (J) at q, and its gradient (m, 3), N, at the contact points."""
        u = self.points(q)
        force = np.zeros_like(u)
        self.prepare()
        tables, kept = self._contexts
        add_contact(tables, u, self._guarded.angles(q), force, kept)
        return float(self.memory.facts.energy), force

    def nearest(self, q: NDArray) -> tuple[float, float, NDArray]:
        """Contact energy (J) between panels, and the closest two panels.

        Returns the energy, the least ratio of distance to contact distance, and the panels (1, 2),
        the lower first. If no panels are near, the ratio is inf, and the panels are (0, 2).
        """
        own = self.tables._replace(planes=self.tables.planes[:0])
        kept = memory(own, self.sheets.panels)  # lists pairs
        energy = self._copy(tables=own, memory=kept, _moved=np.zeros((0, 3))).contact(q)[0]
        counts = int(kept.counts.listed_first), int(kept.counts.listed_second)
        parts = [1.0 + kept.gap[k, :n] / kept.d0[k, :n] for k, n in enumerate(counts)]
        share = np.concatenate(parts)
        if not share.size:
            return energy, np.inf, np.zeros((0, 2), np.int64)
        worst = int(share.argmin())
        kind, row = (0, worst) if worst < counts[0] else (1, worst - counts[0])
        one, other = kept.pairs[kind, row]
        panels = own.edge_panels[[one, other], 0]
        if kind == VERTEX:
            panels = np.array([own.ranges.own[own.ranges.own_start[one]], own.panel[other]])
        return energy, float(share[worst]), np.sort(panels)[None]

    def touch(self, q: NDArray) -> NDArray:
        """Norm (n,), N, of the contact force on each node, without friction."""
        force, kept = self.touching(q)[1], self.memory
        rub = np.zeros_like(force)
        if self.tables.friction > 0.0:
            add_rubs(self.tables, kept, rub)
        force = force - rub - kept.friction[:, :, :3].sum(axis=0)
        return np.linalg.norm(self.on_nodes(q, force), axis=1)

    def clear(self, q: NDArray, step: NDArray, moves: NDArray, keep: float = KEEP) -> float:
        """Share of a step (m,) from q without any crossing, while planes move (p, 3), m."""
        self.prepare()
        return self.clear_with(self.memory, q, step, moves, keep)

    def clear_with(
        self, kept: Memory, q: NDArray, step: NDArray, moves: NDArray, keep: float
    ) -> float:
        """Share of a step without crossing, given a memory and its current planes; see `clear`."""
        return clear_share(self.tables, kept, self.points(q), self.points(step), moves, keep)

    def plane_forces(self, q: NDArray) -> NDArray:
        """Force (p, 3), N, of each plane on the nodes, without friction."""
        self.contact(q)
        pressed = self.memory.friction[:, :, 3].sum(axis=1)
        return pressed[:, None] * self.tables.planes[:, NORMAL : NORMAL + 3]

    def plane_friction(self, q: NDArray) -> NDArray:
        """Friction (p, 3), N, of each plane on the nodes."""
        self.contact(q)
        return -self.memory.friction[:, :, :3].sum(axis=1)

    def plane_borders(self, q: NDArray, motion: NDArray) -> tuple[NDArray, NDArray, float]:
        """Derivatives, N/m, for a displacement of all planes along their motions (p, 3).

        Returns the derivative of the dof forces (m,) with respect to the displacement; of the force
        on the planes with respect to the dofs (m,); and of this force with respect to the
        displacement.
        """
        self.contact(q)
        blocks = plane_tangents(self.tables, self.memory.x, self.memory)
        column = -np.einsum("pnab,pb->na", blocks, motion)
        row = -np.einsum("pnab,pa->nb", blocks, motion)
        own = float(np.einsum("pnab,pa,pb->", blocks, motion, motion))
        return self._on_dofs(q, column), self._on_dofs(q, row), own

    def _on_dofs(self, q: NDArray, force: NDArray) -> NDArray:
        """Dof forces (m,) that are equivalent to forces on the contact points."""
        out, nodes = np.zeros(q.size), self.on_nodes(q, force)
        out[: nodes.size] = nodes.ravel()
        return out


def contact_tangent(own: Tables, kept: Memory, size: int) -> sparse.csr_array:
    """Derivative (size, size), N/m, of the contact forces at their last evaluation."""
    first, second = touching_pairs(own, kept)
    nodes = np.empty((len(first) + len(second), 4), np.int64)
    blocks = np.zeros((len(nodes), 12, 12))
    pair_tangents(own, kept, first, second, nodes, blocks)
    guards = np.zeros((len(own.hinge_limit), 4, 3, 4, 3))
    acts = guard_tangents(own, kept.x, guards)
    at_planes = np.zeros((0, 3, 3))
    if len(own.planes):
        at_planes = plane_tangents(own, kept.x, kept).sum(axis=0)
    return of_contacts(nodes, blocks, own.hinges[acts], guards[acts], at_planes, size)
