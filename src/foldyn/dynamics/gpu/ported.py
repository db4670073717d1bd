"""Device functions ported from the CPU functions: the same formulas, compiled for the GPU.

Parts that only run on a CPU are replaced: `choose` for vectors, the initial guess of a cube root
from the bits of a number, and calls by address, which user laws need.
"""

from __future__ import annotations

import dis
import math
from collections.abc import Callable
from types import FunctionType, ModuleType
from typing import Any

import numpy as np
from numba import config
from numba import cuda as _cuda

from foldyn.jit import eights, intrinsics

cuda: Any = _cuda  # its types are unknown to type checkers
SIMULATED: bool = config.ENABLE_CUDASIM  # type: ignore[attr-defined]


def _choose(condition, one, other):
    return one if condition else other


def _per_cube_root(x):
    return x ** (-1.0 / 3.0) if SIMULATED else cuda.libdevice.rcbrt(x)


def _cube_root(x):
    return math.copysign(abs(x) ** (1.0 / 3.0), x) if SIMULATED else cuda.libdevice.cbrt(x)


def on_device(function: Callable[..., Any]) -> Any:
    """Compile a function for the GPU; the simulator calls it unchanged."""
    return function if SIMULATED else cuda.jit(device=True)(function)


@on_device
def _call1(address, x):
    return math.nan


@on_device
def _call2(address, x, y):
    return math.nan


_made: dict[Any, Any] = {
    eights.choose: on_device(_choose),
    eights.per_cube_root: on_device(_per_cube_root),
    intrinsics.call1: _call1,
    intrinsics.call2: _call2,
    np.cbrt: on_device(_cube_root),
}


def ported(function: Any) -> Any:
    """GPU version of a function that is compiled for the CPU."""
    if function not in _made:
        source = function.py_func
        code = list(dis.get_instructions(source))
        read = {step.argval for step in code if step.opname == "LOAD_GLOBAL"}
        asked = {step.argval for step in code if step.opname in ("LOAD_ATTR", "LOAD_METHOD")}
        given = source.__globals__.items()
        known = {name: _replaced(value, asked) for name, value in given if name in read}
        made = FunctionType(source.__code__, known, source.__name__, source.__defaults__)
        made.__module__ = source.__module__
        _made[function] = on_device(made)
    return _made[function]


def _replaced(value: Any, names: set[str]) -> Any:
    """GPU replacement for a value that the CPU function uses."""
    if isinstance(value, ModuleType):
        if value is not np and not value.__name__.startswith("foldyn"):
            return value
        out = ModuleType(value.__name__)
        for name in names:
            if hasattr(value, name):
                setattr(out, name, _replaced(getattr(value, name), names))
        return out
    known = value in _made if callable(value) else False
    return ported(value) if known or hasattr(value, "py_func") else value
