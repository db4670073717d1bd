"""A case as arrays: M a + C v + F_int(u) = sum of load vectors times their factors."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import Case
from foldyn.dynamics.inertia import Inertia, inertia, solve_mass, times_mass
from foldyn.materials.compiled import kernel
from foldyn.mechanics import BarsHinges, internal_force, strain_energies


class System(NamedTuple):
    """What compiled integrators need beside the model: n nodes, h histories, s supported dofs."""

    free: NDArray  # (n, 3) 1.0 on free dofs, 0.0 on fixed ones
    supported: NDArray  # (s,) dof numbers 3 node + axis
    alpha: float
    stiff_indptr: NDArray  # beta K0 by rows; no rows if beta = 0
    stiff_indices: NDArray
    stiff_data: NDArray
    load_dof: NDArray  # (l,)
    load_value: NDArray  # (l,) N
    load_history: NDArray  # (l,) row of the factors


class Scratch(NamedTuple):
    """Memory of one evaluation of the equation of motion."""

    internal: NDArray  # (n, 3)
    external: NDArray  # (n, 3)
    viscous: NDArray  # (n, 3) C v
    momentum: NDArray  # (n, 3) M v
    residual: NDArray  # (n, 3)
    line: NDArray  # (n,)
    energy: NDArray  # (3,)


def pack(case: Case) -> tuple[BarsHinges, System, Inertia]:
    """Arrays of a case: the model, the system and its inertia."""
    structure = case.structure
    dofs, values, rows = [np.zeros(0, np.int64)], [np.zeros(0)], [np.zeros(0, np.int64)]
    for row, (vector, _) in enumerate(case.load_terms):
        flat = np.asarray(vector).ravel()
        where = np.flatnonzero(flat)
        dofs.append(where)
        values.append(flat[where])
        rows.append(np.full(len(where), row))
    if case.damping.beta > 0.0:
        k0 = structure.tangent(np.zeros_like(structure.nodes)) * case.damping.beta
    else:
        k0 = sparse.csr_array((0, 0))
    system = System(
        free=(~case.fixed).astype(float),
        supported=np.asarray(case.supported_dofs, np.int64),
        alpha=float(case.damping.alpha),
        stiff_indptr=k0.indptr.astype(np.int64),
        stiff_indices=k0.indices.astype(np.int64),
        stiff_data=np.asarray(k0.data, float),
        load_dof=np.concatenate(dofs).astype(np.int64),
        load_value=np.concatenate(values),
        load_history=np.concatenate(rows).astype(np.int64),
    )
    return structure.model, system, inertia(structure.mass, case.fixed)


def scratch(nodes: int) -> Scratch:
    """Memory for a model of so many nodes."""
    full = [np.zeros((nodes, 3)) for _ in range(5)]
    return Scratch(full[0], full[1], full[2], full[3], full[4], np.zeros(nodes), np.zeros(3))


@kernel
def acceleration(model, system, mass, u, v, factors, out, work, s):
    """Acceleration (n, 3) at displacement u and velocity v under the histories' factors.

    Returns the power of the loads and the power dissipated (W). The forces stay in `s`.
    """
    internal_force(model, u, s.internal, work)
    s.external[:] = 0.0
    external = s.external.reshape(-1)
    speed = v.reshape(-1)
    power_in = 0.0
    for q in range(system.load_dof.size):
        dof = system.load_dof[q]
        force = system.load_value[q] * factors[system.load_history[q]]
        external[dof] += force
        power_in += force * speed[dof]
    power_out = 0.0
    alpha = system.alpha
    stiff = system.stiff_indptr.size > 1
    if alpha > 0.0 or stiff:
        times_mass(mass, v, s.momentum)
        viscous = s.viscous.reshape(-1)
        momentum = s.momentum.reshape(-1)
        for i in range(viscous.size):
            viscous[i] = alpha * momentum[i]
        if stiff:
            for i in range(viscous.size):
                total = 0.0
                for p in range(system.stiff_indptr[i], system.stiff_indptr[i + 1]):
                    total += system.stiff_data[p] * speed[system.stiff_indices[p]]
                viscous[i] += total
        for i in range(viscous.size):
            power_out += viscous[i] * speed[i]
    n = u.shape[0]
    for i in range(n):
        for c in range(3):
            s.residual[i, c] = s.external[i, c] - s.internal[i, c] - s.viscous[i, c]
    solve_mass(mass, s.residual, out, s.line)
    return power_in, power_out


@kernel
def record(model, system, mass, u, v, a, s, displacement, velocity, reaction, energy):
    """Write one sample after `acceleration`; energy[:4] gets strain energies and kinetic energy.

    The reaction is what the supports exert: M a + C v + F_int - p on supported dofs.
    """
    n = u.shape[0]
    for i in range(n):
        for c in range(3):
            displacement[i, c] = u[i, c]
            velocity[i, c] = v[i, c]
    times_mass(mass, a, s.momentum)
    for q in range(system.supported.size):
        i, c = system.supported[q] // 3, system.supported[q] % 3
        reaction[q] = s.momentum[i, c] - s.residual[i, c]
    strain_energies(model, u, s.energy)
    for k in range(3):
        energy[k] = s.energy[k]
    times_mass(mass, v, s.momentum)
    kinetic = 0.0
    for i in range(n):
        for c in range(3):
            kinetic += 0.5 * v[i, c] * s.momentum[i, c]
    energy[3] = kinetic
