"""Central differences of many models side by side, in the lanes of `mechanics.lanes`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import shared
from foldyn.jit.intrinsics import borrowed
from foldyn.mechanics.lanes import (
    WIDTH,
    add_bar_lanes,
    add_hinge_lanes,
    energies_of_lanes,
)

GOES_ON, NOT_FINITE, PENETRATION = range(3)
"""What became of a model."""


class LaneState(NamedTuple):
    """WIDTH models of d dofs on their way, flat."""

    u: NDArray  # (d WIDTH,) m
    v: NDArray  # m/s
    a: NDArray  # m/s2
    ahead: NDArray  # velocity that drag sees, m/s
    force: NDArray  # N
    position: NDArray  # m
    angle: NDArray  # (nh WIDTH,) at the last step, rad
    work: NDArray  # (4, WIDTH) work and energy dissipated, J, and their powers, W
    strain: NDArray  # (groups, WIDTH) J
    outcome: NDArray  # (2, WIDTH) int64: what became of it, and in which step


class LaneLoads(NamedTuple):
    """Loads on k dofs, in t terms with a history each."""

    dof: NDArray  # (k,)
    value: NDArray  # (t, k WIDTH) N
    inverse: NDArray  # (d WIDTH,) 1/kg, 0 on fixed dofs
    mass: NDArray  # (d WIDTH,) kg
    alpha: NDArray  # (WIDTH,) 1/s


class LaneSamples(NamedTuple):
    """Output of k samples of WIDTH models, n nodes, s supported dofs."""

    order: NDArray  # (n,) node number of each place in memory
    supported: NDArray  # (s,) dofs
    displacement: NDArray  # (WIDTH, k, n, 3)
    velocity: NDArray  # (WIDTH, k, n, 3)
    reaction: NDArray  # (WIDTH, k, s)
    energy: NDArray  # (WIDTH, k, groups + 3)


@shared
def advance_lanes(topology, own, loads, factor, state, out, work, dt, begun, count, every):
    """Advance WIDTH models by `count` steps after `begun`; the first call does step 0 too.

    factor : (count + 1, t WIDTH) of the histories, from step `begun` on.
    """
    topology, own, loads = borrowed(topology), borrowed(own), borrowed(loads)
    state, out, work = borrowed(state), borrowed(out), borrowed(work)
    u, v, a, ahead, force = state.u, state.v, state.a, state.ahead, state.force
    position, size = state.position, state.u.size
    energies = state.work
    power_in, power_out = np.zeros(WIDTH), np.zeros(WIDTH)
    for step in range(begun + 1 if begun > 0 else 0, begun + count + 1):
        h = dt if step > 0 else 0.0
        now = step - begun
        for i in range(size):
            v[i] += 0.5 * h * a[i]
            u[i] += h * v[i]
            ahead[i] = v[i] + 0.5 * h * a[i]
        for i in range(size):
            position[i] = own.rest[i] + u[i]
            force[i] = 0.0
        add_bar_lanes(topology, own, u, force, work)
        add_hinge_lanes(topology, own, position, force, work)
        power_in[:] = 0.0
        power_out[:] = 0.0
        for term in range(loads.value.shape[0]):
            for k in range(loads.dof.size):
                at = loads.dof[k] * WIDTH
                for q in range(WIDTH):
                    load = loads.value[term, k * WIDTH + q] * factor[now, term * WIDTH + q]
                    force[at + q] -= load
                    power_in[q] += load * ahead[at + q]
        for i in range(0, size, WIDTH):
            for q in range(WIDTH):
                power_out[q] += loads.mass[i + q] * ahead[i + q] * ahead[i + q]
                rate = -force[i + q] * loads.inverse[i + q] - loads.alpha[q] * ahead[i + q]
                a[i + q] = rate
                v[i + q] += 0.5 * h * rate
        for q in range(WIDTH):
            power_out[q] *= loads.alpha[q]
            energies[0, q] += 0.5 * h * (energies[2, q] + power_in[q])
            energies[1, q] += 0.5 * h * (energies[3, q] + power_out[q])
            energies[2, q], energies[3, q] = power_in[q], power_out[q]
        angle, before = work.angle, state.angle
        wrong = 0
        for i in range(angle.size):
            wrong += not abs(angle[i] - before[i]) <= np.pi
        if wrong > 0:
            for i in range(angle.size):
                jump, q = abs(angle[i] - before[i]), i % WIDTH
                if state.outcome[0, q] == GOES_ON and not jump <= np.pi:
                    state.outcome[0, q] = PENETRATION if jump > np.pi else NOT_FINITE
                    state.outcome[1, q] = step
        for i in range(angle.size):
            before[i] = angle[i]
        if step % every == 0:
            k = step // every
            energies_of_lanes(topology, own, u, work.angle, state.strain)
            groups = state.strain.shape[0]
            for q in range(WIDTH):
                kinetic = 0.0
                for place in range(out.order.size):
                    for c in range(3):
                        i = (3 * place + c) * WIDTH + q
                        out.displacement[q, k, out.order[place], c] = u[i]
                        out.velocity[q, k, out.order[place], c] = v[i]
                        kinetic += 0.5 * loads.mass[i] * v[i] * v[i]
                for s in range(out.supported.size):
                    out.reaction[q, k, s] = force[out.supported[s] * WIDTH + q]
                total = 0.0
                for g in range(groups):
                    out.energy[q, k, g] = state.strain[g, q]
                    total += state.strain[g, q]
                out.energy[q, k, groups] = kinetic
                out.energy[q, k, groups + 1] = energies[1, q]
                out.energy[q, k, groups + 2] = energies[0, q]
                if state.outcome[0, q] == GOES_ON and not abs(total + kinetic) < np.inf:
                    state.outcome[0, q], state.outcome[1, q] = NOT_FINITE, step
