"""Explicit methods as CUDA kernels: a model for each block of threads, or one for the whole grid.

A force evaluation has two halves, and every thread waits between them. In the first, threads share
the elements: each writes the forces on its corners to slots of its own. In the second, threads
share the nodes: each adds up the slots of its nodes, in an order that never changes, and moves
them. Nothing is added atomically, so the same input gives the same bits on the same card.

A model of a block lives in the block's shared memory; that of a grid in the card's memory.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

from numba import cuda, float64

from foldyn.dynamics.gpu.checks import MOST_BARS, MOST_GROUPS
from foldyn.dynamics.gpu.ported import SIMULATED, on_device, ported
from foldyn.materials import series, switch
from foldyn.mechanics import energy, membranes, springs, viscous
from foldyn.mechanics.membranes import Membranes
from foldyn.mechanics.model import BarsHinges
from foldyn.mechanics.springs import Springs
from foldyn.mechanics.viscous import Viscous

REGISTERS = 168  # of a thread of a grid with one model: with fewer, more threads run at once

bar_extension, hinge_dihedral = ported(energy.bar_extension), ported(energy.hinge_dihedral)
bar_energy, bar_stress = ported(switch.bar_energy), ported(switch.bar_stress)
series_energy, series_moment = ported(series.series_energy), ported(series.series_moment)
strain_of = ported(membranes.strain_of)
directed_extension = ported(springs.directed_extension)
axial_extension, axial_pull = ported(springs.axial_extension), ported(springs.axial_pull)
viscous_gradient = ported(viscous.element_gradient)


class Counts(NamedTuple):
    """How many there are."""

    nodes: int
    slots: int  # of vectors of force
    groups: int  # of strain energy
    spring_group: int
    damped: int  # rows of the damping matrix: all nodes, or none


class Damping(NamedTuple):
    """A constant damping matrix of the dofs."""

    start: Any
    column: Any
    value: Any  # (m, k)


class Elements(NamedTuple):
    """The elements of m models; numbers have an axis of m, or of 1 where they are equal."""

    model: BarsHinges
    bar_code: Any  # (nb,)
    hinge_code: Any  # (nh,)
    membranes: tuple[Membranes, ...]
    springs: Springs
    viscous: Viscous
    damping: Damping


class Nodes(NamedTuple):
    """What nodes work with."""

    start: Any  # (n + 1,) first of the entries of each node
    entry: Any  # slots, or -1 - slot where it is subtracted
    order: Any  # (n,) the structure's number of each node
    support: Any  # (3 n,) number of the supported dof, or -1
    mass: Any  # (m, n)
    inverse: Any  # (m, n, 3)
    alpha: Any  # (m,)
    load_start: Any  # (m, 3 n + 1) first of the loads of each dof
    load: Any  # (m, l) N
    load_row: Any  # (m, l) rows of the factors


class State(NamedTuple):
    """Where m models are; rows of the threads of all blocks, in order, in `note` and `power`."""

    u: Any  # (m, n, 3)
    v: Any
    first: Any  # (m, n, 3) sums of the method, or its acceleration
    second: Any
    ahead_u: Any  # (m, n, 3) where forces are evaluated, unless that is in shared memory
    ahead_v: Any
    slot: Any  # (m, 3 slots) likewise
    angle: Any  # (m, nh)
    wrong: Any  # (m,) int64
    note: Any  # (threads, columns)
    power: Any  # (threads, 2)
    barrier: Any  # (1,) int64


class Written(NamedTuple):
    """Samples of one launch; the last row of the energies is that of its end."""

    u: Any  # (m, k, n, 3)
    v: Any
    reaction: Any  # (m, k, s)
    energy: Any  # (k + 1, blocks, columns)


class Span(NamedTuple):
    """Steps of a launch."""

    first: int
    last: int
    dt: float
    every: int
    sample: int  # number of the next sample, and of the first one in this launch


if SIMULATED:

    def rows_of(array, first, rows):
        """Rows of three from a place in a flat array."""
        return array[first : first + 3 * rows].reshape(rows, 3)

    def at(array, m):
        """That of model m, or the one of all."""
        return array[m if array.shape[0] > 1 else 0]

else:
    from numba import types
    from numba.cuda import cgutils
    from numba.cuda.extending import intrinsic
    from numba.cuda.np.arrayobj import make_array, populate_array

    @intrinsic
    def rows_of(typing_context, array, first, rows):
        """The same: NumPy's would call a function of the run-time library."""
        view = types.Array(array.dtype, 2, "C")

        def codegen(context, builder, signature, arguments):
            source = make_array(array)(context, builder, arguments[0])
            out = make_array(view)(context, builder)
            three, size, row = (context.get_constant(types.intp, k) for k in (3, 8, 24))
            populate_array(
                out, data=builder.gep(source.data, [arguments[1]]), shape=[arguments[2], three],
                strides=[row, size], itemsize=size, meminfo=None,
            )  # fmt: skip
            return out._getvalue()

        return view(array, types.int64, types.int64), codegen

    @intrinsic
    def at(typing_context, array, m):
        """The same: a device function may not return an array."""
        view = types.Array(array.dtype, array.ndim - 1, "C")

        def codegen(context, builder, signature, arguments):
            source = make_array(array)(context, builder, arguments[0])
            out, kind = make_array(view)(context, builder), context.get_value_type(types.intp)
            shape = cgutils.unpack_tuple(builder, source.shape)
            strides = cgutils.unpack_tuple(builder, source.strides)
            several = builder.icmp_signed(">", shape[0], kind(1))
            row = builder.select(several, arguments[1], kind(0))
            count = builder.sdiv(strides[0], source.itemsize)
            populate_array(
                out, data=builder.gep(source.data, [builder.mul(row, count)]), shape=shape[1:],
                strides=strides[1:], itemsize=source.itemsize, meminfo=None,
            )  # fmt: skip
            return out._getvalue()

        return view(array, types.int64), codegen


@on_device
def put(slot, size, s, x, y, z):
    """Write a vector of force."""
    slot[s], slot[size + s], slot[2 * size + s] = x, y, z


@on_device
def bars_to(own, code, u, slot, size, who, crowd, sampled, strain):
    """Forces of the bars, at their second ends; energies where this is a sample."""
    for e in range(who, own.bars.shape[0], crowd):
        stretch = bar_extension(own, u, e)
        s = own.bar_stiffness[e] * bar_stress(code[e], stretch, 0)
        a, b = own.bars[e, 0], own.bars[e, 1]
        put(
            slot, size, e,
            s * (own.bar_vector[e, 0] + (u[b, 0] - u[a, 0])),
            s * (own.bar_vector[e, 1] + (u[b, 1] - u[a, 1])),
            s * (own.bar_vector[e, 2] + (u[b, 2] - u[a, 2])),
        )  # fmt: skip
        if sampled:
            w = bar_energy(code[e], stretch, 0)
            strain[0] += own.bar_stiffness[e] / own.bar_per_length2[e] * w


@on_device
def hinges_to(own, code, u, slot, size, at_slot, who, crowd, sampled, looks, angle, strain):
    """Forces of the hinges; returns how many have passed through 0 or 360 degrees."""
    count, p, jumped = own.hinges.shape[0], own.hinge_parameters, 0
    for e in range(who, count, crowd):
        found = hinge_dihedral(own, u, e)
        theta, share = found[0] + own.hinge_offset[e, 0], own.hinge_share[e]
        moment = own.hinge_stiffness[e] * series_moment(
            code[e], theta, own.hinge_rest[e], p[e, 0], p[e, 1], p[e, 2], p[e, 3], share,
            own.addresses[0],
        )  # fmt: skip
        k = at_slot + e
        put(slot, size, k, moment * found[1], moment * found[2], moment * found[3])
        k += count
        put(slot, size, k, moment * found[4], moment * found[5], moment * found[6])
        k += count
        put(slot, size, k, moment * found[7], moment * found[8], moment * found[9])
        k += count
        put(slot, size, k, moment * found[10], moment * found[11], moment * found[12])
        if looks:
            jumped += abs(found[0] - angle[e]) > math.pi
            angle[e] = found[0]
        if sampled:
            w = series_energy(
                code[e], theta, own.hinge_rest[e], p[e, 0], p[e, 1], p[e, 2], p[e, 3], share,
                own.addresses[0],
            )  # fmt: skip
            strain[1 + own.hinge_group[e]] += own.hinge_stiffness[e] * w
    return jumped


@on_device
def panels_to(kind, m, u, slot, size, at_slot, who, crowd, sampled, strain):
    """Forces of the panels of one kind at their corners; returns the slot after theirs."""
    own = Membranes(
        kind.nodes, kind.ends, at(kind.vector, m), at(kind.per_length2, m), at(kind.stiffness, m)
    )
    count, corners, bars = own.nodes.shape[0], own.nodes.shape[1], own.ends.shape[0]
    stretch, along = cuda.local.array(MOST_BARS, float64), cuda.local.array(3, float64)
    for p in range(who, count, crowd):
        for i in range(bars):
            stretch[i] = strain_of(own, u, p, i, along)
        for v in range(corners):
            put(slot, size, at_slot + v * count + p, 0.0, 0.0, 0.0)
        for i in range(bars):
            pull = 0.0
            for j in range(bars):
                pull += own.stiffness[i, j, p] * stretch[j]
            if sampled:
                strain[0] += 0.5 * stretch[i] * pull
            pull *= own.per_length2[i, p]
            strain_of(own, u, p, i, along)
            a, b = at_slot + own.ends[i, 0] * count + p, at_slot + own.ends[i, 1] * count + p
            for c in range(3):
                slot[c * size + a] -= pull * along[c]
                slot[c * size + b] += pull * along[c]
    return at_slot + corners * count


@on_device
def springs_to(all_springs, m, group, u, slot, size, at_slot, who, crowd, sampled, strain):
    """Forces of springs, at their first ends, or the second of axial ones; returns the next slot."""
    own = Springs(
        all_springs.ends, at(all_springs.direction, m), at(all_springs.stiffness, m),
        all_springs.axial_ends, at(all_springs.vector, m), at(all_springs.length, m),
        at(all_springs.stretch, m), at(all_springs.axial_stiffness, m),
    )  # fmt: skip
    directed, axial = own.ends.shape[0], own.axial_ends.shape[0]
    for s in range(who, directed, crowd):
        extension = directed_extension(own, u, s)
        pull = own.stiffness[s] * extension
        put(
            slot, size, at_slot + s, pull * own.direction[s, 0], pull * own.direction[s, 1],
            pull * own.direction[s, 2],
        )  # fmt: skip
        if sampled:
            strain[group] += 0.5 * pull * extension
    for s in range(who, axial, crowd):
        a, b = own.axial_ends[s, 0], own.axial_ends[s, 1]
        pull = axial_pull(own, u, s)
        put(
            slot, size, at_slot + directed + s,
            pull * (own.vector[s, 0] + u[b, 0] - u[a, 0]),
            pull * (own.vector[s, 1] + u[b, 1] - u[a, 1]),
            pull * (own.vector[s, 2] + u[b, 2] - u[a, 2]),
        )  # fmt: skip
        if sampled:
            extension = axial_extension(own, u, s)[0]
            strain[group] += 0.5 * own.axial_stiffness[s] * extension * extension
    return at_slot + directed + axial


@on_device
def dampers_to(dampers, m, u, v, slot, size, at_slot, who, crowd):
    """Forces of viscous elements, at four nodes each; returns what they dissipate, W."""
    own = Viscous(
        dampers.dofs, at(dampers.axial, m), at(dampers.corners, m), at(dampers.hidden_turn, m),
        at(dampers.coefficient, m), at(dampers.gradient, m),
    )  # fmt: skip
    count, power, g = own.dofs.shape[0], 0.0, cuda.local.array(14, float64)
    for e in range(who, count, crowd):
        viscous_gradient(own, u, e, g)
        rate = 0.0
        for c in range(12):
            rate += g[c] * v[own.dofs[e, c]]
        resisted = own.coefficient[e] * rate
        for k in range(4):
            s = at_slot + k * count + e
            put(slot, size, s, resisted * g[3 * k], resisted * g[3 * k + 1], resisted * g[3 * k + 2])
        power += resisted * rate
    return power


@on_device
def damping_to(damping, m, nodes, v, slot, size, at_slot, who, crowd):
    """Forces of a constant matrix; returns what it dissipates, W."""
    value, power = at(damping.value, m), 0.0
    for i in range(who, nodes, crowd):
        for c in range(3):
            resisted, row = 0.0, 3 * i + c
            for k in range(damping.start[row], damping.start[row + 1]):
                resisted += value[k] * v[damping.column[k]]
            slot[c * size + at_slot + i] = resisted
            power += resisted * v[row]
    return power


@on_device
def forces_to(elements, counts, m, u, flat_u, flat_v, slot, angle, who, crowd, sampled, looks, strain):
    """The first half: forces of all elements; returns how many are wrong, and W dissipated."""
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
    kinds = elements.membranes  # written out: Numba cannot loop over tuples on the card
    s = panels_to(kinds[0], m, u, slot, size, s, who, crowd, sampled, strain)
    s = panels_to(kinds[1], m, u, slot, size, s, who, crowd, sampled, strain)
    s = panels_to(kinds[2], m, u, slot, size, s, who, crowd, sampled, strain)
    s = springs_to(
        elements.springs, m, counts.spring_group, u, slot, size, s, who, crowd, sampled, strain
    )
    power = dampers_to(elements.viscous, m, flat_u, flat_v, slot, size, s, who, crowd)
    s += 4 * elements.viscous.dofs.shape[0]
    power += damping_to(elements.damping, m, counts.damped, flat_v, slot, size, s, who, crowd)
    return wrong, power


@on_device
def sum_to(nodes, slot, size, i, out):
    """The force (3,) on a node, added up in the order of its entries."""
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
    """The load (N) on a dof."""
    total = 0.0
    for k in range(load_start[dof], load_start[dof + 1]):
        total += load[k] * factor[load_row[k], time]
    return total


@on_device
def meet(state, blocks, arrived):
    """Wait until all threads of the grid are here, for the next time; returns how often they were."""
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
def note_down(state, thread, groups, strain, kinetic, work_out, work_in):
    """What a thread knows of the energies, for the sum over its block."""
    for g in range(groups):
        state.note[thread, g] = strain[g]
    state.note[thread, groups] = kinetic
    state.note[thread, groups + 1] = work_out
    state.note[thread, groups + 2] = work_in


@on_device
def add_notes(state, row, columns):
    """Sums over the threads of a block, by its first threads."""
    first, count = cuda.blockIdx.x * cuda.blockDim.x, cuda.blockDim.x
    for c in range(cuda.threadIdx.x, columns, count):
        total = 0.0
        for k in range(count):
            total += state.note[first + k, c]
        row[cuda.blockIdx.x, c] = total


@lru_cache
def kernel(method: str, wide: bool, shared: bool) -> Callable[..., Any]:
    """The loop of a method.

    wide : whether the grid has one model, else each block has one.
    shared : whether it lives in shared memory.
    """
    runge = method == "rk4"
    stages, per_step = (4, 3) if runge else (1, 1)

    def advance(elements, nodes, counts, span, factor, state, out):
        """The steps of a span."""
        if wide:
            m, who, crowd = 0, cuda.grid(1), cuda.gridsize(1)
        else:
            m, who, crowd = cuda.blockIdx.x, cuda.threadIdx.x, cuda.blockDim.x
        blocks, thread = cuda.gridDim.x, cuda.blockIdx.x * cuda.blockDim.x + cuda.threadIdx.x
        n, size, groups = counts.nodes, counts.slots, counts.groups
        if shared:
            slot = cuda.shared.array(0, float64)
            ut, vt = rows_of(slot, 3 * size, n), rows_of(slot, 3 * size + 3 * n, n)
            flat_u, flat_v = slot[3 * size : 3 * size + 3 * n], slot[3 * size + 3 * n : 3 * size + 6 * n]
        else:
            slot, flat_u, flat_v = state.slot[m], state.ahead_u[m], state.ahead_v[m]
            ut, vt = rows_of(flat_u, 0, n), rows_of(flat_v, 0, n)
        u, v, angle = state.u[m], state.v[m], state.angle[m]
        du, dv = state.first[m], state.second[m]
        mass, inverse, alpha = at(nodes.mass, m), at(nodes.inverse, m), nodes.alpha[m]
        load_start, load, load_row = at(nodes.load_start, m), at(nodes.load, m), at(nodes.load_row, m)
        strain = cuda.local.array(MOST_GROUPS, float64)
        force = cuda.local.array(3, float64)
        arrived, sample, wrong = 0, span.sample, 0
        work_in, work_out, dt = 0.0, 0.0, span.dt
        before_in, before_out = state.power[thread, 0], state.power[thread, 1]
        for i in range(who, n, crowd):
            for c in range(3):
                ut[i, c], vt[i, c] = u[i, c], v[i, c]
        for step in range(span.first, span.last + 1):
            sampled = step == sample * span.every
            part_in, part_out, kinetic = 0.0, 0.0, 0.0
            for stage in range(stages):
                h = dt
                if not runge:  # kick and drift
                    h = dt if step > 0 else 0.0
                    for i in range(who, n, crowd):
                        for c in range(3):
                            v[i, c] += 0.5 * h * du[i, c]
                            u[i, c] += h * v[i, c]
                            ut[i, c] = u[i, c]
                            vt[i, c] = v[i, c] + 0.5 * h * du[i, c]
                first = stage == 0
                if wide:
                    arrived = meet(state, blocks, arrived)
                else:
                    cuda.syncthreads()
                looks = first and sampled
                if looks:
                    for g in range(groups):
                        strain[g] = 0.0
                jumped, power_out = forces_to(
                    elements, counts, m, ut, flat_u, flat_v, slot, angle, who, crowd, looks, first,
                    strain,
                )  # fmt: skip
                wrong += jumped
                power_in, time = 0.0, per_step * (step - span.first) + (stage + 1) // 2
                if wide:
                    arrived = meet(state, blocks, arrived)
                else:
                    cuda.syncthreads()
                ends = runge and step == span.last
                for i in range(who, n, crowd):
                    sum_to(nodes, slot, size, i, force)
                    for c in range(3):
                        dof, speed = 3 * i + c, vt[i, c]
                        pull = load_on(nodes, load_start, load, load_row, factor, time, dof)
                        left = force[c] - pull
                        power_in += pull * speed
                        power_out += alpha * mass[i] * speed * speed
                        a = -left * inverse[i, c] - alpha * speed
                        if not runge:
                            du[i, c] = a
                            v[i, c] += 0.5 * h * a
                            wrong += not abs(v[i, c]) < math.inf
                        if looks:
                            k, now = sample - span.sample, v[i, c]
                            kinetic += 0.5 * mass[i] * now * now
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
                    add_notes(state, out.energy[sample - span.sample], groups + 3)
                    sample += 1
                if ends:
                    break
                weight = 2.0 if stage == 1 or stage == 2 else 1.0
                part_in += weight * power_in
                part_out += weight * power_out
            if runge and step < span.last:
                work_in += dt / 6.0 * part_in
                work_out += dt / 6.0 * part_out
        state.power[thread, 0], state.power[thread, 1] = before_in, before_out
        cuda.syncthreads()  # the notes of a last sample are added up
        note_down(state, thread, groups, strain, 0.0, work_out, work_in)
        cuda.syncthreads()
        add_notes(state, out.energy[out.energy.shape[0] - 1], groups + 3)
        if wrong > 0:
            state.wrong[m] = 1

    return cuda.jit(advance, **({"max_registers": REGISTERS} if wide and not SIMULATED else {}))
