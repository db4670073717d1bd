"""Springs between nodes, and from nodes to the ground.

There are two kinds of springs. A directed spring pulls with k (u_a - u_b) . d along a fixed
direction d; without b it is attached to the ground. An axial spring pulls with k (l - l0) along the
current line between its ends.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property, partial
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.compiled import inner_scalar, kernel
from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.mechanics.block_matrix import blocks_of_ends, pairs_of_ends, places_of
from foldyn.mechanics.model import ranks
from foldyn.mechanics.pullback import Arrays, Pulled, arrays_of, pullback, zeros_for
from foldyn.mechanics.sheet_term import unit_rows
from foldyn.mechanics.term import (
    ENERGIES,
    FORCES,
    MEAN_FORCES,
    CompiledTerm,
    Term,
    Unstrained,
    energies,
    forces,
    mean_forces,
    nodal,
)

GROUP = "strain_springs"
GROUND = -1  # stands for an end on the ground


class Springs(NamedTuple):
    """Arrays of d directed and a axial springs."""

    ends: NDArray  # (d, 2) a and b; `GROUND` in place of b
    direction: NDArray  # (d, 3) unit vectors
    stiffness: NDArray  # (d,) N/m
    axial_ends: NDArray  # (a, 2)
    vector: NDArray  # (a, 3) from the first end to the second at rest, m
    length: NDArray  # (a,) length of `vector`, m
    stretch: NDArray  # (a,) length in excess of the force-free length, m
    axial_stiffness: NDArray  # (a,) N/m


@inner_scalar
def directed_extension(springs, u, s):
    """(u_a - u_b) . d of a directed spring, m."""
    a, b = springs.ends[s, 0], springs.ends[s, 1]
    extension = 0.0
    for c in range(3):
        moved = u[a, c] - (u[b, c] if b >= 0 else 0.0)
        extension += moved * springs.direction[s, c]
    return extension


@inner_scalar
def axial_extension(springs, u, s):
    """l - l0 of an axial spring, and l, m; from displacements, to avoid cancellation."""
    a, b = springs.axial_ends[s, 0], springs.axial_ends[s, 1]
    length, x = springs.length[s], 0.0
    for c in range(3):
        du = u[b, c] - u[a, c]
        x += du * (2.0 * springs.vector[s, c] + du)
    now = math.sqrt(max(length * length + x, 0.0))
    longer = x / (now + length) if now + length > 0.0 else 0.0
    return longer + springs.stretch[s], now


@inner_scalar
def axial_pull(springs, u, s):
    """Ratio of force to length (N/m) of an axial spring; k if its ends may meet."""
    extension, length = axial_extension(springs, u, s)
    per_length = springs.axial_stiffness[s]
    if springs.stretch[s] < springs.length[s]:
        per_length *= extension / length
    return per_length


@inner_scalar
def add_directed(springs, s, pull, force):
    """Add the force `pull` (N) of a directed spring to its ends."""
    a, b = springs.ends[s, 0], springs.ends[s, 1]
    for c in range(3):
        force[a, c] += pull * springs.direction[s, c]
        if b >= 0:
            force[b, c] -= pull * springs.direction[s, c]


@kernel
def axial_blocks(springs, u, loose):
    """Derivative (a, 3, 3), N/m, of axial spring forces; `loose`: without geometric part."""
    out = np.empty((springs.axial_stiffness.size, 3, 3))
    for s in range(springs.axial_stiffness.size):
        a, b = springs.axial_ends[s, 0], springs.axial_ends[s, 1]
        extension, length = axial_extension(springs, u, s)
        across, along = 1.0, 1.0
        if springs.stretch[s] < springs.length[s]:  # otherwise the stiffness is k in all directions
            across = 0.0 if loose else extension / length
        for p in range(3):
            x = springs.vector[s, p] + u[b, p] - u[a, p]
            for q in range(3):
                y = springs.vector[s, q] + u[b, q] - u[a, q]
                out[s, p, q] = across if p == q else 0.0
                if across != along:
                    out[s, p, q] += (along - across) * x * y / (length * length)
                out[s, p, q] *= springs.axial_stiffness[s]
    return out


class _Backward(NamedTuple):
    springs: Springs
    out: Springs  # gradients
    rows: int  # number of rows up to the last node


@pullback
def _pullback(own, u, v, t, weight, product, rate):
    springs, out = own.springs, own.out
    moved, weights, added = (
        rows_at(u, own.rows), rows_at(weight, own.rows), rows_at(product, own.rows)
    )  # fmt: skip
    for s in range(springs.stiffness.size):
        a, b, k = springs.ends[s, 0], springs.ends[s, 1], springs.stiffness[s]
        extension = directed_extension(springs, moved, s)
        growth = directed_extension(springs, weights, s)
        out.stiffness[s] += extension * growth
        add_directed(springs, s, k * growth, added)
        for c in range(3):
            apart = moved[a, c] - (moved[b, c] if b >= 0 else 0.0)
            weighs = weights[a, c] - (weights[b, c] if b >= 0 else 0.0)
            out.direction[s, c] += k * (apart * growth + weighs * extension)
    for s in range(springs.axial_stiffness.size):
        a, b = springs.axial_ends[s, 0], springs.axial_ends[s, 1]
        extension, length = axial_extension(springs, moved, s)
        share = 1.0  # force divided by k l
        if springs.stretch[s] < springs.length[s]:
            share = extension / length
        grown = 0.0  # rate of the ends' separation for velocities equal to the weights, times l
        for c in range(3):
            x = springs.vector[s, c] + moved[b, c] - moved[a, c]
            grown += (weights[b, c] - weights[a, c]) * x
        k = springs.axial_stiffness[s]
        by_extension = k * grown / length if length > 0.0 else 0.0
        by_length = by_extension * (1.0 - share)  # derivative with respect to l
        out.axial_stiffness[s] += share * grown
        out.stretch[s] += by_extension
        if length > 0.0:
            out.length[s] += by_length * springs.length[s] / length - by_extension
            by_length /= length
        for c in range(3):
            by = k * share * (weights[b, c] - weights[a, c])
            by += by_length * (moved[b, c] - moved[a, c])
            out.vector[s, c] += by
            by += by_length * springs.vector[s, c]
            added[b, c] += by
            added[a, c] -= by


class _Context(NamedTuple):
    springs: Springs
    group: int  # energy group
    rows: int


@forces
def _forces(own, u, v, t, force, powers):
    springs, moved, out = own.springs, rows_at(u, own.rows), rows_at(force, own.rows)
    for s in range(springs.stiffness.size):
        pull = springs.stiffness[s] * directed_extension(springs, moved, s)
        add_directed(springs, s, pull, out)
    for s in range(springs.axial_stiffness.size):
        a, b = springs.axial_ends[s, 0], springs.axial_ends[s, 1]
        per_length = axial_pull(springs, moved, s)
        for c in range(3):
            pull = per_length * (springs.vector[s, c] + moved[b, c] - moved[a, c])
            out[b, c] += pull
            out[a, c] -= pull


@energies
def _energies(own, u, out):
    springs, moved, energy = own.springs, rows_at(u, own.rows), 0.0
    for s in range(springs.stiffness.size):
        extension = directed_extension(springs, moved, s)
        energy += 0.5 * springs.stiffness[s] * extension * extension
    for s in range(springs.axial_stiffness.size):
        extension = axial_extension(springs, moved, s)[0]
        energy += 0.5 * springs.axial_stiffness[s] * extension * extension
    numbers_at(out, own.group + 1)[own.group] = energy


@mean_forces
def _mean_forces(own, u0, u1, before, h, t, force, powers):
    springs, out = own.springs, rows_at(force, own.rows)
    start, end = rows_at(u0, own.rows), rows_at(u1, own.rows)
    for s in range(springs.stiffness.size):
        extension = directed_extension(springs, start, s) + directed_extension(springs, end, s)
        add_directed(springs, s, 0.5 * springs.stiffness[s] * extension, out)
    for s in range(springs.axial_stiffness.size):
        a, b = springs.axial_ends[s, 0], springs.axial_ends[s, 1]
        first, last = axial_extension(springs, start, s), axial_extension(springs, end, s)
        per_length = springs.axial_stiffness[s]
        if springs.stretch[s] < springs.length[s]:
            per_length *= (first[0] + last[0]) / (first[1] + last[1])
        for c in range(3):
            moved = 0.5 * (start[b, c] - start[a, c] + end[b, c] - end[a, c])
            out[b, c] += per_length * (springs.vector[s, c] + moved)
            out[a, c] -= per_length * (springs.vector[s, c] + moved)


class SpringsTerm(Term):
    """Springs as a term, with their own energy group.

    Parameters
    ----------
    springs : Springs
    """

    energy_groups: ClassVar[Mapping[str, str]] = {GROUP: "strain energy of the springs"}

    def __init__(self, springs: Springs) -> None:
        self.springs = springs

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """Context and kernels for a thread; see `Term`."""
        own = Context(_Context(self.springs, group, int(part.own[1])))
        return CompiledTerm(own, {FORCES: _forces, ENERGIES: _energies, MEAN_FORCES: _mean_forces})

    def arrays(self) -> Arrays:
        """Arrays that the term's forces depend on; see `Term`."""
        return arrays_of(self.springs)

    def pulled(self) -> Pulled:
        """Pullback of the term's forces; see `Term`."""
        rows = 1 + int(self._ends.max(initial=GROUND))
        out = zeros_for(self.springs)
        own = Context(_Backward(self.springs, out, rows))
        return Pulled(own, _pullback, arrays_of(out).numbers)

    @cached_property
    def _ends(self) -> NDArray:
        """Ends (s, 2) of all springs, directed and axial."""
        return np.concatenate([self.springs.ends, self.springs.axial_ends])

    @cached_property
    def places(self) -> tuple[NDArray, NDArray]:
        """Rows and columns (k,) of the term's tangent entries; see `Term`."""
        return places_of(pairs_of_ends(self._ends))

    def entries(self, q: NDArray, floor: float = -np.inf) -> NDArray:
        """Tangent entries (k,), N/m; see `Term`."""
        return self._entries(q, loose=False)

    def _entries(self, q: NDArray, loose: bool) -> NDArray:
        """Tangent entries; loose : without the geometric part of axial springs."""
        stiffness, direction = self.springs.stiffness, self.springs.direction
        along = np.einsum("s,sa,sb->sab", stiffness, direction, direction)
        axial = axial_blocks(self.springs, nodal(q), loose)
        return blocks_of_ends(self._ends, np.concatenate([along, axial])).ravel()

    def unstrained(self, q: NDArray) -> Unstrained:
        """The model without strain at q; see `Term`."""
        size = (q.size, q.size)
        tangent = sparse.csr_array(sparse.coo_array((self._entries(q, True), self.places), size))
        return Unstrained(tangent, sparse.csr_array(size), partial(self._stretch, self._lines(q)))

    def _lines(self, q: NDArray) -> NDArray:
        """Unit vectors (s, 3) along all springs; zero for springs that pull in all directions."""
        ends, springs, u = self.springs.axial_ends, self.springs, nodal(q)
        apart = springs.vector + u[ends[:, 1]] - u[ends[:, 0]]
        apart[springs.stretch == springs.length] = 0.0
        length = np.linalg.norm(apart, axis=1, keepdims=True)
        return np.concatenate([springs.direction, apart / np.where(length > 0.0, length, 1.0)])

    def _stretch(self, lines: NDArray, motion: NDArray) -> float:
        """Stretch for `Unstrained.stretch`, along lines (s, 3)."""
        ends, u, springs = self._ends, nodal(motion), self.springs
        first, second = u[ends[:, 0]], np.where(ends[:, 1:] < 0, 0.0, u[ends[:, 1]])
        stiffness = np.concatenate([springs.stiffness, springs.axial_stiffness])
        apart, most = first - second, np.linalg.norm(first, axis=1) + np.linalg.norm(second, axis=1)
        along = np.where(lines.any(axis=1), np.einsum("sa,sa->s", apart, lines), most)
        whole = float((stiffness * most**2).sum())
        return np.sqrt(float((stiffness * along**2).sum()) / whole) if whole > 0.0 else 0.0

    def add_scale(self, scale: NDArray) -> None:
        """Add force scales of axial springs, as for bars; see `Term`."""
        ends, force = self.springs.axial_ends, self.springs.axial_stiffness * self.springs.length
        np.add.at(scale, 3 * ends[:, :, None] + np.arange(3), force[:, None, None])

    def holds(self, q: NDArray) -> sparse.csr_array:
        """Internal constraints: directed springs hold their directions; see `Term`."""
        ends, direction = self.springs.ends, self.springs.direction
        grounded = ends[:, 1:] < 0
        entries = np.concatenate([direction, np.where(grounded, 0.0, -direction)], axis=1)
        return unit_rows(np.where(grounded, ends[:, :1], ends), entries, q.size)

    def placed(self, order: NDArray, before: Any) -> SpringsTerm:
        """The term with nodes in memory order; see `Term`."""
        rank, springs = np.append(ranks(order), GROUND), self.springs  # the ground keeps its index
        return SpringsTerm(
            springs._replace(ends=rank[springs.ends], axial_ends=rank[springs.axial_ends])
        )
