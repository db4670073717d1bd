"""Factors of a matrix to which a product of few rows is added (Woodbury's formula).

    (A + w G'G)^-1 = A^-1 - A^-1 G' (1/w + G A^-1 G')^-1 G A^-1

G'G, which would fill the matrix, is never formed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lu_factor, lu_solve

from foldyn.algebra.superlu import Solution


class Updated:
    """Solves (A + w G'G) x = b with the factors of A.

    Parameters
    ----------
    factors : Solution
        Of A.
    rows : ndarray, shape (r, n)
        G.
    weight : float or complex
        w, not 0.
    """

    def __init__(self, factors: Solution, rows: NDArray, weight: complex) -> None:
        kind = np.result_type(rows, weight)
        self._factors, self._rows = factors, rows
        self._moved = np.stack([factors.solve(row.astype(kind)) for row in rows], axis=1)
        small = np.eye(len(rows)) / weight + rows @ self._moved
        self._small = lu_factor(small, overwrite_a=True, check_finite=False)

    def solve(self, b: NDArray) -> NDArray:
        """Solution x."""
        x = self._factors.solve(b)
        return x - self._moved @ lu_solve(self._small, self._rows @ x, check_finite=False)
