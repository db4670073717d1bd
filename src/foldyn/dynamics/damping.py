"""Damping in compiled loops: C v, and the power that it takes.

alpha M v, the *drag*, is never assembled: it slows every mass by alpha v, and takes v alpha M v or
2 alpha times the kinetic energy. beta K0 v and what else is constant and sparse, the *viscous*
force, is a product with a matrix. The *dampers* are the rows of modal damping, g' (g v), and
elements that follow the motion; motions with any of them run on one thread.
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
from foldyn.dynamics.dampers import dampers
from foldyn.dynamics.inertia import kinetic_energy, moving_energy
from foldyn.dynamics.modal_damping import ModalRows
from foldyn.jit.compiled import inner, inner_scalar, scalar
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.assembly import Numbering
from foldyn.mechanics.viscous import Viscous, add_viscous_elements, viscous_elements_work


class Damping(NamedTuple):
    """Damping of a case."""

    alpha: float  # 1/s
    indptr: NDArray  # beta K0 and dashpots of fixed directions by rows, of dofs 3 place + axis;
    indices: NDArray  # nothing without them
    data: NDArray
    modal: NDArray  # (r, dofs) rows g of modal damping, C = g' g
    modal_rate: float  # 1/s, of the fastest of them
    elements: Viscous

    @property
    def follows(self) -> bool:
        """Whether there are dampers, which keep a motion on one thread."""
        return len(self.modal) > 0 or self.elements.present

    def viscous(self, size: int) -> sparse.csr_array:
        """The constant sparse part as a matrix of so many dofs."""
        if not self.data.size:
            return sparse.csr_array((size, size))
        return sparse.csr_array((self.data, self.indices, self.indptr), (size, size))


def damping_of(case: Case, by: Numbering, start: NDArray | None, modal: ModalRows) -> Damping:
    """Damping of a case as it stands in memory, for a motion from `start` (n, 3), or from rest.

    modal : its modal damping in that motion.
    """
    matrix, body, rayleigh = sparse.csr_array((0, 0)), case.elastic_body, case.rayleigh
    if rayleigh.beta > 0.0:
        state = start if rayleigh.state == "start" else None
        state = np.zeros_like(case.structure.nodes) if state is None else state
        matrix = by.matrix(body.tangent(body.dofs(state))) * rayleigh.beta
    more = dampers(case)
    if more.constant.nnz:
        fixed = by.matrix(more.constant)
        matrix = sparse.csr_array(matrix + fixed if matrix.nnz else fixed)
    modal.warn()
    return Damping(
        alpha=float(rayleigh.alpha),
        indptr=matrix.indptr.astype(np.int64),
        indices=matrix.indices.astype(np.int64),
        data=np.asarray(matrix.data, float),
        modal=_placed(modal.rows, by),
        modal_rate=modal.rate,
        elements=more.placed(by),
    )


def _placed(rows: NDArray, by: Numbering) -> NDArray:
    """Rows (r, m) of dofs as they stand in memory, (r, 3 rows there)."""
    nodal = 3 * len(by.order)
    out = np.zeros((len(rows), 3 * by.rows))
    out[:, by.dofs(np.arange(nodal))] = rows[:, :nodal]
    out[:, nodal : rows.shape[1]] = rows[:, nodal:]
    return out


@scalar
def drag(damping, velocity):
    """Deceleration (m/s2) of a mass by drag."""
    return damping.alpha * velocity


@inner_scalar
def drag_power(damping, kinetic):
    """Power (W) that drag takes at a kinetic energy (J)."""
    return 2.0 * damping.alpha * kinetic


@inner
def drag_works(damping, mass, moved_mass, h, before, after, velocity):
    """Work of moving supports against drag in a step of h, and what drag takes in all, J.

    velocity : (n, 3), the mean in the step without that of supports.
    before, after : (h, 3) factors of the histories at its ends.
    """
    if damping.alpha == 0.0:
        return 0.0, 0.0
    carried = moving_energy(moved_mass, before) + moving_energy(moved_mass, after)
    carried *= damping.alpha * h
    kinetic = kinetic_energy(mass, velocity, (0, velocity.shape[0]))
    taken = 2.0 * damping.alpha * h * kinetic
    return carried, taken + carried


@inner_scalar
def viscous_row(damping, velocity, i):
    """Viscous force at one dof, N, of flat velocities."""
    force = 0.0
    for k in range(damping.indptr[i], damping.indptr[i + 1]):
        force += damping.data[k] * velocity[damping.indices[k]]
    return force


@inner_scalar
def add_viscous(damping, velocity, force, first, last):
    """Add it to the dofs first to last of a force, all flat; returns the power taken, W."""
    power = 0.0
    for i in range(first, last):
        viscous = viscous_row(damping, velocity, i)
        force[i] += viscous
        power += viscous * velocity[i]
    return power


@inner
def viscous_work(damping, velocity, shift):
    """Work (J) of the viscous force along a shift, both (n, 3)."""
    work, v, along = 0.0, flat(velocity), flat(shift)
    for i in range(damping.indptr.size - 1):
        work += viscous_row(damping, v, i) * along[i]
    return work


@inner_scalar
def has_dampers(damping):
    """Whether there are any."""
    return (
        damping.modal.shape[0] > 0
        or damping.elements.coefficient.size > 0
        or damping.elements.panels.nodes.size > 0
    )


@inner
def add_dampers(damping, u, v, force):
    """Add the dampers' forces at u and v to `force`, all (rows, 3); returns the power taken, W."""
    power = add_viscous_elements(damping.elements, u, v, force)
    speed, out = flat(v), flat(force)
    for k in range(damping.modal.shape[0]):
        rate, row = 0.0, damping.modal[k]
        for i in range(row.size):
            rate += row[i] * speed[i]
        for i in range(row.size):
            out[i] += rate * row[i]
        power += rate * rate
    return power


@inner
def dampers_work(damping, u, v, shift):
    """Work (J) of the dampers' forces at u and v along a shift, all (rows, 3)."""
    work = viscous_elements_work(damping.elements, u, v, shift)
    speed, along = flat(v), flat(shift)
    for k in range(damping.modal.shape[0]):
        rate, change, row = 0.0, 0.0, damping.modal[k]
        for i in range(row.size):
            rate += row[i] * speed[i]
            change += row[i] * along[i]
        work += rate * change
    return work
