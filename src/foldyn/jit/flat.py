"""A contiguous array as a flat one, in compiled code, without a call.

`reshape(-1)` calls a run-time function of some 30 ns, which counts where a step takes 5000.
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.core.imputils import impl_ret_borrowed
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array


@intrinsic
def _flat(typing_context, array):
    """View of a C-contiguous array with one dimension."""
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


flat: Any = _flat  # called with one argument less than written: Numba adds the typing context
