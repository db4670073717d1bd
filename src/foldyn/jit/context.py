"""Tuples of arrays, passed to compiled functions as one address.

A context is an array of slots of eight bytes, one for each number, address, length and stride of a
(nested) named tuple. Python fills it, so nothing is compiled for that. A kernel accesses the fields
of a context by the names in the tuple. A field is loaded on access, so unused fields cost neither
time nor code, and a nested tuple is passed on as an address. No references are counted: the
`Context` object keeps all arrays alive.

Only the type of a context, `ContextType`, knows the layout; its `types` give the kernel cache
(`jit.kernel_cache`) all fields of the tuple.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from llvmlite import ir
from numba import typeof, types
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import NativeValue, models, register_model, unbox
from numba.np.arrayobj import make_array, populate_array

from foldyn.jit.intrinsics import DOUBLE, INT64, data_of, intrinsic


class ContextType(types.Type):
    """Type of the address of a tuple."""

    def __init__(self, kind: types.Type) -> None:
        self.types = (kind,)
        super().__init__(f"Context({kind})")


@register_model(ContextType)
class _Address(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, INT64)


class Context:
    """A tuple at an address, for compiled functions; it keeps the arrays alive.

    Numbers in the tuple are copied. Arrays and records are shared, and may change in place.

    Parameters
    ----------
    value : tuple
        Named tuples within named tuples, arrays, records, numbers.

    Attributes
    ----------
    value : tuple
        The given tuple.
    kind : ContextType
    slots : (k,) array of int
        What is at the address; it is valid as long as the arrays are alive.
    address : int
    """

    def __init__(self, value: tuple) -> None:
        slots: list[int] = []
        looks = _fill(value, slots)
        if looks not in _KINDS:  # Numba takes ms to find the type of a large tuple
            _KINDS[looks] = ContextType(typeof(value))
        self.value: Any = value
        self.slots = np.array(slots, np.int64)
        self.kind, self.address = _KINDS[looks], int(self.slots.ctypes.data)
        self._numba_type_ = self.kind


_KINDS: dict[tuple, ContextType] = {}  # types of contexts, by the result of `_fill`


@unbox(ContextType)
def _from_python(kind: Any, held: Any, c: Any) -> NativeValue:
    number = c.pyapi.object_getattr_string(held, "address")
    address = c.pyapi.number_as_ssize_t(number)
    c.pyapi.decref(number)
    return NativeValue(address)


def _fill(value: Any, slots: list[int]) -> tuple:
    """Fill the slots of a value; returns a key that determines its type."""
    if isinstance(value, tuple):
        return type(value), *(_fill(item, slots) for item in value)
    if isinstance(value, np.ndarray):
        slots += value.ctypes.data, *value.shape, *value.strides
        return value.dtype.num, value.ndim, value.flags.num
    if isinstance(value, np.void):
        slots.append(np.frombuffer(value.data, np.uint8).ctypes.data)
        return (value.dtype,)
    if isinstance(value, float):
        slots.append(int(np.float64(value).view(np.int64)))
        return (float,)
    if isinstance(value, bool | np.bool_ | int | np.integer):
        slots.append(int(value))
        return (type(value),)
    raise TypeError(f"{type(value).__name__} has no place in a context")


def _array(context: Any, builder: Any, kind: Any, numbers: Sequence[Any]) -> Any:
    """View of the array with a given address, lengths and strides."""
    out = make_array(kind)(context, builder)
    populate_array(
        out,
        data=builder.inttoptr(numbers[0], out.data.type),
        shape=numbers[1 : 1 + kind.ndim],
        strides=numbers[1 + kind.ndim :],
        itemsize=INT64(context.get_abi_sizeof(context.get_data_type(kind.dtype))),
        meminfo=None,
    )
    return out._getvalue()


def _width(kind: Any) -> int:
    """Number of slots of a value of a type."""
    if isinstance(kind, types.BaseTuple):
        return sum(map(_width, kind.types))  # type: ignore[attr-defined]
    return 1 + 2 * kind.ndim if isinstance(kind, types.Array) else 1


@infer_getattr
class _Fields(AttributeTemplate):
    key = ContextType

    def generic_resolve(self, typ: Any, attr: str) -> Any:
        """Type of a field; a nested tuple is a context of its own."""
        (kind,) = typ.types
        if attr not in kind.fields:
            return None
        found = kind.types[kind.fields.index(attr)]
        return ContextType(found) if isinstance(found, types.BaseTuple) else found


@lower_getattr_generic(ContextType)
def _field(context: Any, builder: Any, owner: Any, address: Any, name: str) -> Any:
    """Value of a field; compiled code may load it just once, because nothing writes to slots."""
    (fields,) = owner.types
    place = fields.fields.index(name)
    kind, first = fields.types[place], 8 * sum(map(_width, fields.types[:place]))
    address = builder.add(address, INT64(first))
    if isinstance(kind, types.BaseTuple):
        return address
    slots = []
    for k in range(_width(kind)):
        slot = builder.gep(builder.inttoptr(address, INT64.as_pointer()), [INT64(k)])
        slots.append(builder.load(slot))
        slots[-1].set_metadata("invariant.load", builder.module.add_metadata([]))
    if isinstance(kind, types.Array):
        return _array(context, builder, kind, slots)
    wanted = context.get_value_type(kind)
    if isinstance(kind, types.Record):
        return builder.inttoptr(slots[0], wanted)
    if isinstance(kind, types.Float):
        return builder.bitcast(slots[0], DOUBLE)
    return slots[0] if wanted == INT64 else builder.trunc(slots[0], wanted)


# ------------------------------------------------------------------ arrays by address
def _at(kind: types.Array) -> Callable[..., Any]:
    def codegen(context, builder, signature, arguments):
        numbers = [arguments[0], arguments[1], INT64(8)]
        if kind.ndim == 2:
            numbers = [*arguments, INT64(3), INT64(24), INT64(8)]
        return _array(context, builder, kind, numbers)

    return codegen


@intrinsic
def rows_at(typing_context, address, count):
    """Array (count, 3) at an address."""
    kind = types.Array(types.float64, 2, "C")
    return kind(types.int64, types.int64), _at(kind)


@intrinsic
def numbers_at(typing_context, address, count):
    """Array (count,) at an address."""
    kind = types.Array(types.float64, 1, "C")
    return kind(types.int64, types.int64), _at(kind)


# ------------------------------------------------------------------ calls by address
def _call(result: Any, kinds: Any) -> Callable[..., Any]:
    def codegen(context, builder, signature, arguments):
        passed = [builder.extract_value(arguments[1], k) for k in range(len(kinds))]
        for k, kind in enumerate(kinds):
            if isinstance(kind, types.Array):
                passed[k] = builder.ptrtoint(data_of(context, builder, kind, passed[k]), INT64)
        kind = ir.FunctionType(result, [value.type for value in passed])
        found = builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), passed)
        return context.get_dummy_value() if isinstance(result, ir.VoidType) else found

    return codegen


@intrinsic
def run_at(typing_context, address, arguments):
    """Call the function at an address with a tuple of numbers and of addresses of arrays."""
    return types.void(types.int64, arguments), _call(ir.VoidType(), arguments.types)


@intrinsic
def value_at(typing_context, address, arguments):
    """Value (float64) of the function at an address; see `run_at`."""
    return types.float64(types.int64, arguments), _call(DOUBLE, arguments.types)
