"""The GPU: its name and its free memory."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import config

from foldyn.errors import InputError

SHARED = 48 * 1024  # shared memory per block, bytes
GIB = 2.0**30


def name() -> str:
    """Name of the GPU."""
    if config.ENABLE_CUDASIM:  # type: ignore[attr-defined]
        return "simulator"
    from numba import cuda

    found: Any = cuda.get_current_device().name
    return found.decode() if isinstance(found, bytes) else str(found)


def free_memory() -> float:
    """Free memory of the GPU, bytes."""
    if config.ENABLE_CUDASIM:  # type: ignore[attr-defined]
        return GIB
    from numba import cuda

    return float(cuda.current_context().get_memory_info()[0])


def check_size(needed: float, what: str) -> None:
    """Refuse a case that needs more than the free GPU memory; `needed` is in bytes."""
    free = free_memory()
    if needed > free:
        raise InputError(
            f' = "gpu": {what} needs {needed / GIB:.3g} GiB on the card, which has '
            f'{free / GIB:.3g} GiB free; use device = "cpu"',
            "device",
        )


def size_of(values: Any) -> int:
    """Bytes of all arrays in nested tuples."""
    if isinstance(values, np.ndarray):
        return values.nbytes
    return sum(map(size_of, values)) if isinstance(values, tuple) else 0


def flat_strides(array: np.ndarray) -> np.ndarray:
    """A contiguous array whose strides are contiguous too, even along axes of length one.

    An axis made by `None` has stride 0, and Numba processes such arrays row by row.
    """
    return np.ascontiguousarray(array).reshape(-1).reshape(array.shape)


def put(values: Any) -> Any:
    """Copy nested tuples of arrays to the GPU."""
    from numba import cuda

    if isinstance(values, np.ndarray):
        return cuda.to_device(flat_strides(values))
    if isinstance(values, tuple):
        made = [put(value) for value in values]
        return type(values)(*made) if hasattr(values, "_fields") else tuple(made)
    return values
