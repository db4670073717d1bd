"""Explicit methods as CUDA kernels: one model per block of threads, or one on the whole grid.

A force evaluation has two halves, separated by a barrier. First, the threads share the elements:
each writes the corner forces of its elements to slots of their own. Then the threads share the
nodes: each adds up the slots of its nodes, in a fixed order, and moves the nodes. Nothing is added
atomically, so the same input gives the same bits on the same GPU. Plates need another barrier
within the first half (`plates`).

One model per block lives in the block's shared memory; one model per grid in global memory.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

from numba import float64

from foldyn.dynamics.gpu.checks import MOST_BARS, MOST_GROUPS
from foldyn.dynamics.gpu.elements import (
    at,
    bars_to,
    damping_to,
    hinges_to,
    put,
    rows_of,
    springs_to,
)
from foldyn.dynamics.gpu.plates import Rest, hinges_of_plates_to, moments_to
from foldyn.dynamics.gpu.ported import SIMULATED, cuda, on_device, ported
from foldyn.mechanics import membranes, viscous
from foldyn.mechanics.membranes import Membranes
from foldyn.mechanics.model import BarsHinges
from foldyn.mechanics.plates import BarsPlates
from foldyn.mechanics.viscous import Viscous

strain_of = ported(membranes.strain_of)
viscous_gradient = ported(viscous.element_gradient)
REGISTERS = 168  # registers per thread of a grid with one model; fewer let more threads run


class Nodes(NamedTuple):
    """Arrays for the second half of an evaluation, which works on nodes."""

    start: Any  # (n + 1,) first entry of each node
    entry: Any  # slots to add; -1 - slot for a slot to subtract
    order: Any  # number of each node in the structure; dofs without mass have none
    support: Any  # (3 n,) number of each dof among the supported ones, or -1
    mass: Any  # (m, n, 3)
    inverse: Any  # (m, n, 3)
    alpha: Any  # (m,)
    load_start: Any  # (m, 3 n + 1) first load of each dof
    load: Any  # (m, l) loads, N
    load_row: Any  # (m, l) row of the factors for each load


class CardState(NamedTuple):
    """State of m models; `note` and `sums` have one row per thread, block after block."""

    u: Any  # (m, n, 3)
    v: Any
    first: Any  # (m, n, 3) sums of slopes, or the acceleration
    second: Any
    ahead_u: Any  # (m, n, 3) point of force evaluation, unless in shared memory
    ahead_v: Any
    slot: Any  # (m, 3 slots) force vectors, unless in shared memory
    angle: Any  # (m, nh)
    wrong: Any  # (m,) int64
    note: Any  # (threads, columns)
    sums: Any  # (threads, 4) powers in and out at the last step, W; work and dissipation, J
    barrier: Any  # (1,) int64


class Written(NamedTuple):
    """Samples of one launch; the last row of energies belongs to the end of the launch."""

    u: Any  # (m, k, n, 3)
    v: Any
    reaction: Any  # (m, k, s)
    energy: Any  # (k + 1, blocks, columns)


class Span(NamedTuple):
    """Steps of a launch, for m models; `last` before `first` means no step."""

    first: Any  # (m,)
    last: Any
    dt: Any
    every: Any
    sample: Any  # (m,) number of the launch's first sample


@on_device
def panels_to(kind, m, u, slot, size, at_slot, who, crowd, sampled, strain):
    """Write forces on corners and gives of the panels of one kind; return the next free slot."""
    own = Membranes(
        kind.nodes, kind.ends, kind.gives, at(kind.vector, m), at(kind.per_length2, m),
        at(kind.stiffness, m),
    )  # fmt: skip
    count, corners, bars = own.nodes.shape[0], own.nodes.shape[1], own.ends.shape[0]
    given = own.gives.shape[1]
    stretch, along = cuda.local.array(MOST_BARS, float64), cuda.local.array(3, float64)
    for p in range(who, count, crowd):
        for i in range(bars):
            stretch[i] = strain_of(own, u, p, i, along)
        for k in range(given):
            stretch[bars + k] = u[own.gives[p, k] // 3, own.gives[p, k] % 3]
        for v in range(corners + given):
            put(slot, size, at_slot + v * count + p, 0.0, 0.0, 0.0)
        for i in range(bars + given):
            pull = 0.0
            for j in range(bars + given):
                pull += own.stiffness[i, j, p] * stretch[j]
            if sampled:
                strain[0] += 0.5 * stretch[i] * pull
            if i >= bars:
                k = i - bars
                slot[own.gives[p, k] % 3 * size + at_slot + (corners + k) * count + p] = pull
                continue
            pull *= own.per_length2[i, p]
            strain_of(own, u, p, i, along)
            a, b = at_slot + own.ends[i, 0] * count + p, at_slot + own.ends[i, 1] * count + p
            for c in range(3):
                slot[c * size + a] -= pull * along[c]
                slot[c * size + b] += pull * along[c]
    return at_slot + (corners + given) * count


@on_device
def dampers_to(dampers, m, u, v, slot, size, at_slot, who, crowd):
    """Write forces of viscous elements; return the dissipated power, W.

    An element with a dof without mass acts on this dof alone, in the row of its "first node".
    """
    own = Viscous(
        dampers.dofs, at(dampers.axial, m), at(dampers.corners, m), at(dampers.hidden_turn, m),
        at(dampers.coefficient, m), at(dampers.gradient, m),
    )  # fmt: skip
    count, power, g = own.dofs.shape[0], 0.0, cuda.local.array(14, float64)
    for e in range(who, count, crowd):
        viscous_gradient(own, u, e, g)
        rate = 0.0
        for c in range(14):
            rate += g[c] * v[own.dofs[e, c]]
        resisted = own.coefficient[e] * rate
        for k in range(4):
            s, i = at_slot + k * count + e, 3 * k
            put(slot, size, s, resisted * g[i], resisted * g[i + 1], resisted * g[i + 2])
        slot[own.dofs[e, 12] % 3 * size + at_slot + e] += resisted * (g[12] + g[13])
        power += resisted * rate
    return power


@on_device
def forces_to(
    elements, counts, m, u, flat_u, flat_v, slot, angle, who, crowd, sampled, looks, strain
):
    """First half: forces of all elements; return the number of failures and the power lost, W."""
    model, size = elements.model, counts.slots
    own = BarsHinges(
        at(model.rest, m), model.bars, at(model.bar_vector, m), at(model.bar_per_length2, m),
        at(model.bar_stiffness, m), model.bar_runs, model.hinges, at(model.hinge_stiffness, m),
        at(model.hinge_rest, m), at(model.hinge_parameters, m), at(model.hinge_share, m),
        at(model.hinge_offset, m), model.hinge_group, model.hinge_runs, model.addresses,
    )  # fmt: skip
    bars_to(own, elements.bar_code, u, slot, size, who, crowd, sampled, strain)
    s = own.bars.shape[0]
    wrong = hinges_to(
        own, elements.hinge_code, u, slot, size, s, who, crowd, sampled, looks, angle, strain
    )
    s += 4 * own.hinges.shape[0]
    kinds = elements.membranes  # unrolled, as Numba cannot loop over tuples on the GPU
    s = panels_to(kinds[0], m, u, slot, size, s, who, crowd, sampled, strain)
    s = panels_to(kinds[1], m, u, slot, size, s, who, crowd, sampled, strain)
    s = panels_to(kinds[2], m, u, slot, size, s, who, crowd, sampled, strain)
    springs, group = elements.springs, counts.spring_group
    s = springs_to(springs, m, group, u, slot, size, s, who, crowd, sampled, strain)
    power = dampers_to(elements.viscous, m, flat_u, flat_v, slot, size, s, who, crowd)
    s += 4 * elements.viscous.dofs.shape[0]
    power += damping_to(elements.damping, m, counts.damped, flat_v, slot, size, s, who, crowd)
    return wrong, power


@on_device
def sum_to(nodes, slot, size, i, out):
    """Force (3,) on a node, summed in the order of its entries."""
    x, y, z = 0.0, 0.0, 0.0
    for k in range(nodes.start[i], nodes.start[i + 1]):
        s = nodes.entry[k]
        if s >= 0:
            x, y, z = x + slot[s], y + slot[size + s], z + slot[2 * size + s]
        else:
            s = -1 - s
            x, y, z = x - slot[s], y - slot[size + s], z - slot[2 * size + s]
    out[0], out[1], out[2] = x, y, z


@on_device
def load_on(nodes, load_start, load, load_row, factor, time, dof):
    """Load on a dof, N."""
    total = 0.0
    for k in range(load_start[dof], load_start[dof + 1]):
        total += load[k] * factor[load_row[k], time]
    return total


@on_device
def meet_in_grid(state, blocks, arrived):
    """Wait for all threads of the grid; return the number of times they have met."""
    cuda.syncthreads()
    if cuda.threadIdx.x == 0:
        cuda.threadfence()
        cuda.atomic.add(state.barrier, 0, 1)
        while cuda.atomic.add(state.barrier, 0, 0) < (arrived + 1) * blocks:
            pass
        cuda.threadfence()
    cuda.syncthreads()
    return arrived + 1


@on_device
def meet_in_block(state, blocks, arrived):
    """The same for the threads of a block."""
    cuda.syncthreads()
    return arrived


@on_device
def note_down(state, thread, groups, strain, kinetic, work_out, work_in):
    """Store a thread's share of the energies, for the sum over its block."""
    for g in range(groups):
        state.note[thread, g] = strain[g]
    state.note[thread, groups] = kinetic
    state.note[thread, groups + 1] = work_out
    state.note[thread, groups + 2] = work_in


@on_device
def add_notes(state, row, columns):
    """Add up the notes of all threads of a block; its first threads do it."""
    first, count = cuda.blockIdx.x * cuda.blockDim.x, cuda.blockDim.x
    for c in range(cuda.threadIdx.x, columns, count):
        total = 0.0
        for k in range(count):
            total += state.note[first + k, c]
        row[cuda.blockIdx.x, c] = total


@lru_cache
def kernel(method: str, wide: bool, shared: bool, plates: bool) -> Any:
    """Compile the time loop of a method as a CUDA kernel.

    wide : whether one model uses the whole grid; otherwise each block has one model.
    shared : whether the model is in shared memory.
    plates : whether panels bend as plates.
    """
    runge = method == "rk4"
    stages, per_step = (4, 3) if runge else (1, 1)
    meet = meet_in_grid if wide else meet_in_block

    def advance(elements, nodes, counts, span, factor, state, out):
        """Advance over a span of steps."""
        if wide:
            m, who, crowd = 0, cuda.grid(1), cuda.gridsize(1)
        else:
            m, who, crowd = cuda.blockIdx.x, cuda.threadIdx.x, cuda.blockDim.x
        blocks, thread = cuda.gridDim.x, cuda.blockIdx.x * cuda.blockDim.x + cuda.threadIdx.x
        n, size, groups = counts.nodes, counts.slots, counts.groups
        real = nodes.order.shape[0]
        if shared:
            slot, own = cuda.shared.array(0, float64), 3 * size + counts.more
            ut, vt = rows_of(slot, own, n), rows_of(slot, own + 3 * n, n)
            flat_u, flat_v = slot[own : own + 3 * n], slot[own + 3 * n : own + 6 * n]
        else:
            slot, flat_u, flat_v = state.slot[m], state.ahead_u[m], state.ahead_v[m]
            ut, vt = rows_of(flat_u, 0, n), rows_of(flat_v, 0, n)
        u, v, angle = state.u[m], state.v[m], state.angle[m]
        du, dv = state.first[m], state.second[m]
        mass, inverse, alpha = at(nodes.mass, m), at(nodes.inverse, m), nodes.alpha[m]
        load_start = at(nodes.load_start, m)
        load, load_row = at(nodes.load, m), at(nodes.load_row, m)
        if plates:
            table, of = elements.plates, elements.plates.model
            sheet = BarsPlates(
                Rest(at(elements.model.rest, m)),  # type: ignore[arg-type]
                of.rotations, table.per_reach[m],
                of.rotation_hinge, of.hinges, at(of.wings, m), of.fold_rotations, of.fold_ways,
                at(of.unmoved, m), at(of.fold_stiffness, m), at(of.fold_rest, m),
                at(of.fold_parameters, m), of.code, of.addresses, at(of.bend_rest, m), of.start,
                of.angle, of.entry, at(of.stiffness, m),
            )  # fmt: skip
            hinges, hidden, z = of.hinges.shape[0], counts.hidden, flat_u[3 * real :]
            turned = slot[3 * size : 3 * size + hinges]
            x = slot[3 * size + hinges : 3 * size + hinges + hidden]
            couple = slot[3 * size + hinges + hidden : 3 * size + hinges + 2 * hidden]
            points, found = cuda.local.array((4, 3), float64), cuda.local.array(12, float64)
        strain = cuda.local.array(MOST_GROUPS, float64)
        force = cuda.local.array(3, float64)
        first_step, last_step, every = span.first[m], span.last[m], span.every[m]
        dt, first_sample = span.dt[m], span.sample[m]
        arrived, sample, wrong = 0, first_sample, 0
        for g in range(groups):
            strain[g] = 0.0
        sums = state.sums[thread]
        before_in, before_out, work_in, work_out = sums[0], sums[1], sums[2], sums[3]
        for i in range(who, n, crowd):
            for c in range(3):
                ut[i, c], vt[i, c] = u[i, c], v[i, c]
        for step in range(first_step, last_step + 1):
            sampled = step == sample * every
            part_in, part_out, kinetic = 0.0, 0.0, 0.0
            for stage in range(stages):
                h = dt
                if not runge:  # kick and drift of central differences
                    h = dt if step > 0 else 0.0
                    for i in range(who, n, crowd):
                        for c in range(3):
                            v[i, c] += 0.5 * h * du[i, c]
                            u[i, c] += h * v[i, c]
                            ut[i, c] = u[i, c]
                            vt[i, c] = v[i, c] + 0.5 * h * du[i, c]
                first = stage == 0
                arrived = meet(state, blocks, arrived)
                looks = first and sampled
                if looks:
                    for g in range(groups):
                        strain[g] = 0.0
                jumped, power_out = forces_to(
                    elements, counts, m, ut, flat_u, flat_v, slot, angle, who, crowd, looks, first,
                    strain,
                )  # fmt: skip
                wrong += jumped
                if plates:
                    wrong += hinges_of_plates_to(
                        sheet, table.alone, ut, z, slot, size, size - 4 * hinges, who, crowd, first,
                        angle, turned, x, points, found,
                    )  # fmt: skip
                    arrived = meet(state, blocks, arrived)
                    moments_to(
                        sheet, table, slot, size, size - 4 * hinges, who, crowd, looks, turned, x,
                        couple, strain,
                    )  # fmt: skip
                power_in, time = 0.0, per_step * (step - first_step) + (stage + 1) // 2
                arrived = meet(state, blocks, arrived)
                ends = runge and step == last_step
                for i in range(who, n, crowd):
                    sum_to(nodes, slot, size, i, force)
                    if plates and i >= real:
                        for c in range(3):
                            force[c] += couple[3 * (i - real) + c]
                    for c in range(3):
                        dof, speed = 3 * i + c, vt[i, c]
                        pull = load_on(nodes, load_start, load, load_row, factor, time, dof)
                        left = force[c] - pull
                        power_in += pull * speed
                        power_out += alpha * mass[i, c] * speed * speed
                        a = -left * inverse[i, c] - alpha * speed
                        if not runge:
                            du[i, c] = a
                            v[i, c] += 0.5 * h * a
                            wrong += not abs(v[i, c]) < math.inf
                        if looks:
                            k, now = sample - first_sample, v[i, c]
                            kinetic += 0.5 * mass[i, c] * now * now
                            if i < real:
                                out.u[m, k, nodes.order[i], c] = u[i, c]
                                out.v[m, k, nodes.order[i], c] = now
                            if nodes.support[dof] >= 0:
                                out.reaction[m, k, nodes.support[dof]] = left
                        if runge and not ends:
                            if stage == 0:
                                du[i, c], dv[i, c] = speed, a
                                ut[i, c] = u[i, c] + 0.5 * dt * speed
                                vt[i, c] = v[i, c] + 0.5 * dt * a
                            elif stage < 3:
                                ahead = 0.5 * dt if stage == 1 else dt
                                du[i, c] += 2.0 * speed
                                dv[i, c] += 2.0 * a
                                ut[i, c] = u[i, c] + ahead * speed
                                vt[i, c] = v[i, c] + ahead * a
                            else:
                                u[i, c] += dt / 6.0 * (du[i, c] + speed)
                                v[i, c] += dt / 6.0 * (dv[i, c] + a)
                                wrong += not abs(v[i, c]) < math.inf
                                ut[i, c], vt[i, c] = u[i, c], v[i, c]
                if not runge:
                    work_in += 0.5 * h * (before_in + power_in)
                    work_out += 0.5 * h * (before_out + power_out)
                    before_in, before_out = power_in, power_out
                if looks:
                    note_down(state, thread, groups, strain, kinetic, work_out, work_in)
                    cuda.syncthreads()
                    add_notes(state, out.energy[sample - first_sample], groups + 3)
                    sample += 1
                if ends:
                    break
                weight = 2.0 if stage == 1 or stage == 2 else 1.0
                part_in += weight * power_in
                part_out += weight * power_out
            if runge and step < last_step:
                work_in += dt / 6.0 * part_in
                work_out += dt / 6.0 * part_out
        sums[0], sums[1], sums[2], sums[3] = before_in, before_out, work_in, work_out
        cuda.syncthreads()  # until the notes of a last sample are complete
        note_down(state, thread, groups, strain, 0.0, work_out, work_in)
        cuda.syncthreads()
        add_notes(state, out.energy[out.energy.shape[0] - 1], groups + 3)
        if wrong > 0:
            state.wrong[m] = 1

    options = {"max_registers": REGISTERS} if wide and not SIMULATED else {}
    return cuda.jit(advance, **options)
