"""Central differences of many models side by side, in the lanes of `mechanics.lanes`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.dynamics.course import Outcome
from foldyn.jit.compiled import inner, shared
from foldyn.jit.eights import eight, put
from foldyn.jit.intrinsics import borrowed
from foldyn.mechanics.lanes import (
    WIDTH,
    add_bar_lanes,
    add_hinge_lanes,
    energies_of_lanes,
)

OUTCOME, STEP, HINGE = range(3)
"""What is noted of a model: how it ended, after which step, at which hinge."""


class LanePlan(NamedTuple):
    """Steps and samples of WIDTH models; one that takes no steps has -1 of them."""

    dt: NDArray  # (WIDTH,) s
    steps: NDArray  # (WIDTH,)
    every: NDArray  # (WIDTH,) steps between samples


class LaneState(NamedTuple):
    """WIDTH models of d dofs on their way, flat."""

    u: NDArray  # (d WIDTH,) m
    v: NDArray  # m/s
    a: NDArray  # m/s2
    force: NDArray  # N
    position: NDArray  # m
    angle: NDArray  # (nh WIDTH,) at the last step, rad
    before: NDArray  # (WIDTH,) of the hinge at which a model ended, before that, rad
    work: NDArray  # (4, WIDTH) work and energy dissipated, J, and their powers, W
    strain: NDArray  # (groups, WIDTH) J
    note: NDArray  # (3, WIDTH) int64; of the hinge -1 before


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


@inner
def write_samples(topology, own, loads, state, out, step, chosen):
    """Write a sample of each chosen (WIDTH,) model; one that is not finite ends instead."""
    u, v, strain, energies = state.u, state.v, state.strain, state.work
    energies_of_lanes(topology, own, u, state.angle, strain)
    groups = strain.shape[0]
    for q in range(WIDTH):
        if chosen[q] == 0:
            continue
        k = step // chosen[q]
        kinetic = 0.0
        for place in range(out.order.size):
            for c in range(3):
                i = (3 * place + c) * WIDTH + q
                out.displacement[q, k, out.order[place], c] = u[i]
                out.velocity[q, k, out.order[place], c] = v[i]
                kinetic += 0.5 * loads.mass[i] * v[i] * v[i]
        for s in range(out.supported.size):
            out.reaction[q, k, s] = state.force[out.supported[s] * WIDTH + q]
        for g in range(groups):
            out.energy[q, k, g] = strain[g, q]
        out.energy[q, k, groups] = kinetic
        out.energy[q, k, groups + 1] = energies[1, q]
        out.energy[q, k, groups + 2] = energies[0, q]
        if not abs(out.energy[q, k].sum()) < np.inf:
            state.note[OUTCOME, q], state.note[STEP, q] = Outcome.NOT_FINITE, step


@shared
def advance_lanes(topology, own, loads, factor, state, out, plan, first, last):
    """Do the steps from the first to the last one of WIDTH models; step 0 is the start.

    factor : (last - first + 1, t WIDTH) of the histories, at the ends of these steps. A model that
    has ended, or done its steps, stands still.
    """
    topology, own, loads = borrowed(topology), borrowed(own), borrowed(loads)
    state, out = borrowed(state), borrowed(out)
    u, v, a, force = state.u, state.v, state.a, state.force
    position, size, note = state.position, state.u.size, state.note
    energies, alpha = state.work, loads.alpha
    h, half, none = np.zeros(WIDTH), np.zeros(WIDTH), np.zeros(WIDTH)
    power_in, power_out, finite = np.zeros(WIDTH), np.zeros(WIDTH), np.zeros(WIDTH)
    chosen, scratch = np.zeros(WIDTH, np.int64), np.zeros(WIDTH)
    zero, slowed = eight(none, 0), eight(alpha, 0)
    for step in range(first, last + 1):
        now = step - first
        for q in range(WIDTH):
            goes_on = note[OUTCOME, q] == Outcome.DONE and step <= plan.steps[q]
            h[q] = plan.dt[q] if goes_on and step > 0 else 0.0
            chosen[q] = plan.every[q] if goes_on and step % plan.every[q] == 0 else 0
            half[q] = 0.5 * h[q]
            power_in[q] = 0.0
        span, kick = eight(h, 0), eight(half, 0)
        for i in range(0, size, WIDTH):
            speed = eight(v, i) + kick * eight(a, i)
            there = eight(u, i) + span * speed
            put(v, i, speed)
            put(u, i, there)
            put(position, i, eight(own.rest, i) + there)
            put(force, i, zero)
        add_bar_lanes(topology, own, u, force, scratch)
        jumped = add_hinge_lanes(
            topology, own, position, force, scratch, state.angle, state.before, note[HINGE]
        )
        for term in range(loads.value.shape[0]):
            for k in range(loads.dof.size):
                at = loads.dof[k] * WIDTH
                for q in range(WIDTH):
                    load = loads.value[term, k * WIDTH + q] * factor[now, term * WIDTH + q]
                    force[at + q] -= load
                    power_in[q] += load * (v[at + q] + half[q] * a[at + q])
        drag, wrong = zero, zero
        for i in range(0, size, WIDTH):
            speed, old = eight(v, i), eight(a, i)
            ahead = speed + kick * old  # velocity that drag sees
            new = -eight(force, i) * eight(loads.inverse, i) - slowed * ahead
            speed = speed + kick * new
            put(a, i, new)
            put(v, i, speed)
            drag = drag + eight(loads.mass, i) * ahead * ahead
            wrong = wrong + zero * speed  # nan, once one of them is inf or nan
        put(power_out, 0, drag * slowed)
        put(finite, 0, wrong)
        for q in range(WIDTH):
            energies[0, q] += 0.5 * h[q] * (energies[2, q] + power_in[q])
            energies[1, q] += 0.5 * h[q] * (energies[3, q] + power_out[q])
            energies[2, q], energies[3, q] = power_in[q], power_out[q]
            if finite[q] != 0.0 and note[OUTCOME, q] == Outcome.DONE:
                note[OUTCOME, q], note[STEP, q] = Outcome.NOT_FINITE, step
                chosen[q] = 0
            if jumped and note[HINGE, q] >= 0 and note[OUTCOME, q] == Outcome.DONE:
                note[OUTCOME, q], note[STEP, q] = Outcome.PENETRATION, step
                chosen[q] = 0
        if chosen.any():
            write_samples(topology, own, loads, state, out, step, chosen)
