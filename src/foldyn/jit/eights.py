"""Eight numbers in a row as one vector, in compiled code: copy, and multiply and add.

Number by number the compiler cannot know that what is written is not what is read next. The vectors
are LLVM's own: they run on any processor, in narrower registers where it has no wide ones.
"""

from __future__ import annotations

from llvmlite import ir
from numba import types

from foldyn.jit.intrinsics import DOUBLE, data_of, intrinsic

EIGHT = ir.VectorType(DOUBLE, 8)


def _pointer(context, builder, kind, array, at):
    data = data_of(context, builder, kind, array)
    return builder.bitcast(builder.gep(data, [at]), EIGHT.as_pointer())


def _load(builder, pointer):
    value = builder.load(pointer)
    value.align = 8
    return value


@intrinsic
def take_eight(typing_context, source, at, out, place):
    """out[place :][:8] = source[at :][:8]."""
    i8 = types.int64

    def codegen(context, builder, signature, arguments):
        source_array, at, out_array, place = arguments
        value = _load(builder, _pointer(context, builder, source, source_array, at))
        builder.store(value, _pointer(context, builder, out, out_array, place)).align = 8
        return context.get_dummy_value()

    return types.void(source, i8, out, i8), codegen


@intrinsic
def add_eight(typing_context, out, place, value, at, g, row):
    """out[place :][:8] += value[at :][:8] * g[row :][:8]."""
    i8 = types.int64

    def codegen(context, builder, signature, arguments):
        out_array, place, value_array, at, g_array, row = arguments
        target = _pointer(context, builder, out, out_array, place)
        factor = _load(builder, _pointer(context, builder, value, value_array, at))
        other = _load(builder, _pointer(context, builder, g, g_array, row))
        product = builder.fmul(factor, other, flags=("contract",))
        total = builder.fadd(_load(builder, target), product, flags=("contract",))
        builder.store(total, target).align = 8
        return context.get_dummy_value()

    return types.void(out, i8, value, i8, g, i8), codegen
