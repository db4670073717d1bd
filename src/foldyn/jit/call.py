"""Call a compiled function by its address, from compiled code.

The address is data, so the calling kernel stays one and the same cached kernel for every law.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


def _caller(arity: int):
    def codegen(context, builder, signature, arguments):
        kind = ir.FunctionType(ir.DoubleType(), [ir.DoubleType()] * arity)
        pointer = builder.inttoptr(arguments[0], kind.as_pointer())
        return builder.call(pointer, arguments[1:])

    return codegen


@intrinsic
def _call1(typing_context, address, x):
    """Value of the function float64(float64) at `address`."""
    return types.float64(types.int64, types.float64), _caller(1)


@intrinsic
def _call2(typing_context, address, x, y):
    """Value of the function float64(float64, float64) at `address`."""
    return types.float64(types.int64, types.float64, types.float64), _caller(2)


# callable with one argument less than written: Numba adds the typing context
call1: Any = _call1
call2: Any = _call2
