"""Rayleigh damping in compiled loops: C v with C = alpha M + beta K0, and the power that it takes.

alpha M v, the *drag*, is never assembled: it slows every mass by alpha v, and takes v alpha M v or
2 alpha times the kinetic energy. beta K0 v, the *viscous* force, is a product with a sparse matrix.
Where supports move, free nodes are slowed by the velocity w without S f' (see `system`), and the
drag on S f' itself is overcome by whatever moves the supports.

In the matrix of an implicit step with dw = rate dq, drag adds alpha rate to the factor of M.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import Case
from foldyn.dynamics.inertia import kinetic_energy, moving_energy
from foldyn.jit.compiled import kernel, scalar
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.body import Numbering


class Damping(NamedTuple):
    """Rayleigh damping of a case."""

    alpha: float  # 1/s
    indptr: NDArray  # beta K0 by rows, of dofs 3 place + axis; none if beta = 0
    indices: NDArray
    data: NDArray

    def viscous(self, size: int) -> sparse.csr_array:
        """beta K0 as a matrix of so many dofs."""
        if not self.data.size:
            return sparse.csr_array((size, size))
        return sparse.csr_array((self.data, self.indices, self.indptr), (size, size))


def damping_of(case: Case, by: Numbering, start: NDArray | None) -> Damping:
    """Damping of a case as it stands in memory, for a motion from `start` (n, 3), or from rest."""
    matrix, body = sparse.csr_array((0, 0)), case.body
    if case.damping.beta > 0.0:
        state = start if case.damping.state == "start" else None
        state = np.zeros_like(case.structure.nodes) if state is None else state
        matrix = by.matrix(body.tangent(body.dofs(state))) * case.damping.beta
    return Damping(
        alpha=float(case.damping.alpha),
        indptr=matrix.indptr.astype(np.int64),
        indices=matrix.indices.astype(np.int64),
        data=np.asarray(matrix.data, float),
    )


@scalar
def drag(damping, velocity):
    """Deceleration (m/s2) of a mass by drag."""
    return damping.alpha * velocity


@scalar
def drag_power(damping, kinetic):
    """Power (W) that drag takes at a kinetic energy (J)."""
    return 2.0 * damping.alpha * kinetic


@kernel
def drag_works(damping, mass, moved_mass, h, before, after, velocity, product):
    """Work of moving supports against drag in a step of h, and what drag takes in all, J.

    velocity : (n, 3), the mean in the step without that of supports.
    before, after : (h, 3) factors of the histories at its ends.
    product : (n, 3), scratch.
    """
    if damping.alpha == 0.0:
        return 0.0, 0.0
    carried = moving_energy(moved_mass, before) + moving_energy(moved_mass, after)
    carried *= damping.alpha * h
    kinetic = kinetic_energy(mass, velocity, product, (0, velocity.shape[0]))
    taken = 2.0 * damping.alpha * h * kinetic
    return carried, taken + carried


@scalar
def viscous_row(damping, velocity, i):
    """beta K0 v at one dof, N, of flat velocities."""
    force = 0.0
    for k in range(damping.indptr[i], damping.indptr[i + 1]):
        force += damping.data[k] * velocity[damping.indices[k]]
    return force


@scalar
def add_viscous(damping, velocity, force, first, last):
    """Add beta K0 v to the dofs first to last of a force, all flat; returns the power taken, W."""
    power = 0.0
    for i in range(first, last):
        viscous = viscous_row(damping, velocity, i)
        force[i] += viscous
        power += viscous * velocity[i]
    return power


@kernel
def viscous_work(damping, velocity, shift):
    """Work (J) of beta K0 v along a shift, both (n, 3)."""
    work, v, along = 0.0, flat(velocity), flat(shift)
    for i in range(damping.indptr.size - 1):
        work += viscous_row(damping, v, i) * along[i]
    return work
