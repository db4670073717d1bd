"""How scalar laws are compiled: inlined into the kernels that call them."""

from __future__ import annotations

from numba import njit

from foldyn.kernel_cache import remove_stale_caches

remove_stale_caches()  # before any kernel is loaded: everything compiled imports this module

# error_model="numpy": a division by zero gives inf or nan (looked for by the solvers) instead of
# a branch in every loop. No fastmath: NaN must survive.
scalar = njit(cache=True, error_model="numpy", forceinline=True)
kernel = njit(cache=True, error_model="numpy")
