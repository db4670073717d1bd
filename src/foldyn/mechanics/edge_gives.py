"""Edges that give way near their ends, under in-plane forces concentrated at vertices.

Near each end of an edge, the points of the edge slide along it by an amplitude g (a *give*), which
the adjacent panels share (`structures.membranes`). With E the strains of a panel's bars, gives add
to the panel's energy

    E^T A g + 1/2 g^T K g.

Gives do not rotate with the sheet and have no mass: they are hidden dofs.

For the pullback (`mechanics.pullback`), let r be the rates of E for nodal velocities equal to the
weights, and h the weights of the gives:

    w . F = r^T A g + h^T A^T E + h^T K g.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.jit.compiled import inner
from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.block_matrix import of_elements, pairs_within
from foldyn.mechanics.membranes import GROUP
from foldyn.mechanics.model import ranks
from foldyn.mechanics.pullback import Arrays, Pulled, arrays_of, pullback, zeros_for
from foldyn.mechanics.term import (
    ENERGIES,
    FORCES,
    MEAN_FORCES,
    CompiledTerm,
    Term,
    Unstrained,
    Way,
    energies,
    forces,
    mean_forces,
    nodal,
)

SCRATCH = ("strain", "along", "given", "pull")  # arrays of `EdgeGives` for one panel at a time


class EdgeGives(NamedTuple):
    """Arrays of p panels with up to c nodes, b bars and k gives; padded with zeros."""

    count: int  # g, number of all gives
    edge: NDArray  # (g, 2) vertices of each give's edge
    panel: NDArray  # (p,) numbers of the panels
    nodes: NDArray  # (p, c)
    ends: NDArray  # (p, b, 2) indices among a panel's nodes
    vector: NDArray  # (p, b, 3) rest vector from the first end to the second, m
    per_length2: NDArray  # (p, b) 1 / L^2, or 0
    number: NDArray  # (p, k) indices of the gives
    across: NDArray  # (p, b, k) A, J/m
    stiffness: NDArray  # (p, k, k) K, N/m
    strain: NDArray  # (b,) scratch of one panel
    along: NDArray  # (b, 3) vectors of this panel's bars, m
    given: NDArray  # (k,) this panel's gives, m
    pull: NDArray  # (k,) forces on them, N

    @property
    def matrix(self) -> sparse.csc_array:
        """Stiffness (g, g) of all gives, N/m."""
        return sparse.csc_array(of_elements(self.number, self.stiffness, self.count))

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
def add_panel(gives, u, p, g, force, pull):
    """Add the forces of panel p on its nodes and its gives, in one pass: see the three above."""
    count = gives.given.size
    for k in range(count):
        gives.given[k], gives.pull[k] = g[gives.number[p, k]], 0.0
    for i in range(gives.strain.size):
        a, b = gives.nodes[p, gives.ends[p, i, 0]], gives.nodes[p, gives.ends[p, i, 1]]
        per, vector = gives.per_length2[p, i], gives.vector
        x, y, z = u[b, 0] - u[a, 0], u[b, 1] - u[a, 1], u[b, 2] - u[a, 2]
        one, two, three = vector[p, i, 0], vector[p, i, 1], vector[p, i, 2]
        excess = x * (2.0 * one + x) + y * (2.0 * two + y) + z * (2.0 * three + z)
        strain, tension = 0.5 * per * excess, 0.0
        for k in range(count):
            across = gives.across[p, i, k]
            tension += across * gives.given[k]
            gives.pull[k] += across * strain
        tension *= per
        x, y, z = tension * (one + x), tension * (two + y), tension * (three + z)
        force[b, 0] += x
        force[b, 1] += y
        force[b, 2] += z
        force[a, 0] -= x
        force[a, 1] -= y
        force[a, 2] -= z
    for k in range(count):
        total = gives.pull[k]
        for j in range(count):
            total += gives.stiffness[p, k, j] * gives.given[j]
        pull[gives.number[p, k]] += total


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


@forces
def _forces(own, u, v, t, force, powers):
    moved, out = rows_at(u, own.rows), rows_at(force, own.rows)
    first, end = own.first, own.first + own.gives.count
    g, pull = flat(moved)[first:end], flat(out)[first:end]
    for p in range(own.gives.nodes.shape[0]):
        add_panel(own.gives, moved, p, g, out, pull)


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


class _Backward(NamedTuple):
    gives: EdgeGives
    out: EdgeGives  # gradients
    rows: int
    first: int  # dof of the first give


@inner
def pull_panel(gives, p, weight, g, h, out, product, by_g):
    """Add the derivatives for panel p, whose strains and vectors are in its scratch."""
    for i in range(gives.strain.size):
        a, b = gives.nodes[p, gives.ends[p, i, 0]], gives.nodes[p, gives.ends[p, i, 1]]
        excess, growth, stress, back = 0.0, 0.0, 0.0, 0.0
        for c in range(3):
            rest, along = gives.vector[p, i, c], gives.along[i, c]
            excess += (along - rest) * (along + rest)
            growth += (weight[b, c] - weight[a, c]) * along
        rate = gives.per_length2[p, i] * growth
        for k in range(gives.number.shape[1]):
            n = gives.number[p, k]
            stress += gives.across[p, i, k] * g[n]
            back += gives.across[p, i, k] * h[n]
            by_g[n] += gives.across[p, i, k] * rate
            out.across[p, i, k] += rate * g[n] + gives.strain[i] * h[n]
        out.per_length2[p, i] += stress * growth + 0.5 * back * excess
        stress, back = stress * gives.per_length2[p, i], back * gives.per_length2[p, i]
        for c in range(3):
            rest, along = gives.vector[p, i, c], gives.along[i, c]
            by = stress * (weight[b, c] - weight[a, c]) + back * along
            out.vector[p, i, c] += by - back * rest
            product[b, c] += by
            product[a, c] -= by
    for k in range(gives.number.shape[1]):
        for j in range(gives.number.shape[1]):
            n, m = gives.number[p, k], gives.number[p, j]
            by_g[m] += gives.stiffness[p, k, j] * h[n]
            out.stiffness[p, k, j] += h[n] * g[m]


@pullback
def _pullback(own, u, v, t, weight, product, rate):
    moved, weights, out = (
        rows_at(u, own.rows), rows_at(weight, own.rows), rows_at(product, own.rows)
    )  # fmt: skip
    first, end = own.first, own.first + own.gives.count
    g, h, by_g = flat(moved)[first:end], flat(weights)[first:end], flat(out)[first:end]
    for p in range(own.gives.nodes.shape[0]):
        strain_panel(own.gives, moved, p)
        pull_panel(own.gives, p, weights, g, h, own.out, out, by_g)


class EdgeGivesTerm(Term):
    """Gives as hidden dofs; their energy counts as energy of the sheet's bars.

    Parameters
    ----------
    gives : EdgeGives
    rows : int
        Number of rows of the arrays that hold the dofs.
    first : int
        Dof of the first give.
    """

    owns_hidden: ClassVar[bool] = True

    def __init__(self, gives: EdgeGives, rows: int, first: int) -> None:
        self.gives, self.rows, self.first = gives, rows, first

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """Context and kernels for a thread; see `Term`."""
        memory = np.zeros((2, self.gives.count))
        own = Context(_Context(self.gives, self.rows, self.first, memory))
        return CompiledTerm(own, {FORCES: _forces, ENERGIES: _energies, MEAN_FORCES: _mean_forces})

    def arrays(self) -> Arrays:
        """Arrays that the term's forces depend on; see `Term`."""
        return arrays_of(self.gives, *SCRATCH)

    def pulled(self) -> Pulled:
        """Pullback of the term's forces; see `Term`."""
        out = zeros_for(self.gives, *SCRATCH)
        own = Context(_Backward(self.gives, out, self.rows, self.first))
        return Pulled(own, _pullback, arrays_of(out, *SCRATCH).numbers)

    @cached_property
    def _dofs(self) -> NDArray:
        """Dofs (p, 3c + k) of each panel: of its nodes, then its gives."""
        nodal = 3 * self.gives.nodes[:, :, None] + np.arange(3)
        return np.concatenate(
            [nodal.reshape(len(nodal), -1), self.first + self.gives.number], axis=1
        )

    @cached_property
    def places(self) -> tuple[NDArray, NDArray]:
        """Rows and columns (k,) of the term's tangent entries; see `Term`."""
        row, column = pairs_within(self._dofs).T
        return row, column

    def entries(self, q: NDArray, floor: float = -np.inf) -> NDArray:
        """Tangent entries (k,), N/m; see `Term`."""
        return panel_tangents(self.gives, nodal(q), nodal(q), self._gives(q)).ravel()

    def mean_entries(self, q0: NDArray, q1: NDArray, way: Way, floor: float) -> NDArray:
        """See `Term`."""
        mean = 0.5 * (self._gives(q0) + self._gives(q1))
        return 0.5 * panel_tangents(self.gives, nodal(q0), nodal(q1), mean).ravel()

    def _gives(self, q: NDArray) -> NDArray:
        return np.ravel(q)[self.first : self.first + self.gives.count]

    def unstrained(self, q: NDArray) -> Unstrained:
        """The model without strain at q; see `Term`."""
        size = (q.size, q.size)
        loose = panel_tangents(self.gives, nodal(q), nodal(q), np.zeros(self.gives.count))
        tangent = of_elements(self._dofs, loose, q.size)
        own = sparse.coo_array(self.gives.matrix)
        places = tuple(place + self.first for place in own.coords)
        alone = sparse.csr_array(sparse.coo_array((own.data, places), size))
        return Unstrained(tangent, alone, lambda motion: 0.0)

    def placed(self, order: NDArray, before: Any) -> EdgeGivesTerm:
        """The term with nodes in memory order; see `Term`."""
        gives = self.gives._replace(nodes=ranks(order)[self.gives.nodes])
        return type(self)(gives, self.rows, self.first)


def panel_tangents(gives: EdgeGives, u0: NDArray, u1: NDArray, g: NDArray) -> NDArray:
    """Tangents (p, 3c + k, 3c + k), N/m, of all panels at u0 = u1 and gives g (g,).

    If u1 differs from u0, and g are the mean gives, the result is twice the derivative of the mean
    forces with respect to u1 and the gives at the end.
    """
    (panels, corners), (bars, given) = gives.nodes.shape, gives.across.shape[1:]
    end = 3 * corners
    out = np.zeros((panels, end + given, end + given))
    way = np.zeros((panels, bars, corners))  # -1 and 1 at the ends of the bars
    at = np.arange(panels)[:, None], np.arange(bars)
    np.add.at(way, (*at, gives.ends[:, :, 0]), -1.0)
    np.add.at(way, (*at, gives.ends[:, :, 1]), 1.0)
    turn = gives.per_length2[:, :, None] * way
    last, first = gives.vectors(u1), gives.vectors(u0)
    middle = np.einsum("pbc,pbx->pbcx", turn, 0.5 * (first + last)).reshape(panels, bars, end)
    later = np.einsum("pbc,pbx->pbcx", turn, last).reshape(panels, bars, end)
    out[:, :end, end:] = np.einsum("pbd,pbk->pdk", middle, gives.across)
    out[:, end:, :end] = np.einsum("pbd,pbk->pkd", later, gives.across)
    out[:, end:, end:] = gives.stiffness
    pull = np.einsum("pbk,pk->pb", gives.across, g[gives.number])
    stressed = np.einsum("pb,pbc,pbd->pcd", pull, turn, way)
    blocks = out[:, :end, :end].reshape(panels, corners, 3, corners, 3)
    for axis in range(3):
        blocks[:, :, axis, :, axis] += stressed
    out[:, :end, :end] = blocks.reshape(panels, end, end)
    return out
