"""Arrays in compiled loops without reference counts.

Compiled code counts references to the arrays of every tuple that a function gets, with atomic
operations, wherever the compiler cannot prove that it need not: a third of the time of a step of a
small sheet. The caller of a loop holds the arrays for as long as it runs, so inside they can be
borrowed.
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.core import cgutils
from numba.core.imputils import impl_ret_untracked
from numba.extending import intrinsic
from numba.np.arrayobj import make_array


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
def _borrowed(typing_context, value):
    """Return an array or a tuple of arrays, of tuples, of numbers, that owns no memory."""

    def codegen(context, builder, signature, arguments):
        (kind,) = signature.args
        out = _without_owner(context, builder, kind, arguments[0])
        return impl_ret_untracked(context, builder, signature.return_type, out)

    return value(value), codegen


borrowed: Any = _borrowed  # called with one argument less than written, as `flat`
