"""Complex symmetric systems: solutions, and whether rounding leaves anything of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.superlu import SingularTangentError, Solution, factorize
from foldyn.algebra.woodbury import Updated

LOST = 1e-3  # of the solution: rounding above which it is a resonance without damping
PIVOT = 0.01  # of the largest entry in a column: what a pivot on the diagonal must have
BESIDE = 64.0  # times rounding: by how much the factors of A are those of a matrix beside it
REFINED, ROUNDS = 1e-12, 4  # of the solution: changes below which it is not refined further
_EPS = float(np.finfo(np.float64).eps)


def solve(
    matrix: sparse.csc_array, load: NDArray, rows: NDArray | None = None, weight: complex = 0.0
) -> NDArray[np.complex128]:
    """Solution of (A + w G'G) x = load, A complex symmetric; nan where rounding leaves nothing.

    Rounding changes each entry of the matrix by a part of about eps. What changes of that size, all
    in phase with the solution, do to it is found by one more substitution: near a resonance, where
    the solution is nearly its mode, the worst that can happen.

    Parameters
    ----------
    matrix : csc_array, shape (n, n)
        A.
    load : ndarray, shape (n,)
    rows : ndarray, shape (r, n), optional
        G; without it A stands alone.
    weight : complex
        w.
    """
    lost = np.full(len(load), np.nan, np.complex128)
    rows = np.zeros((0, len(load))) if rows is None or weight == 0.0 else rows
    try:
        factors = _factors(matrix, rows, weight)
    except SingularTangentError:
        return lost
    solution = factors.solve(load.astype(np.complex128))
    for _ in range(ROUNDS):
        left = load - matrix @ solution - weight * (rows.T @ (rows @ solution))
        change = factors.solve(left)
        solution += change
        if not np.isfinite(solution).all():
            return lost
        if np.abs(change).max() <= REFINED * np.abs(solution).max():
            break
    size, sizes = np.abs(solution), np.abs(rows)
    phase = solution / np.where(size > np.finfo(float).tiny, size, 1.0)
    terms = abs(matrix) @ size + abs(weight) * (sizes.T @ (sizes @ size))
    rounding = factors.solve(_EPS * phase * terms)
    if not max(np.abs(change).max(), np.abs(rounding).max()) <= LOST * size.max():
        return lost
    return solution


def _factors(matrix: sparse.csc_array, rows: NDArray, weight: complex) -> Solution:
    """Factors of A + w G'G, to be refined.

    At a resonance that only G damps A is singular, and Woodbury's formula fails. It is therefore
    damped by more than its rounding, and by too little to keep refinement from converging wherever
    rounding leaves anything of the solution.
    """
    if not len(rows):
        return factorize(matrix, pivot=PIVOT)
    terms = np.abs(matrix.diagonal()) + abs(weight) * np.einsum("ri,ri->i", rows, rows)
    beside = sparse.diags_array(1j * BESIDE * _EPS * terms)
    return Updated(factorize(sparse.csc_array(matrix + beside), pivot=PIVOT), rows, weight)
