"""Factors of a matrix to which a product of a few rows is added (Woodbury's formula).

    (A + w G'G)^-1 = A^-1 - A^-1 G' (1/w + G A^-1 G')^-1 G A^-1

G'G, which would fill the matrix, is never formed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import lu_factor, lu_solve

from foldyn.algebra.superlu import Factorization, Solution


class Updated:
    """Solves (A + w G'G) x = b with the factors of A.

    Parameters
    ----------
    factors : Solution
        Factors of A.
    rows : ndarray, shape (r, n)
        The rows G.
    weight : float or complex
        The factor w, not 0.
    """

    def __init__(self, factors: Solution, rows: NDArray, weight: complex) -> None:
        kind = np.result_type(rows, weight)
        self._factors, self._rows = factors, rows
        self._moved = np.stack([factors.solve(row.astype(kind)) for row in rows], axis=1)
        small = np.eye(len(rows)) / weight + rows @ self._moved
        self._small = lu_factor(small, overwrite_a=True, check_finite=False)

    def solve(self, b: NDArray) -> NDArray:
        """Solution x of (A + w G'G) x = b."""
        x = self._factors.solve(b)
        return x - self._moved @ lu_solve(self._small, self._rows @ x, check_finite=False)


class Squared:
    """The sum A + G'G of a sparse matrix and a product of rows; it is never formed.

    Parameters
    ----------
    matrix : csc_array, shape (n, n)
        The matrix A.
    rows : ndarray, shape (r, n)
        The rows G.
    """

    def __init__(self, matrix: sparse.csc_array, rows: NDArray) -> None:
        self.matrix, self.rows, self.shape = matrix, rows, matrix.shape

    def __matmul__(self, x: NDArray) -> NDArray:
        """Product of the sum with one vector (n,) or several (n, k)."""
        return self.matrix @ x + self.rows.T @ (self.rows @ x)

    def toarray(self) -> NDArray:
        """The sum as a full matrix."""
        return self.matrix.toarray() + self.rows.T @ self.rows

    def diagonal(self) -> NDArray:
        """Diagonal (n,) of the sum."""
        return self.matrix.diagonal() + np.einsum("ri,ri->i", self.rows, self.rows)


class Counted(Updated, Factorization):
    """`Updated` for symmetric matrices, which also counts negative eigenvalues of the sum.

    The count follows from both Schur complements of the block matrix [[A, G'], [G, -1/w]]
    (Haynsworth's theorem).
    """

    def __init__(self, factors: Factorization, rows: NDArray, weight: float) -> None:
        super().__init__(factors, rows, weight)
        values = np.linalg.eigvalsh(np.eye(len(rows)) / weight + rows @ self._moved)
        given = len(rows) if weight > 0.0 else 0
        self._negative = factors.negative() + int((values > 0.0).sum()) - given

    def negative(self) -> int:
        """Number of negative eigenvalues."""
        return self._negative
