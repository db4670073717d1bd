"""Complex symmetric systems: solutions, and whether rounding errors spoil them."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import lapack

from foldyn.algebra.superlu import PIVOT, SingularTangentError, Solution, factorize
from foldyn.algebra.woodbury import Updated

LOST = 1e-3  # relative rounding error above which a resonance lacks damping
BESIDE = 64.0  # damping that is added to A, in rounding errors
# relative change of the solution at which refinement stops, and largest number of rounds
REFINED, ROUNDS = 1e-12, 4
FULL = 0.2  # share of nonzeros above which a matrix counts as full
SPARSE = 40.0  # time per entry of a sparse solution, in multiplications of full matrices
_EPS = float(np.finfo(np.float64).eps)


class Gram:
    """A matrix G'G of rows G (r, n) that is added to many matrices."""

    def __init__(self, rows: NDArray) -> None:
        self.rows = rows

    @cached_property
    def matrix(self) -> NDArray[np.float64]:
        """G'G (n, n)."""
        return self.rows.T @ self.rows

    def fills(self, matrix: sparse.csc_array) -> bool:
        """Whether factorizing the full sum with a sparse matrix is faster than Woodbury's formula.

        The formula takes a sparse solution for each row, a product of size r r n, and factors of an
        r by r matrix.
        """
        r, n = self.rows.shape
        return SPARSE * r * matrix.nnz + r**2 * n + r**3 / 3.0 > n**3 / 4.0


def solve(
    matrix: sparse.csc_array, load: NDArray, gram: Gram | None = None, weight: complex = 0.0
) -> NDArray[np.complex128]:
    """Solution of (A + w G'G) x = load, A complex symmetric; nan if rounding spoils it.

    Rounding changes each entry of the matrix by about eps times the entry. One more substitution
    gives the effect of such changes on the solution if they are in phase with it. Near a
    resonance, where the solution is nearly the mode, this is the worst case.

    Parameters
    ----------
    matrix : csc_array, shape (n, n)
        The matrix A.
    load : ndarray, shape (n,)
    gram : Gram, optional
        The matrix G'G; zero by default.
    weight : complex
        The factor w.
    """
    return solved(matrix, load, gram, weight)[0]


def solved(
    matrix: sparse.csc_array, load: NDArray, gram: Gram | None = None, weight: complex = 0.0
) -> tuple[NDArray[np.complex128], Solution | None]:
    """Solution as from `solve`, and the factors; the factors are None if the solution is nan."""
    lost = np.full(len(load), np.nan, np.complex128), None
    if gram is None or weight == 0.0:
        gram = Gram(np.zeros((0, len(load))))
    rows = gram.rows
    try:
        factors = _factors(matrix, gram, weight)
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
    return solution, factors


def _factors(matrix: sparse.csc_array, gram: Gram, weight: complex) -> Solution:
    """Factors of A + w G'G, precise enough for refinement.

    At a resonance that only G damps, A is singular and Woodbury's formula fails. A small damping
    is therefore added to A. It exceeds the rounding error, but lets refinement converge whenever
    rounding does not spoil the solution.
    """
    rows, full = gram.rows, matrix.nnz > FULL * matrix.shape[0] ** 2
    if not len(rows) and not full:
        return factorize(matrix, pivot=PIVOT)
    if full or gram.fills(matrix):
        return _Full(matrix.toarray() + weight * gram.matrix)
    terms = np.abs(matrix.diagonal()) + abs(weight) * np.einsum("ri,ri->i", rows, rows)
    beside = sparse.diags_array(1j * BESIDE * _EPS * terms)
    return Updated(factorize(sparse.csc_array(matrix + beside), pivot=PIVOT), rows, weight)


class _Full:
    """LU factors of a full matrix; the oldest supported SciPy has no symmetric factors."""

    def __init__(self, matrix: NDArray) -> None:
        self._factors, self._pivots, failed = lapack.zgetrf(matrix.T, overwrite_a=True)
        if failed:
            raise SingularTangentError("the matrix is singular")

    def solve(self, b: NDArray) -> NDArray:
        """Solution x of A x = b."""
        return lapack.zgetrs(self._factors, self._pivots, b)[0]
