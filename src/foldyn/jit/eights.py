"""Eight numbers as one value in compiled code, with the arithmetic of a single number.

Formulas without branches accept such values in place of numbers: `+ - * /`, comparisons, `abs`,
`math.sqrt`, `choose`. The vectors are LLVM's own: they run on any processor, split into narrower
registers if it has no wide registers. In loops over single numbers, the compiler would have to
vectorize by itself, and it does not if a write might change what is read later.
"""

from __future__ import annotations

import math
import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_builtin, lower_cast
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import models, register_model

from foldyn.jit.intrinsics import DOUBLE, INT64, data_of, intrinsic

COUNT = 8
VECTOR, BITS = ir.VectorType(DOUBLE, COUNT), ir.VectorType(ir.IntType(1), COUNT)


class Eight(types.Type):
    """Type of eight numbers."""


class Truths(types.Type):
    """Type of eight truth values, the result of comparisons."""


EIGHT, TRUTHS = Eight("eight"), Truths("truths")


@register_model(Eight)
class _EightModel(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, VECTOR)


@register_model(Truths)
class _TruthsModel(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, BITS)


@lower_cast(types.Float, Eight)
def _spread(context, builder, source, target, value):
    one = builder.insert_element(ir.Constant(VECTOR, ir.Undefined), value, ir.IntType(32)(0))
    everywhere = ir.Constant(ir.VectorType(ir.IntType(32), COUNT), [0] * COUNT)
    return builder.shuffle_vector(one, ir.Constant(VECTOR, ir.Undefined), everywhere)


# ------------------------------------------------------------------ arithmetic
template: Any = infer_global


def _define(function: Any, count: int, result: types.Type, build: Any) -> None:
    """Implement a function for eights, or for eights and numbers."""

    @template(function)
    class _Template(AbstractTemplate):
        def generic(self, args, kws):
            known = all(isinstance(kind, Eight | types.Float) for kind in args)
            if len(args) == count and known and EIGHT in args:
                return signature(result, *[EIGHT] * count)
            return None

    @lower_builtin(function, *[EIGHT] * count)
    def _lower(context, builder, signature, arguments):
        return build(builder, *arguments)


def _of_llvm(name: str) -> Any:
    def build(builder, value):
        kind = ir.FunctionType(VECTOR, [VECTOR])
        function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v8f64")
        return builder.call(function, [value])

    return build


def _compared(sign: str) -> Any:
    return lambda builder, one, other: builder.fcmp_ordered(sign, one, other)


_define(operator.add, 2, EIGHT, ir.IRBuilder.fadd)
_define(operator.sub, 2, EIGHT, ir.IRBuilder.fsub)
_define(operator.mul, 2, EIGHT, ir.IRBuilder.fmul)
_define(operator.truediv, 2, EIGHT, ir.IRBuilder.fdiv)
_define(operator.neg, 1, EIGHT, ir.IRBuilder.fneg)
_define(operator.gt, 2, TRUTHS, _compared(">"))
_define(operator.lt, 2, TRUTHS, _compared("<"))
_define(math.sqrt, 1, EIGHT, _of_llvm("sqrt"))
_define(abs, 1, EIGHT, _of_llvm("fabs"))


@intrinsic
def choose(typing_context, condition, one, other):
    """`one` if the condition holds, else `other`: for eights, or for numbers without a branch."""
    kind = EIGHT if isinstance(condition, Truths) else types.float64

    def codegen(context, builder, signature, arguments):
        return builder.select(*arguments)

    return kind(condition, kind, kind), codegen


@intrinsic
def any_of(typing_context, truths):
    """Whether any of eight truth values is true."""

    def codegen(context, builder, signature, arguments):
        bits = builder.bitcast(arguments[0], ir.IntType(COUNT))
        return builder.icmp_unsigned("!=", bits, ir.IntType(COUNT)(0))

    return types.boolean(truths), codegen


@intrinsic
def per_cube_root(typing_context, x):
    """Estimate x^(-1/3) of an eight or a number from its upper bits, with an error of 3 %."""
    many = isinstance(x, Eight)

    def codegen(context, builder, signature, arguments):
        kind = ir.VectorType(INT64, COUNT) if many else INT64

        def same(number):
            return ir.Constant(kind, [number] * COUNT if many else number)

        high = builder.ashr(builder.bitcast(arguments[0], kind), same(32))
        third = builder.ashr(builder.mul(high, same(0x55555556)), same(32))
        guess = builder.shl(builder.sub(same(0x553EF0FF), third), same(32))
        return builder.bitcast(guess, VECTOR if many else DOUBLE)

    kind = EIGHT if many else types.float64
    return kind(kind), codegen


# ------------------------------------------------------------------ in arrays
def _pointer(context, builder, kind, array, at):
    data = data_of(context, builder, kind, array)
    return builder.bitcast(builder.gep(data, [at]), VECTOR.as_pointer())


@intrinsic
def eight(typing_context, array, at):
    """array[at :][:8]."""

    def codegen(context, builder, signature, arguments):
        value = builder.load(_pointer(context, builder, array, *arguments))
        value.align = 8
        return value

    return EIGHT(array, types.int64), codegen


@intrinsic
def put(typing_context, array, at, value):
    """array[at :][:8] = value."""

    def codegen(context, builder, signature, arguments):
        *place, number = arguments
        builder.store(number, _pointer(context, builder, array, *place)).align = 8
        return context.get_dummy_value()

    return types.void(array, types.int64, EIGHT), codegen
