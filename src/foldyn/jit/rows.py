"""Eight rows of coordinates at once in compiled code: load and transpose, transpose and add.

Nodal arrays of the force kernels have rows of four numbers, the fourth unused, so that a row is one
vector. Shuffles in registers turn eight rows into three vectors of eight lanes: x, y and z. Loading
one number at a time takes twice as long, and hardware gathers are no faster than that. The vectors
are LLVM's own: they run on any processor, split into narrower registers if it has no wide
registers.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types

from foldyn.jit.intrinsics import DOUBLE, INT32, INT64, data_of, intrinsic

LANES = 8
ROW = ir.VectorType(DOUBLE, 4)
COLUMN = ir.VectorType(DOUBLE, LANES)
EVEN, ODD = (0, 8, 2, 10, 4, 12, 6, 14), (1, 9, 3, 11, 5, 13, 7, 15)  # lanes of two columns


def _shuffle(builder, a, b, places):
    kind = ir.VectorType(INT32, len(places))
    return builder.shuffle_vector(a, b, ir.Constant(kind, list(places)))


def _vector_at(builder, data, index, kind):
    return builder.bitcast(builder.gep(data, [index]), kind.as_pointer())


def _load(builder, pointer):
    value = builder.load(pointer)
    value.align = 8
    return value


def _store(builder, value, pointer):
    builder.store(value, pointer).align = 8


def _row_pointers(context, builder, kinds, values):
    """Pointers to eight rows, with the indices nodes[start + step q] & mask, q = 0..7."""
    (rows, nodes), (row_values, node_values, start, step, mask) = kinds, values
    row_data = data_of(context, builder, rows, row_values)
    node_data = data_of(context, builder, nodes, node_values)
    pointers = []
    for lane in range(LANES):
        index = builder.add(start, builder.mul(step, INT64(lane)))
        node = builder.zext(builder.load(builder.gep(node_data, [index])), INT64)
        at = builder.shl(builder.and_(node, mask), INT64(2))
        pointers.append(_vector_at(builder, row_data, at, ROW))
    return pointers


def _columns_at(builder, data, at, stride):
    return [
        _vector_at(builder, data, builder.add(at, builder.mul(stride, INT64(c))), COLUMN)
        for c in range(3)
    ]


@intrinsic
def load_rows(typing_context, rows, nodes, start, step, mask, out, at, stride):
    """Write coordinate c = 0..2 of eight nodes to out[at + c stride :][:8]; see `_row_pointers`."""
    i8 = types.int64

    def codegen(context, builder, signature, arguments):
        pointers = _row_pointers(context, builder, (rows, nodes), arguments[:5])
        r = [_load(builder, pointer) for pointer in pointers]
        a, b, c, d = (
            _shuffle(builder, r[i], r[j], range(8)) for i, j in ((0, 2), (1, 3), (4, 6), (5, 7))
        )
        xz, uw = _shuffle(builder, a, b, EVEN), _shuffle(builder, c, d, EVEN)
        y, v = _shuffle(builder, a, b, ODD), _shuffle(builder, c, d, ODD)
        low, high = (0, 1, 4, 5, 8, 9, 12, 13), (2, 3, 6, 7, 10, 11, 14, 15)
        columns = (
            _shuffle(builder, xz, uw, low),
            _shuffle(builder, y, v, low),
            _shuffle(builder, xz, uw, high),
        )
        data = data_of(context, builder, out, arguments[5])
        for value, pointer in zip(columns, _columns_at(builder, data, *arguments[6:]), strict=True):
            _store(builder, value, pointer)
        return context.get_dummy_value()

    return types.void(rows, nodes, i8, i8, i8, out, i8, i8), codegen


@intrinsic
def add_rows(typing_context, rows, nodes, start, step, mask, columns, at, stride, factor, lane):
    """Add factor[lane + q] columns[at + c stride + q] to coordinate c of node q, q = 0..7."""
    i8 = types.int64

    def codegen(context, builder, signature, arguments):
        pointers = _row_pointers(context, builder, (rows, nodes), arguments[:5])
        data = data_of(context, builder, columns, arguments[5])
        scale = data_of(context, builder, factor, arguments[8])
        scale = _load(builder, _vector_at(builder, scale, arguments[9], COLUMN))
        x, y, z = (
            builder.fmul(scale, _load(builder, pointer))
            for pointer in _columns_at(builder, data, *arguments[6:8])
        )
        zero = ir.Constant(COLUMN, [0.0] * LANES)
        front, back = (0, 1, 8, 9, 2, 3, 10, 11), (4, 5, 12, 13, 6, 7, 14, 15)
        r: list[Any] = [None] * LANES
        for parity, places in enumerate((EVEN, ODD)):
            xy, z0 = _shuffle(builder, x, y, places), _shuffle(builder, z, zero, places)
            for base, half in ((0, front), (4, back)):
                two = _shuffle(builder, xy, z0, half)
                r[base + parity] = _shuffle(builder, two, two, range(4))
                r[base + parity + 2] = _shuffle(builder, two, two, range(4, 8))
        for pointer, value in zip(pointers, r, strict=True):
            _store(builder, builder.fadd(_load(builder, pointer), value), pointer)
        return context.get_dummy_value()

    return types.void(rows, nodes, i8, i8, i8, columns, i8, i8, factor, i8), codegen
