"""Ask for memory ahead of its use, in compiled code.

The processor guesses what is read next where a loop reads on and on; kernels that read a little of
many arrays in turn leave it behind.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

from foldyn.jit.compiled import scalar

LINE = 64  # bytes that come into the cache together


@intrinsic
def _prefetch(typing_context, array, index):
    """Bring array[index] into the cache; an index beyond the end does no harm."""

    def codegen(context, builder, signature, arguments):
        data = make_array(array)(context, builder, arguments[0]).data
        place = builder.bitcast(builder.gep(data, [arguments[1]]), cgutils.voidptr_t)
        flag = ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [cgutils.voidptr_t, flag, flag, flag])
        function = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0i8")
        read, keep, data_cache = flag(0), flag(3), flag(1)
        builder.call(function, [place, read, keep, data_cache])
        return context.get_dummy_value()

    return types.void(array, index), codegen


prefetch: Any = _prefetch  # called with one argument less than written: Numba adds the context


@scalar
def prefetch_range(array, first, count):
    """Bring array[first : first + count] into the cache."""
    for k in range(first, first + count, LINE // array.itemsize):
        prefetch(array, k)
