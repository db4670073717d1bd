"""Constraints in compiled loops: slaves follow their masters and pass their forces to them.

Motions relative to the supports satisfy G v = 0. The free dofs determine such a motion: each slave
is a linear combination of some free dofs, its masters, with constant coefficients. A force on a
slave acts on its masters with the same coefficients. See `cases.constraints`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases.constraints import Constraints
from foldyn.jit.compiled import inner, kernel
from foldyn.mechanics.assembly import Numbering


class Rows(NamedTuple):
    """Linear combinations of dofs 3 place + axis; row k: entries start[k] to start[k + 1] - 1."""

    start: NDArray  # (k + 1,)
    dof: NDArray
    value: NDArray


class Ties(NamedTuple):
    """The s slaves, as dofs 3 place + axis, and what they follow; none without constraints."""

    slave: NDArray  # (s,)
    masters: Rows  # masters of each slave
    free: NDArray  # (f,) free dofs; none without constraints
    reactions: Rows  # reactions of supports on `case.reaction_dofs`, from forces on all dofs


def ties_of(constraints: Constraints, by: Numbering) -> Ties:
    """Constraints as `Ties`, in memory order."""
    if not constraints:
        nothing, empty = np.zeros(0, np.int64), Rows(np.zeros(1, np.int64), *np.zeros((2, 0)))
        empty = empty._replace(dof=nothing)
        return Ties(nothing, empty, nothing, _rows(constraints.reactions, by))
    slaves, free = constraints.slaves, constraints.free
    only = sparse.csr_array(constraints.basis[slaves][:, free])
    by_free = Rows(only.indptr.astype(np.int64), by.dofs(free[only.indices]), only.data)
    return Ties(by.dofs(slaves), by_free, by.dofs(free), _rows(constraints.reactions, by))


def _rows(matrix: sparse.csr_array, by: Numbering) -> Rows:
    return Rows(matrix.indptr.astype(np.int64), by.dofs(matrix.indices), matrix.data)


def masters_of(free: NDArray, ties: Ties, dofs: int) -> tuple[NDArray, NDArray, NDArray]:
    """For each dof, its masters, numbered as in `free` (f,), and their coefficients, as in CSR."""
    number = np.full(dofs, -1)
    number[free] = np.arange(len(free))
    dof = np.concatenate([free, np.repeat(ties.slave, np.diff(ties.masters.start))])
    master = number[np.concatenate([free, ties.masters.dof])]
    value = np.concatenate([np.ones(len(free)), ties.masters.value])
    order = np.argsort(dof, kind="stable")
    start = np.searchsorted(dof[order], np.arange(dofs + 1))
    return start, master[order], value[order]


def onto(free: NDArray, ties: Ties, dofs: int) -> sparse.csr_array:
    """Map (dofs, f) from the free dofs to all dofs, including the slaves of constraints."""
    start, master, value = masters_of(free, ties, dofs)
    return sparse.csr_array((value, master, start), (dofs, len(free)))


def reduced(matrix: sparse.csr_array, ties: Ties) -> sparse.csr_array:
    """Reduce a matrix of all dofs (m, m) to the free dofs (f, f)."""
    basis = onto(ties.free, ties, matrix.shape[0])
    return sparse.csr_array(basis.T @ matrix @ basis)


@kernel
def follow_masters(ties, motion):
    """Set the slaves of a flat motion from its free dofs."""
    masters = ties.masters
    for k in range(ties.slave.size):
        total = 0.0
        for p in range(masters.start[k], masters.start[k + 1]):
            total += masters.value[p] * motion[masters.dof[p]]
        motion[ties.slave[k]] = total


@kernel
def hand_over(ties, force):
    """Move flat forces on slaves to their masters."""
    masters = ties.masters
    for k in range(ties.slave.size):
        own = force[ties.slave[k]]
        for p in range(masters.start[k], masters.start[k + 1]):
            force[masters.dof[p]] += masters.value[p] * own
        force[ties.slave[k]] = 0.0


@inner
def add_reactions(rows, force, factor, out):
    """Add `factor` times the reactions of the supports to a flat force on all dofs."""
    for k in range(out.size):
        for p in range(rows.start[k], rows.start[k + 1]):
            out[k] += factor * rows.value[p] * force[rows.dof[p]]
