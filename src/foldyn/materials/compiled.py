"""How scalar laws are compiled: inlined into the kernels that call them."""

from __future__ import annotations

from numba import njit

from foldyn.kernel_cache import remove_stale_caches

remove_stale_caches()  # before any kernel is loaded: everything compiled imports this module

# error_model="numpy": a division by zero gives inf or nan (looked for by the solvers) instead of
# a branch in every loop. Fused multiply-adds are the only liberty taken: NaN must survive.
scalar = njit(cache=True, error_model="numpy", fastmath={"contract"}, forceinline=True)
kernel = njit(cache=True, error_model="numpy", fastmath={"contract"})
# sums whose order does not matter: in any order they can be vectorized; NaN survives here too
summing = njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
