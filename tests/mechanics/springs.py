"""A third model, as anyone may add one: points joined by linear springs.

It needs what is here and nothing in the package: a named tuple of arrays, a term with kernels for
its forces and energies, a `SheetTerm` that compiles them, and a structure that gives it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

import foldyn as fd
from foldyn.algebra.solvers import Fill
from foldyn.jit.compiled import kernel
from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.materials import hinge_law
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.sheet_term import SheetTerm
from foldyn.mechanics.step_tangent import SparseBlocks
from foldyn.mechanics.term import ENERGIES, FORCES, CompiledTerm, Folds, energies, forces
from foldyn.mechanics.threads import Team, team
from foldyn.structures.discretized import Discretized


class Springs(NamedTuple):
    """Arrays of n points and s springs of energy k (l - L)^2 / 2."""

    rest: NDArray  # (n, 3) m
    ends: NDArray  # (s, 2)
    stiffness: NDArray  # (s,) k, N/m
    length: NDArray  # (s,) L, m


class SpringsScratch(NamedTuple):
    """Scratch of the kernels: none."""

    angle: NDArray  # (0,)
    fold_angle: NDArray  # (0,)
    own: NDArray  # (2,) first and last + 1 of the rows
    team: Team


@kernel
def spring_force(model, u, force):
    """Force (n, 3), N, and the energy (J) at displacement u (n, 3), m."""
    energy, d = 0.0, np.empty(3)
    force[:] = 0.0
    for s in range(model.stiffness.size):
        a, b = model.ends[s]
        d[:] = model.rest[b] + u[b] - model.rest[a] - u[a]
        length = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        pull = model.stiffness[s] * (length - model.length[s])
        energy += 0.5 * pull * (length - model.length[s])
        for c in range(3):
            force[b, c] += pull / length * d[c]
            force[a, c] -= pull / length * d[c]
    return energy


class SpringsContext(NamedTuple):
    """What the kernels of the term work with."""

    model: Springs
    unused: NDArray  # (n, 3)


@forces
def _forces(own, u, v, t, force, powers):
    rows = own.unused.shape[0]
    spring_force(own.model, rows_at(u, rows), rows_at(force, rows))


@energies
def _energies(own, u, out):
    moved = rows_at(u, own.unused.shape[0])
    numbers_at(out, 1)[0] = spring_force(own.model, moved, own.unused)


class SpringsTerm(SheetTerm):
    """Points and springs as solvers take them."""

    energy_groups = {"strain_springs": "strain energy of the springs"}  # noqa: RUF012

    def __init__(self, model: Springs) -> None:
        self.model, self.size, self.rows = model, model.rest.size, len(model.rest)

    def tangent(self, q: NDArray, floor: float = -np.inf) -> sparse.csr_array:
        x, matrix = self.model.rest + q.reshape(-1, 3), np.zeros((self.rows, 3, self.rows, 3))
        for (a, b), k, rest in zip(*self.model[1:], strict=True):
            length = np.linalg.norm(x[b] - x[a])
            n = (x[b] - x[a]) / length
            block = k * np.outer(n, n) + k * (1.0 - rest / length) * (np.eye(3) - np.outer(n, n))
            for i, j, sign in ((a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)):
                matrix[i, :, j] += sign * block
        row, column = np.indices((self.size, self.size)).reshape(2, -1)  # entries at fixed places
        data = matrix.reshape(-1)
        return sparse.csr_array((data, (row, column)), (self.size, self.size))

    def blocks(self) -> SparseBlocks:
        where = np.repeat(self.model.rest, 3, axis=0)
        return SparseBlocks(self.tangent(np.zeros(self.size)), self.rows, where)

    def scratches(self, threads: int) -> list[SpringsScratch]:
        own = np.array([0, self.rows])
        return [SpringsScratch(np.zeros(0), np.zeros(0), own, team(1)[0])]

    def compiled(self, part, kept: SpringsScratch, group: int) -> CompiledTerm:
        own = Context(SpringsContext(self.model, np.zeros((self.rows, 3))))
        return CompiledTerm(own, {FORCES: _forces, ENERGIES: _energies})

    @property
    def folds(self) -> Folds:
        return Folds(np.zeros(0), np.zeros((0, 4)), np.zeros(0))

    def turn(self, q: NDArray, other: NDArray) -> float:
        a, b = self.model.ends.T
        shift = (other - q).reshape(-1, 3)
        apart = np.linalg.norm(shift[b] - shift[a], axis=1)
        return float((apart / self.model.length).max())

    def scale(self) -> NDArray:
        return np.full(self.size, float((self.model.stiffness * self.model.length).sum()))

    def longest(self) -> float:
        return float(self.model.length.max())


@dataclass(frozen=True)
class NoOptions:
    """Choices by which the structure was made: none."""


@dataclass(frozen=True, eq=False)
class Net(Discretized):
    """A structure of points and springs: what a case holds."""

    nodes: NDArray
    bars: NDArray
    stiffness: NDArray
    node_mass: NDArray
    sheet = fd.Sheet(1.0, 0.0, 1.0)
    options = NoOptions()
    kind = "springs"
    pattern = None
    folds = np.zeros((0, 4), np.int64)
    fold_rest = np.zeros(0)
    fold_law = hinge_law("linear")
    energy_groups = {"strain_springs": "strain energy of the springs"}  # noqa: RUF012
    fill = Fill(1000.0, 100, "net", "take fewer springs")

    @cached_property
    def mass(self) -> sparse.csr_array:
        return sparse.csr_array(sparse.diags_array(self.node_mass))

    @cached_property
    def body(self) -> Assembly:
        model = Springs(self.nodes, self.bars, self.stiffness, self.bar_length)
        return Assembly(SpringsTerm(model))
