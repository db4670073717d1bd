"""Edges that give way near their ends, under in-plane forces concentrated at vertices.

Near each end of an edge, its points slide along it by an amplitude g (a *give*), which the adjacent
panels share (`structures.membranes`). With E the strains of a panel's bars, gives add to its energy

    E^T A g + 1/2 g^T K g.

Gives do not rotate with the sheet and have no mass: they are hidden dofs or, for methods that need
mass, in balance, K g = -A^T E, with K factorized once.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.jit.compiled import inner
from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.membranes import GROUP
from foldyn.mechanics.term import (
    ENERGIES,
    FORCES,
    MEAN_FORCES,
    CompiledTerm,
    energies,
    forces,
    mean_forces,
)


class EdgeGives(NamedTuple):
    """Arrays of p panels with up to c nodes, b bars and k gives; padded with zeros."""

    count: int  # g, number of all gives
    edge: NDArray  # (g, 2) its vertices
    panel: NDArray  # (p,) numbers
    nodes: NDArray  # (p, c)
    ends: NDArray  # (p, b, 2) indices among a panel's nodes
    vector: NDArray  # (p, b, 3) rest vector from the first end to the second, m
    per_length2: NDArray  # (p, b) 1 / L^2, or 0
    number: NDArray  # (p, k) indices of the gives
    across: NDArray  # (p, b, k) A, J/m
    stiffness: NDArray  # (p, k, k) K, N/m
    strain: NDArray  # (b,) scratch of one panel
    along: NDArray  # (b, 3) vectors of its bars, m

    @property
    def matrix(self) -> sparse.csc_array:
        """Stiffness (g, g) of all gives, N/m."""
        k = self.number.shape[1]
        places = (np.repeat(self.number, k, axis=1).ravel(), np.tile(self.number, (1, k)).ravel())
        entries = (self.stiffness.ravel(), places)
        return sparse.csc_array(sparse.coo_array(entries, shape=(self.count, self.count)))

    @property
    def bars(self) -> NDArray:
        """Nodes (p, b, 2) at the ends of the bars."""
        return np.take_along_axis(self.nodes[:, :, None], self.ends, axis=1)

    def vectors(self, u: NDArray) -> NDArray:
        """Vectors (p, b, 3) of the bars at displacements u (n, 3), m."""
        ends = self.bars
        return self.vector + u[ends[..., 1]] - u[ends[..., 0]]

    def strains(self, u: NDArray) -> NDArray:
        """Strains (p, b) of the bars at displacements u (n, 3), m."""
        vector = self.vectors(u)
        square = ((vector - self.vector) * (vector + self.vector)).sum(axis=2)
        return 0.5 * self.per_length2 * square

    def balanced(self, strain: NDArray) -> NDArray:
        """Gives (g,), m, in balance with strains (p, b)."""
        pull = np.einsum("pbk,pb->pk", self.across, strain).ravel()
        pull = np.bincount(self.number.ravel(), pull, minlength=self.count)
        return -splu(self.matrix).solve(pull)

    def ordered(self) -> EdgeGives:
        """Copy with the gives numbered so that the factor of the matrix is sparse."""
        rank = _factorized(self.matrix, "MMD_AT_PLUS_A").perm_c
        edge = np.empty_like(self.edge)
        edge[rank] = self.edge
        return self._replace(edge=edge, number=rank[self.number].astype(np.int64))

    def factor(self) -> Factor:
        """Factor of the matrix, for gives numbered by `ordered`."""
        found = _factorized(self.matrix, "NATURAL")
        assert np.array_equal(found.perm_c, np.arange(self.count))
        lower = sparse.csc_array(sparse.tril(found.L, -1))
        entries = lower.indptr.astype(np.int64), lower.indices.astype(np.int64), lower.data
        return Factor(*entries, 1.0 / found.U.diagonal())


class Factor(NamedTuple):
    """A symmetric matrix L D L^T: columns of L below its diagonal of ones, and 1 / D."""

    start: NDArray  # (g + 1,)
    row: NDArray
    value: NDArray
    per_pivot: NDArray  # (g,)


NO_FACTOR = Factor(np.zeros(1, np.int64), np.zeros(0, np.int64), np.zeros(0), np.zeros(0))


def _factorized(matrix: sparse.csc_array, order: str) -> Any:
    return splu(matrix, order, 0.0, options={"SymmetricMode": True})


@inner
def solve_factor(factor, x):
    """Solve with a factor, in place."""
    for j in range(x.size):
        for k in range(factor.start[j], factor.start[j + 1]):
            x[factor.row[k]] -= factor.value[k] * x[j]
    for j in range(x.size - 1, -1, -1):
        total = factor.per_pivot[j] * x[j]
        for k in range(factor.start[j], factor.start[j + 1]):
            total -= factor.value[k] * x[factor.row[k]]
        x[j] = total


@inner
def strain_panel(gives, u, p):
    """Compute strains and vectors of the bars of panel p, into its scratch."""
    for i in range(gives.strain.size):
        a, b = gives.nodes[p, gives.ends[p, i, 0]], gives.nodes[p, gives.ends[p, i, 1]]
        excess = 0.0
        for c in range(3):
            apart, rest = u[b, c] - u[a, c], gives.vector[p, i, c]
            gives.along[i, c] = rest + apart
            excess += apart * (2.0 * rest + apart)
        gives.strain[i] = 0.5 * gives.per_length2[p, i] * excess


@inner
def add_pulls(gives, p, g, share, force):
    """Add a share of the nodal forces of panel p, along the vectors in its scratch."""
    for i in range(gives.strain.size):
        pull = 0.0
        for k in range(gives.number.shape[1]):
            pull += gives.across[p, i, k] * g[gives.number[p, k]]
        pull *= share * gives.per_length2[p, i]
        a, b = gives.nodes[p, gives.ends[p, i, 0]], gives.nodes[p, gives.ends[p, i, 1]]
        for c in range(3):
            force[b, c] += pull * gives.along[i, c]
            force[a, c] -= pull * gives.along[i, c]


@inner
def add_strained(gives, p, share, out):
    """Add a share of the forces (g,), N, that panel p's stored strains exert on its gives."""
    for k in range(gives.number.shape[1]):
        for i in range(gives.strain.size):
            out[gives.number[p, k]] += share * gives.across[p, i, k] * gives.strain[i]


@inner
def add_given(gives, p, g, share, out):
    """Add a share of the forces (g,), N, that the gives of panel p exert on each other."""
    for k in range(gives.number.shape[1]):
        for j in range(gives.number.shape[1]):
            out[gives.number[p, k]] += share * gives.stiffness[p, k, j] * g[gives.number[p, j]]


@inner
def add_gives(gives, u, g, force, pull):
    """Add the forces on nodes (n, 3) and on gives (g,)."""
    for p in range(gives.nodes.shape[0]):
        strain_panel(gives, u, p)
        add_pulls(gives, p, g, 1.0, force)
        add_strained(gives, p, 1.0, pull)
        add_given(gives, p, g, 1.0, pull)


@inner
def strained_gives(gives, u, pull):
    """Forces (g,), N, that the strains at u exert on the gives."""
    pull[:] = 0.0
    for p in range(gives.nodes.shape[0]):
        strain_panel(gives, u, p)
        add_strained(gives, p, 1.0, pull)


class _Context(NamedTuple):
    gives: EdgeGives
    rows: int
    first: int  # dof of the first give
    memory: NDArray  # (2, g)
    factor: Factor


@forces
def _forces(own, u, v, t, force, powers):
    moved, out = rows_at(u, own.rows), rows_at(force, own.rows)
    first, end = own.first, own.first + own.gives.count
    add_gives(own.gives, moved, flat(moved)[first:end], out, flat(out)[first:end])


@energies
def _energies(own, u, out):
    moved = rows_at(u, own.rows)
    g, (strained, given) = flat(moved)[own.first : own.first + own.gives.count], own.memory
    strained_gives(own.gives, moved, strained)
    given[:] = 0.0
    for p in range(own.gives.nodes.shape[0]):
        add_given(own.gives, p, g, 0.5, given)
    for k in range(g.size):
        numbers_at(out, GROUP + 1)[GROUP] += (strained[k] + given[k]) * g[k]


@mean_forces
def _mean_forces(own, u0, u1, before, h, t, force, powers):
    out, first, end = rows_at(force, own.rows), own.first, own.first + own.gives.count
    pull = flat(out)[first:end]
    for one, other in ((u0, u1), (u1, u0)):
        here, there = rows_at(one, own.rows), rows_at(other, own.rows)
        g, after = flat(here)[first:end], flat(there)[first:end]
        for p in range(own.gives.nodes.shape[0]):
            strain_panel(own.gives, here, p)
            add_pulls(own.gives, p, g, 0.25, out)
            add_pulls(own.gives, p, after, 0.25, out)
            add_strained(own.gives, p, 0.5, pull)
            add_given(own.gives, p, g, 0.5, pull)


@inner
def balance_gives(own, u):
    """Compute the gives' forces from the strains at u, and the gives in balance, to memory."""
    pull, g = own.memory
    strained_gives(own.gives, u, pull)
    for k in range(g.size):
        g[k] = -pull[k]
    solve_factor(own.factor, g)


@forces
def _balanced_forces(own, u, v, t, force, powers):
    moved, out, g = rows_at(u, own.rows), rows_at(force, own.rows), own.memory[1]
    balance_gives(own, moved)
    for p in range(own.gives.nodes.shape[0]):
        strain_panel(own.gives, moved, p)
        add_pulls(own.gives, p, g, 1.0, out)


@energies
def _balanced_energies(own, u, out):
    pull, g = own.memory
    balance_gives(own, rows_at(u, own.rows))
    for k in range(g.size):
        numbers_at(out, GROUP + 1)[GROUP] += 0.5 * pull[k] * g[k]


def gives_kernels(gives: EdgeGives, rows: int, first: int) -> CompiledTerm:
    """Kernels for gives as dofs from `first` on."""
    context = _Context(gives, rows, first, np.zeros((2, gives.count)), NO_FACTOR)
    return CompiledTerm(
        Context(context), {FORCES: _forces, ENERGIES: _energies, MEAN_FORCES: _mean_forces}
    )


def balanced_kernels(gives: EdgeGives, rows: int) -> CompiledTerm:
    """Kernels for gives in balance."""
    context = _Context(gives, rows, 3 * rows, np.zeros((2, gives.count)), gives.factor())
    return CompiledTerm(Context(context), {FORCES: _balanced_forces, ENERGIES: _balanced_energies})
