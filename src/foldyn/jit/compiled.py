"""The decorators of compiled functions: nothing else in the package calls Numba's own.

What they compile is kept on disk (`kept`) and stands alone (`alone`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import cfunc, njit

from foldyn.jit.alone import Alone
from foldyn.jit.kept import Kept

# fused multiply-adds are the only liberty taken: NaN must survive
_FUSED = {"contract"}


def _decorator(**options: Any) -> Callable[..., Any]:
    # error_model="numpy": a division by zero gives inf or nan (looked for by the solvers) instead
    # of a branch in every loop
    compiled = njit(error_model="numpy", pipeline_class=Alone, **options)

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher: Any = compiled(function)
        dispatcher._cache = Kept(function)  # as njit(cache=True) sets Numba's own
        return dispatcher

    return decorate


kernel = _decorator(fastmath=_FUSED)
# laws and other small formulas: inlined into the kernels that call them
scalar = _decorator(fastmath=_FUSED, forceinline=True)
# sums whose order does not matter: in any order they can be vectorized; NaN survives here too
summing = _decorator(fastmath=_FUSED | {"reassoc"})
# without Python's lock: for functions that threads run together
shared = _decorator(fastmath=_FUSED, nogil=True)
# the arithmetic as it is written: pictures
strict = _decorator()
strict_inlined = _decorator(inline="always")


def callback(signature: str, function: Callable[..., Any]) -> Any:
    """Compile a user's function, to be called by its address; it is not kept on disk."""
    # a division by zero gives inf or nan here too: an exception cannot leave through an address
    return cfunc(signature, error_model="numpy")(function)


def ready(function: Any) -> bool:
    """Whether a compiled function is kept on disk (else its first use compiles)."""
    return function._cache.ready()
