"""Elements on the GPU: each thread handles some elements and writes corner forces to slots.

Elements and slots belong to one model; arrays of several models have a leading model axis.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from foldyn.dynamics.gpu.ported import SIMULATED, on_device, ported
from foldyn.materials import series, switch
from foldyn.mechanics import energy, lines, springs
from foldyn.mechanics.lines import Lines
from foldyn.mechanics.membranes import Membranes
from foldyn.mechanics.model import BarsHinges
from foldyn.mechanics.springs import Springs
from foldyn.mechanics.viscous import Viscous

bar_extension, hinge_dihedral = ported(energy.bar_extension), ported(energy.hinge_dihedral)
bar_energy, bar_stress = ported(switch.bar_energy), ported(switch.bar_stress)
series_energy, series_moment = ported(series.series_energy), ported(series.series_moment)
directed_extension = ported(springs.directed_extension)
piece, extension = ported(lines.piece), ported(lines.extension)
along = ported(lines.along)
strength, idle, per_length = ported(lines.strength), ported(lines.idle), ported(lines.per_length)
response = ported(lines.response)


class Counts(NamedTuple):
    """Numbers of elements, nodes and slots."""

    nodes: int  # rows of three: the nodes, then dofs without mass
    slots: int  # number of slots, each for a force vector
    groups: int  # number of strain energy groups
    spring_group: int
    damped: int  # rows of the damping matrix: all nodes, or 0
    hidden: int  # dofs in the rows after those of nodes, with padding
    more: int  # further numbers after the slots, for plates


class Damping(NamedTuple):
    """A constant damping matrix over the dofs, in CSR format."""

    start: Any
    column: Any
    value: Any  # (m, k)


class Elements(NamedTuple):
    """The elements of m models; arrays have a leading axis of m, or of 1 if all are equal."""

    model: BarsHinges
    bar_code: Any  # (nb,) law code of each bar
    hinge_code: Any  # (nh,) law code of each hinge
    membranes: tuple[Membranes, ...]
    springs: Springs
    viscous: Viscous
    damping: Damping
    plates: Any  # `plates.Plates`, or () without


if SIMULATED:

    def rows_of(array, first, rows):  # type: ignore[no-redef]
        """Rows of three numbers, beginning at a place in a flat array."""
        return array[first : first + 3 * rows].reshape(rows, 3)

    def at(array, m):  # type: ignore[no-redef]
        """Array of model m, or the array that all models share."""
        return array[m if array.shape[0] > 1 else 0]

else:
    from numba import types
    from numba.cuda import cgutils, extending  # type: ignore[attr-defined]
    from numba.cuda.np.arrayobj import make_array, populate_array  # type: ignore[import-not-found]

    intrinsic: Any = extending.intrinsic

    @intrinsic
    def rows_of(typing_context, array, first, rows):
        """Intrinsic version of `rows_of`, as NumPy's reshape would call the run-time library."""
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
        """Intrinsic version of `at`, as a device function may not return an array."""
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
    """Write a force vector to slot s."""
    slot[s], slot[size + s], slot[2 * size + s] = x, y, z


@on_device
def bars_to(own, code, u, slot, size, who, crowd, sampled, strain):
    """Write the bar forces at the second ends; add the energies at a sample."""
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
    """Write hinge forces; return the number of hinges that have passed 0 or 360 degrees."""
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
def springs_to(all_springs, m, group, u, slot, size, at_slot, who, crowd, sampled, strain):
    """Write spring forces, directed springs only at the first end; return the next free slot."""
    every = all_springs.lines
    own = Springs(
        all_springs.ends, at(all_springs.direction, m), at(all_springs.stiffness, m),
        all_springs.row, at(all_springs.now, m),
        Lines(
            every.first, every.node, at(every.vector, m), at(every.length, m),
            at(every.natural, m), at(every.stretch, m), at(every.stiffness, m), every.slack,
            every.scaled, at(every.change, m), every.code, every.addresses, every.row,
            at(every.now, m),
        ),
    )  # fmt: skip
    line, directed, count = own.lines, own.ends.shape[0], own.lines.stiffness.shape[0]
    for s in range(who, directed, crowd):
        moved = directed_extension(own, u, s)
        pull = own.stiffness[s] * moved
        put(
            slot, size, at_slot + s, pull * own.direction[s, 0], pull * own.direction[s, 1],
            pull * own.direction[s, 2],
        )  # fmt: skip
        if sampled:
            strain[group] += 0.5 * pull * moved
    for s in range(who, count, crowd):
        beyond, stiff = extension(line, u, s, 0.0), strength(line, s, 0.0)
        if idle(line, s, beyond):
            beyond = 0.0
        stored, reach, _ = response(line, s, beyond)
        for i in range(line.first[s], line.first[s + 1] - 1):
            pull = per_length(line, s, stiff * reach, piece(line, u, i)[1])
            put(
                slot, size, at_slot + directed + i - s,  # a line has a piece less than points
                pull * along(line, u, i, 0),
                pull * along(line, u, i, 1),
                pull * along(line, u, i, 2),
            )  # fmt: skip
        if sampled:
            strain[group] += stiff * stored
    return at_slot + directed + line.node.shape[0] - count


@on_device
def damping_to(damping, m, nodes, v, slot, size, at_slot, who, crowd):
    """Write forces of a constant damping matrix; return the dissipated power, W."""
    value, power = at(damping.value, m), 0.0
    for i in range(who, nodes, crowd):
        for c in range(3):
            resisted, row = 0.0, 3 * i + c
            for k in range(damping.start[row], damping.start[row + 1]):
                resisted += value[k] * v[damping.column[k]]
            slot[c * size + at_slot + i] = resisted
            power += resisted * v[row]
    return power
