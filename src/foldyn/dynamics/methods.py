"""The registry of integrators."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

from foldyn.cases import Case
from foldyn.dynamics import central_difference, dormand_prince, rk4
from foldyn.dynamics.engine import Compiled, Engine, threads_of
from foldyn.dynamics.stability import Growth
from foldyn.dynamics.system import Packed
from foldyn.errors import InputError


class Method(NamedTuple):
    """An explicit integrator.

    `advance` is a compiled function with the arguments of `rk4.advance`, `growth(omega, damping,
    dt)` the largest factor by which a step multiplies a free vibration, `order` what tests hold it
    to, and `adaptive` whether it chooses its steps by their error.
    """

    name: str
    order: int
    growth: Growth
    advance: Callable[..., tuple[int, int]]
    adaptive: bool = False

    def engine(self, case: Case, packed: Packed) -> Engine:
        """The method with a case and the memory that it works with."""
        return Compiled(self.advance, packed, 1 if self.adaptive else threads_of(packed))


METHODS: Mapping[str, Method] = {
    method.name: method
    for method in (
        Method("rk4", rk4.ORDER, rk4.growth, rk4.advance),
        Method(
            "central_difference",
            central_difference.ORDER,
            central_difference.growth,
            central_difference.advance,
        ),
        Method(
            "dormand_prince",
            dormand_prince.ORDER,
            dormand_prince.growth,
            dormand_prince.advance,
            adaptive=True,
        ),
    )
}


def method_of(name: str) -> Method:
    """Integrator by its name."""
    if not isinstance(name, str) or name not in METHODS:
        raise InputError(f"method = {name!r}: choose one of {', '.join(METHODS)}")
    return METHODS[name]


def compiled(name: str) -> bool:
    """Whether a method's kernels are in Numba's cache on disk (else its first use compiles)."""
    advance = method_of(name).advance
    folder = Path(advance.stats.cache_path)  # type: ignore[attr-defined]
    function = advance.py_func  # type: ignore[attr-defined]
    stem = f"{function.__module__.rpartition('.')[2]}.{function.__qualname__}-"
    return any(folder.glob(f"{stem}*py{sys.version_info.major}{sys.version_info.minor}*.nbi"))
