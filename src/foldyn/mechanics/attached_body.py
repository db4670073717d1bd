"""A body with springs and clamped edges, as solvers see it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.mechanics.attached import (
    GROUND,
    AttachedWork,
    Clamps,
    Springs,
    add_clamp_forces,
    add_spring_forces,
    axial_blocks,
    clamp_angles,
    clamp_blocks,
    clamp_energy,
    clamps_term,
    no_clamps,
    no_springs,
    spring_energy,
    springs_term,
)
from foldyn.mechanics.block_matrix import (
    assembled,
    blocks_of_ends,
    pairs_of_ends,
    pairs_within,
)
from foldyn.mechanics.body import (
    Blocks,
    Body,
    Strains,
    Unstrained,
    largest_turn,
    unit_rows,
)
from foldyn.mechanics.model import ranks
from foldyn.mechanics.tangent import Sparsity, block_keys, joined
from foldyn.mechanics.term import Term
from foldyn.mechanics.wrapped_body import WrappedBody

GROUP = "strain_springs"


def attached(body: Body, clamps: Clamps | None = None, springs: Springs | None = None) -> Body:
    """A body with clamps or springs in addition to its own clamps."""
    inner = body
    if isinstance(body, AttachedBody):
        inner, clamps = body.inner, body.clamps if clamps is None else clamps
    return AttachedBody(inner, clamps or no_clamps(), springs or no_springs())


class AttachedBody(WrappedBody):
    """A body with springs and clamped edges; see `mechanics.body.Body`.

    Parameters
    ----------
    inner : Body
    clamps, springs
        See `mechanics.attached`. Springs have a group of energy of their own, if there are any.
    """

    def __init__(self, inner: Body, clamps: Clamps, springs: Springs) -> None:
        super().__init__(inner)
        self.clamps, self.springs = clamps, springs
        sprung = len(springs.stiffness) + len(springs.axial_stiffness) > 0
        self.energy_groups = (*inner.energy_groups, *([GROUP] if sprung else []))

    def around(self, inner: Body) -> AttachedBody:
        """See `WrappedBody`."""
        return AttachedBody(inner, self.clamps, self.springs)

    def energies(self, q: NDArray) -> NDArray:
        """See `Body`."""
        u, inner = self.nodal(q), self.inner.energies(q)
        out = np.concatenate([inner, np.zeros(len(self.energy_groups) - len(inner))])
        if len(self.clamps.rest):
            out[self.clamps.group] += clamp_energy(self.clamps, u)
        out[len(inner) :] = spring_energy(self.springs, u)
        return out

    def internal(self, q: NDArray, work: AttachedWork | None = None) -> NDArray:
        """See `Body`."""
        u = self.nodal(q)
        force, angle = np.zeros_like(u), np.empty(len(self.clamps.rest))
        add_clamp_forces(self.clamps, u, force, angle)
        add_spring_forces(self.springs, u, force)
        return self.inner.internal(q, work.inner if work else None) + self.added(force)

    def hinge_forces(self, q: NDArray, work: AttachedWork | None = None) -> NDArray:
        """See `Body`."""
        u = self.nodal(q)
        force, angle = np.zeros_like(u), np.empty(len(self.clamps.rest))
        add_clamp_forces(self.clamps, u, force, angle)
        return self.inner.hinge_forces(q, work.inner if work else None) + self.added(force)

    def tangent(self, q: NDArray, floor: float = -np.inf) -> sparse.csr_array:
        """See `Body`."""
        return self._plus(self.inner.tangent(q, floor), self.blocks_at(q))

    def step_tangent(self, q: NDArray, before: NDArray | None = None) -> sparse.csr_array:
        """See `Body`."""
        return self._plus(self.inner.step_tangent(q, before), self.blocks_at(q))

    def blocks(self) -> AttachedBlocks:
        """See `Body`."""
        return AttachedBlocks(self.inner.blocks(), self.pairs, self.rows)

    @cached_property
    def _ends(self) -> NDArray:
        """Ends (s, 2) of all springs, directed and axial."""
        return np.concatenate([self.springs.ends, self.springs.axial_ends])

    @cached_property
    def pairs(self) -> NDArray:
        """Rows and columns (k, 2) of the nodes that `blocks_at` couples."""
        return np.concatenate([pairs_of_ends(self._ends), pairs_within(self.clamps.nodes)])

    def blocks_at(self, q: NDArray, loose: bool = False) -> NDArray:
        """Tangent (k, 3, 3), N/m, of springs and clamps, block by block of `pairs`.

        loose : without the forces of axial springs.
        """
        springs = blocks_of_ends(self._ends, self._springs_at(q, loose))
        clamps = clamp_blocks(self.clamps, self.nodal(q)).reshape(-1, 3, 3)
        return np.concatenate([springs, clamps])

    def _springs_at(self, q: NDArray, loose: bool) -> NDArray:
        """Stiffness (s, 3, 3), N/m, of all springs against motions of one end."""
        stiffness, direction = self.springs.stiffness, self.springs.direction
        along = np.einsum("s,sa,sb->sab", stiffness, direction, direction)
        return np.concatenate([along, axial_blocks(self.springs, self.nodal(q), loose)])

    def _plus(self, matrix: sparse.csr_array, blocks: NDArray) -> sparse.csr_array:
        """A matrix (m, m) with blocks of `pairs` added to it."""
        return sparse.csr_array(matrix + assembled(self.pairs, blocks, self.size))

    def workspaces(self, threads: int) -> Sequence[AttachedWork]:
        """See `Body`: one thread."""
        inner = self.inner.workspaces(1)[0]
        angle, count = inner.angle, len(inner.angle)
        if len(self.clamps.rest):  # whose dihedrals follow, as bars and hinges alone have them
            angle = np.empty(count + len(self.clamps.rest))
            inner = inner._replace(angle=angle[:count], fold_angle=angle[:count])
        return [AttachedWork(inner, angle, inner.fold_angle, inner.strips, inner.team)]

    @property
    def hinges(self) -> NDArray:
        """See `Body`."""
        own = self.clamps.nodes
        rows = np.column_stack([own, np.full(len(own), GROUND)])
        return np.concatenate([self.inner.hinges.astype(np.int64), rows])

    def terms(self, work: AttachedWork) -> list[Term]:
        """See `Body`."""
        terms = self.inner.terms(work.inner)
        if len(self.clamps.rest):
            terms.append(clamps_term(self.clamps, work.angle, self.rows))
        if GROUP in self.energy_groups:
            terms.append(springs_term(self.springs, len(self.inner.energy_groups), self.rows))
        return terms

    # ------------------------------------------------------------------ measures
    def angles(self, q: NDArray) -> NDArray:
        """See `Body`: those of the model, then of the clamps."""
        own = clamp_angles(self.clamps, self.nodal(q))[0]
        return np.concatenate([self.inner.angles(q), own])

    def turn(self, q: NDArray, other: NDArray) -> float:
        """See `Body`."""
        before, after = (clamp_angles(self.clamps, self.nodal(state))[0] for state in (q, other))
        return largest_turn(self.inner.turn(q, other), before, after)

    def scale(self) -> NDArray:
        """See `Body`; axial springs count as bars do."""
        nodal, springs = np.zeros((self.size - len(self.hidden)) // 3), self.springs
        np.add.at(nodal, springs.axial_ends, (springs.axial_stiffness * springs.length)[:, None])
        return self.inner.scale() + self.added(np.repeat(nodal, 3))

    def holds(self, q: NDArray) -> sparse.csr_array:
        """See `Body`: directed springs along their directions, clamps as they turn."""
        ends, direction = self.springs.ends, self.springs.direction
        grounded = ends[:, 1:] < 0
        entries = np.concatenate([direction, np.where(grounded, 0.0, -direction)], axis=1)
        springs = unit_rows(np.where(grounded, ends[:, :1], ends), entries, self.size)
        turns = clamp_angles(self.clamps, self.nodal(q))[1]
        clamps = unit_rows(self.clamps.nodes, turns, self.size)
        return sparse.csr_array(sparse.vstack([self.inner.holds(q), springs, clamps]))

    def strains(self) -> Strains | None:
        """See `Body`; a clamp's wing has the node of its first end (`viscous.hinge_gradient`)."""
        own, clamps = self.inner.strains(), self.clamps
        if own is None:
            return None
        return own._replace(
            hinges=np.concatenate([own.hinges, clamps.nodes[:, [0, 1, 2, 0]]]),
            corners=np.concatenate([own.corners, clamps.points]),
            hinge_stiffness=np.concatenate([own.hinge_stiffness, clamps.stiffness]),
        )

    def turning_moments(self) -> float:
        """See `Body`."""
        return self.inner.turning_moments() + float(self.clamps.stiffness.sum())

    # ------------------------------------------------------------------ other bodies
    def renumbered(self) -> tuple[AttachedBody, NDArray]:
        """See `Body`."""
        inner, order = self.inner.renumbered()
        rank = np.append(ranks(order), -1)  # that of the ground, which is -1, stays
        springs = self.springs._replace(
            ends=rank[self.springs.ends], axial_ends=rank[self.springs.axial_ends]
        )
        clamps = self.clamps._replace(nodes=rank[self.clamps.nodes])
        return AttachedBody(inner, clamps, springs), order

    def nominal(self, q: NDArray) -> AttachedBody:
        """See `Body`."""
        angle = clamp_angles(self.clamps, self.nodal(q))[0]
        return AttachedBody(self.inner.nominal(q), self.clamps._replace(rest=angle), self.springs)

    def unstrained(self, q: NDArray) -> Unstrained | None:
        """See `Body`."""
        inner = self.inner.unstrained(q)
        if inner is None:
            return None
        blocks = self.nominal(q).blocks_at(q, loose=True)
        clamps = blocks.copy()
        clamps[: len(blocks) - 9 * len(self.clamps.rest)] = 0.0
        return Unstrained(
            self._plus(inner.tangent, blocks),
            self._plus(inner.hinges, clamps),
            partial(self._stretch, inner.stretch, self._lines(q)),
        )

    def _lines(self, q: NDArray) -> NDArray:
        """Unit vectors (s, 3) along all springs; zero for those that pull in all directions."""
        ends, springs, u = self.springs.axial_ends, self.springs, self.nodal(q)
        apart = springs.vector + u[ends[:, 1]] - u[ends[:, 0]]
        apart[springs.stretch == springs.length] = 0.0
        length = np.linalg.norm(apart, axis=1, keepdims=True)
        return np.concatenate([springs.direction, apart / np.where(length > 0.0, length, 1.0)])

    def _stretch(self, bars: Any, lines: NDArray, motion: NDArray) -> float:
        """As `Unstrained.stretch`: the larger of bars' and springs', along lines (s, 3)."""
        ends, u, springs = self._ends, self.nodal(motion), self.springs
        first, second = u[ends[:, 0]], np.where(ends[:, 1:] < 0, 0.0, u[ends[:, 1]])
        stiffness = np.concatenate([springs.stiffness, springs.axial_stiffness])
        apart, most = first - second, np.linalg.norm(first, axis=1) + np.linalg.norm(second, axis=1)
        along = np.where(lines.any(axis=1), np.einsum("sa,sa->s", apart, lines), most)
        whole = float((stiffness * most**2).sum())
        own = np.sqrt(float((stiffness * along**2).sum()) / whole) if whole > 0.0 else 0.0
        return max(bars(motion), own)


class AttachedBlocks:
    """Blocks of a body with springs and clamps; see `mechanics.body.Blocks`."""

    def __init__(self, inner: Blocks, pairs: NDArray, rows: int) -> None:
        self._inner, self._keys = inner, pairs[:, 0] * rows + pairs[:, 1]
        self.pattern = joined(inner.pattern, self._keys)
        self.order, self.unused = inner.order, inner.unused

    def put(
        self, body: AttachedBody, pattern: Sparsity, u: NDArray, before: NDArray, again: bool,
        out: NDArray,
    ) -> None:  # fmt: skip
        """See `Blocks`."""
        self._inner.put(body.inner, pattern, u, before, again, out)
        np.add.at(out, self._places(pattern), body.blocks_at(u))

    def filled(self, pattern: Sparsity) -> NDArray:
        """See `Blocks`."""
        filled = self._inner.filled(pattern)
        filled[self._places(pattern)] = True
        return filled

    def _places(self, pattern: Sparsity) -> NDArray:
        """Where the blocks stand in a pattern."""
        return np.searchsorted(block_keys(pattern.indptr, pattern.indices), self._keys)
