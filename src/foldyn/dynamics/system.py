"""A case as arrays: M a + C v + F_int(u) = sum of load vectors times their factors."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import Case
from foldyn.dynamics.inertia import Inertia, inertia, kinetic_energy, solve_mass, times_mass
from foldyn.dynamics.outcome import DONE, NOT_FINITE, PENETRATION
from foldyn.materials.compiled import kernel, scalar
from foldyn.mechanics import BarsHinges, internal_force, strain_energies
from foldyn.mechanics.flat import flat


class System(NamedTuple):
    """What compiled integrators need beside the model: n nodes, h histories, s supported dofs."""

    supported: NDArray  # (s,) dof numbers 3 node + axis
    alpha: float
    stiff_indptr: NDArray  # beta K0 by rows; none if beta = 0
    stiff_indices: NDArray
    stiff_data: NDArray
    load_dof: NDArray  # (l,)
    load_value: NDArray  # (l,) N
    load_history: NDArray  # (l,) row of the factors


class Scratch(NamedTuple):
    """Memory of one evaluation of the equation of motion."""

    force: NDArray  # (n, 3) F_int + beta K0 v - p
    product: NDArray  # (n, 3) the mass matrix times a vector
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
    return Scratch(np.zeros((nodes, 3)), np.zeros((nodes, 3)), np.zeros(nodes), np.zeros(3))


@scalar
def acceleration(model, system, mass, u, v, factors, out, work, s):
    """Acceleration (n, 3) at displacement u and velocity v under the histories' factors.

    a = - M^-1 (F_int + beta K0 v - p) - alpha v. Returns the power of the loads and the power
    dissipated (W). The bracket stays in `s.force`.
    """
    internal_force(model, u, s.force, work)
    force, speed = flat(s.force), flat(v)
    power_in, power_out = 0.0, 0.0
    for q in range(system.load_dof.size):
        dof = system.load_dof[q]
        load = system.load_value[q] * factors[system.load_history[q]]
        force[dof] -= load
        power_in += load * speed[dof]
    for i in range(system.stiff_indptr.size - 1):
        viscous = 0.0
        for p in range(system.stiff_indptr[i], system.stiff_indptr[i + 1]):
            viscous += system.stiff_data[p] * speed[system.stiff_indices[p]]
        force[i] += viscous
        power_out += viscous * speed[i]
    solve_mass(mass, s.force, out, s.line)
    accelerated, alpha = flat(out), system.alpha
    for i in range(speed.size):
        accelerated[i] = -accelerated[i] - alpha * speed[i]
    if alpha > 0.0:
        power_out += 2.0 * alpha * kinetic_energy(mass, v, s.product)
    return power_in, power_out


@kernel
def record(model, system, mass, u, v, a, s, displacement, velocity, reaction, energy):
    """Write one sample after `acceleration`; energy[:4] gets strain energies and kinetic energy.

    The reaction is what the supports exert: M (a + alpha v) + F_int + beta K0 v - p there.
    """
    n = u.shape[0]
    times_mass(mass, a, s.product)
    for q in range(system.supported.size):
        i, c = system.supported[q] // 3, system.supported[q] % 3
        reaction[q] = s.product[i, c] + s.force[i, c]
    energy[3] = kinetic_energy(mass, v, s.product)
    times_mass(mass, v, s.product)
    for q in range(system.supported.size):
        i, c = system.supported[q] // 3, system.supported[q] % 3
        reaction[q] += system.alpha * s.product[i, c]
    for i in range(n):
        for c in range(3):
            displacement[i, c] = u[i, c]
            velocity[i, c] = v[i, c]
    strain_energies(model, u, s.energy)
    for k in range(3):
        energy[k] = s.energy[k]


@scalar
def passed_through(now, before):
    """Hinge whose dihedral jumped by more than pi, or -1; `before` (nh,) becomes `now`."""
    jumps = 0
    for e in range(now.size):
        jumps += abs(now[e] - before[e]) > np.pi
    if jumps > 0:
        for e in range(now.size):
            if abs(now[e] - before[e]) > np.pi:
                return e
    for e in range(now.size):
        before[e] = now[e]
    return -1


@scalar
def observe(
    model, system, mass, u, v, a, tally, step, every, offset, angle,
    displacement, velocity, reaction, energy, work, s,
):  # fmt: skip
    """Look for panels that passed through each other, and write a sample every `every` steps.

    Every method calls it at t_n after `acceleration`; the sample goes to row step / every -
    offset. Returns (outcome, hinge).
    """
    hinge = passed_through(work.angle, angle)
    if hinge >= 0:
        return PENETRATION, hinge
    if step % every == 0:
        k = step // every - offset
        record(
            model, system, mass, u, v, a, s,
            displacement[k], velocity[k], reaction[k], energy[k],
        )  # fmt: skip
        energy[k, 4], energy[k, 5] = tally[1], tally[0]
        if not np.isfinite(energy[k].sum()):
            return NOT_FINITE, -1
    return DONE, -1
