"""Sparse symmetric factorizations: solutions, and the number of negative eigenvalues.

The tangent of a structure is symmetric, but indefinite beyond a critical point. A factorization
P A P' = L D L' has as many negative pivots as A has negative eigenvalues (Sylvester's law of
inertia), so one factorization gives both the step and the stability.

SciPy's SuperLU takes small structures, rslab large ones, or PARDISO, an optional package that is
faster still; `solvers` chooses.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.errors import FoldynError


class SingularTangentError(FoldynError):
    """The tangent cannot be factorized: it is singular to rounding, or not finite."""


class Solution(Protocol):
    """A factorized matrix."""

    def solve(self, b: NDArray) -> NDArray:
        """Solution x of A x = b."""
        ...


class Factorization(Solution, Protocol):
    """A factorized symmetric matrix."""

    def pivots(self) -> NDArray | None:
        """Pivots, which have the signs of the eigenvalues; None if only their count is known."""
        return None

    def negative(self) -> int:
        """Number of negative eigenvalues."""
        ...


Factorizer = Callable[[sparse.csc_array], Factorization]


def finite(matrix: sparse.csc_array) -> sparse.csc_array:
    """Refuse a matrix with entries that are not finite."""
    if not np.isfinite(matrix.data).all():
        raise SingularTangentError("the tangent is not finite")
    return matrix


def factorize(matrix: sparse.csc_array, symmetric: bool = True, pivot: float = 0.0) -> Any:
    """Factors by SciPy's SuperLU, with the attributes of SuperLU.

    symmetric : keep pivots on the diagonal, except a pivot that is smaller than `pivot` times the
    largest entry of its column.
    """
    options = {"SymmetricMode": True}
    mode = dict(permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=pivot, options=options)
    try:
        return splu(matrix, **(mode if symmetric else {}))
    except RuntimeError as error:  # "Factor is exactly singular"
        raise SingularTangentError("the matrix is singular") from error


class SuperLU:
    """SciPy's SuperLU in symmetric mode, with pivots from the diagonal."""

    def __init__(self, matrix: sparse.csc_array) -> None:
        self._lu, self._matrix = factorize(finite(matrix)), matrix

    def solve(self, b: NDArray) -> NDArray:
        """Solution x of A x = b."""
        return self._lu.solve(b)

    @cached_property
    def _pivots(self) -> NDArray:
        straight = np.array_equal(self._lu.perm_r, self._lu.perm_c)
        return self._lu.U.diagonal() if straight else _eigenvalues(self._matrix)

    def pivots(self) -> NDArray:
        """Pivots; the eigenvalues instead if a pivot had to leave the diagonal."""
        return self._pivots

    def negative(self) -> int:
        """Number of negative eigenvalues."""
        return int((self.pivots() < 0.0).sum())


PIVOT = 0.01  # least pivot on the diagonal, relative to the largest entry in the column


def unsymmetric(matrix: sparse.csc_array) -> Solution:
    """Factorize a nearly symmetric matrix."""
    return factorize(finite(matrix), pivot=PIVOT)


MOST_DENSE = 3000  # number of dofs up to which all eigenvalues are affordable


def _eigenvalues(matrix: sparse.csc_array) -> NDArray:
    if matrix.shape[0] > MOST_DENSE:
        raise SingularTangentError("the tangent has a vanishing pivot")
    return np.linalg.eigvalsh(matrix.toarray())
