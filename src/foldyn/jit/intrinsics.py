"""Numba intrinsics: addresses, views and memory operations below Python.

The typing context is the first parameter in the definition of an intrinsic; calls in compiled code
omit it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import extending, types
from numba.core import cgutils
from numba.core.imputils import impl_ret_borrowed, impl_ret_untracked
from numba.np.arrayobj import make_array, populate_array

from foldyn.jit.compiled import inner_scalar

LINE = 64  # bytes of a cache line
INT32, INT64, DOUBLE = ir.IntType(32), ir.IntType(64), ir.DoubleType()


def intrinsic(function: Callable[..., Any]) -> Any:
    """Numba's `intrinsic`, typed so that type checkers accept calls without the typing context."""
    return extending.intrinsic(function)


def data_of(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    """Pointer to the first element of an array."""
    return make_array(kind)(context, builder, array).data


# ------------------------------------------------------------------ functions by their address
# the address is data, so one cached kernel serves all laws that it calls by address
def _caller(result, *parameters):
    def codegen(context, builder, signature, arguments):
        kind = ir.FunctionType(result, parameters)
        return builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), arguments[1:])

    return codegen


@intrinsic
def call0(typing_context, address):
    """Call the function int32() at `address`."""
    return types.int32(types.int64), _caller(INT32)


@intrinsic
def call1(typing_context, address, x):
    """Value of the function float64(float64) at `address`."""
    return types.float64(types.int64, types.float64), _caller(DOUBLE, DOUBLE)


@intrinsic
def call2(typing_context, address, x, y):
    """Value of the function float64(float64, float64) at `address`."""
    kinds = types.int64, types.float64, types.float64
    return types.float64(*kinds), _caller(DOUBLE, DOUBLE, DOUBLE)


# ------------------------------------------------------------------ views of arrays
@intrinsic
def flat(typing_context, array):
    """One-dimensional view of a C-contiguous array.

    `reshape(-1)` calls a run-time function of some 30 ns, which matters if a step takes 5000 ns.
    """
    if not isinstance(array, types.Array) or array.layout != "C":
        return None
    view = types.Array(array.dtype, 1, "C", readonly=not array.mutable, aligned=array.aligned)

    def codegen(context, builder, signature, arguments):
        source = make_array(array)(context, builder, arguments[0])
        out = make_array(view)(context, builder)
        populate_array(
            out,
            data=source.data,
            shape=[source.nitems],
            strides=[source.itemsize],
            itemsize=source.itemsize,
            meminfo=source.meminfo,
            parent=source.parent,
        )
        return impl_ret_borrowed(context, builder, view, out._getvalue())

    return view(array), codegen


def _without_owner(context, builder, kind, value):
    if isinstance(kind, types.Array):
        array = make_array(kind)(context, builder, value)
        array.meminfo = cgutils.get_null_value(array.meminfo.type)
        array.parent = cgutils.get_null_value(array.parent.type)
        return array._getvalue()
    if isinstance(kind, types.BaseTuple):
        for i, item in enumerate(kind.types):  # type: ignore[attr-defined]
            part = builder.extract_value(value, i)
            part = _without_owner(context, builder, item, part)
            value = builder.insert_value(value, part, i)
    return value


@intrinsic
def borrowed(typing_context, value):
    """An array, or a tuple of arrays, tuples and numbers, without reference counts.

    Unless the compiler proves it unnecessary, compiled code counts references to the arrays of
    every tuple that a function receives, with atomic operations. These take a third of the time of
    a step of a small sheet. The caller of a loop keeps the arrays alive while it runs, so the loop
    can borrow them.
    """

    def codegen(context, builder, signature, arguments):
        (kind,) = signature.args
        out = _without_owner(context, builder, kind, arguments[0])
        return impl_ret_untracked(context, builder, signature.return_type, out)

    return value(value), codegen


# ------------------------------------------------------------------ memory ahead of its use
# The processor prefetches by itself if a loop reads one array from start to end, but not if a
# kernel reads a little of each of many arrays in turn.
@intrinsic
def prefetch(typing_context, array, index):
    """Prefetch array[index] into the cache; an index beyond the end does no harm."""

    def codegen(context, builder, signature, arguments):
        data = data_of(context, builder, array, arguments[0])
        place = builder.bitcast(builder.gep(data, [arguments[1]]), cgutils.voidptr_t)
        kind = ir.FunctionType(ir.VoidType(), [cgutils.voidptr_t, INT32, INT32, INT32])
        function = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0i8")
        read, keep, data_cache = INT32(0), INT32(3), INT32(1)
        builder.call(function, [place, read, keep, data_cache])
        return context.get_dummy_value()

    return types.void(array, index), codegen


@inner_scalar
def prefetch_range(array, first, count):
    """Prefetch array[first : first + count] into the cache."""
    for k in range(first, first + count, LINE // array.itemsize):
        prefetch(array, k)


# ------------------------------------------------------------------ memory that threads share
@intrinsic
def fetch_add(typing_context, array, index, value):
    """array[index] += value atomically; returns the previous value."""

    def codegen(context, builder, signature, arguments):
        place = builder.gep(data_of(context, builder, array, arguments[0]), [arguments[1]])
        return builder.atomic_rmw("add", place, arguments[2], "acq_rel")

    return types.int64(array, types.int64, types.int64), codegen


@intrinsic
def look(typing_context, array, index):
    """array[index] as last written by a thread; earlier writes of that thread are visible, too."""

    def codegen(context, builder, signature, arguments):
        place = builder.gep(data_of(context, builder, array, arguments[0]), [arguments[1]])
        return builder.load_atomic(place, "acquire", 8)

    return types.int64(array, types.int64), codegen
