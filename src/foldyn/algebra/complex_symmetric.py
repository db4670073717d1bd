"""Complex symmetric systems: solutions, and whether rounding leaves anything of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.superlu import SingularTangentError, factorize

LOST = 1e-3  # of the solution: rounding above which it is a resonance without damping
PIVOT = 0.01  # of the largest entry in a column: what a pivot on the diagonal must have
_EPS = float(np.finfo(np.float64).eps)


def solve(matrix: sparse.csc_array, load: NDArray) -> NDArray[np.complex128]:
    """Solution of a complex symmetric system; nan where rounding leaves nothing of it.

    Rounding changes each entry of the matrix by a part of about eps. What changes of that size, all
    in phase with the solution, do to it is found by one more substitution: near a resonance, where
    the solution is nearly its mode, the worst that can happen.
    """
    lost = np.full(len(load), np.nan, np.complex128)
    try:
        factors = factorize(matrix, pivot=PIVOT)
    except SingularTangentError:
        return lost
    solution = factors.solve(load.astype(np.complex128))
    solution += factors.solve(load - matrix @ solution)
    if not np.isfinite(solution).all():
        return lost
    size = np.abs(solution)
    phase = solution / np.where(size > np.finfo(float).tiny, size, 1.0)
    change = factors.solve(_EPS * phase * (abs(matrix) @ size))
    if not np.abs(change).max() <= LOST * size.max():
        return lost
    return solution
