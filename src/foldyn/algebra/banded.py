"""Factorizations of banded matrices by LAPACK.

With nodes numbered along a sheet, the matrix of the sheet is a band. Up to about ten thousand dofs,
a band factorization is faster than a sparse one, especially for small matrices.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from foldyn.algebra.superlu import SingularTangentError
from foldyn.jit.compiled import summing


class Cholesky:
    """Factors U' U of a symmetric positive definite band; they overwrite the band.

    Parameters
    ----------
    band : ndarray, shape (width + 1, n)
        Upper triangle in Fortran order: entry (i, j) at [width + i - j, j].

    Raises
    ------
    SingularTangentError
        The matrix is not positive definite.
    """

    def __init__(self, band: NDArray) -> None:
        factors, failed = lapack.dpbtrf(band, lower=0, overwrite_ab=1)
        if failed or not np.isfinite(factors[-1, -1]):
            raise SingularTangentError("the matrix is not positive definite")
        self.columns = factors.T  # (n, width + 1), with a column of the factor in each row

    def solve(self, b: NDArray) -> NDArray:
        """Solve A x = b in place; return b."""
        substitute(self.columns, b)
        return b


class BandLU:
    """LU factors of a band with partial pivoting; they overwrite the band.

    Parameters
    ----------
    band : ndarray, shape (3 width + 1, n)
        Band in Fortran order: entry (i, j) at [2 width + i - j, j].

    Raises
    ------
    SingularTangentError
        The matrix is singular.
    """

    def __init__(self, band: NDArray) -> None:
        self._width = (len(band) - 1) // 3
        width = self._width
        self._factors, self._pivots, failed = lapack.dgbtrf(band, width, width, overwrite_ab=1)
        if failed or not np.isfinite(self._factors[2 * width, -1]):
            raise SingularTangentError("the matrix is singular")

    def solve(self, b: NDArray) -> NDArray:
        """Solution x of A x = b."""
        return lapack.dgbtrs(self._factors, self._width, self._width, b, self._pivots)[0]


@summing
def substitute(columns, b):
    """Overwrite b (n,) with the solution of U' U x = b; U is a band by columns as in `Cholesky`."""
    width = columns.shape[1] - 1
    for j in range(b.size):
        first = max(0, j - width)
        column, known = columns[j, width - j + first :], b[first:j]
        total = 0.0
        for i in range(known.size):
            total += column[i] * known[i]
        b[j] = (b[j] - total) / columns[j, width]
    for j in range(b.size - 1, -1, -1):
        first = max(0, j - width)
        column, others = columns[j, width - j + first :], b[first:j]
        b[j] /= columns[j, width]
        for i in range(others.size):
            others[i] -= column[i] * b[j]
