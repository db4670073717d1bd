"""Factorization by Intel MKL's PARDISO (package pypardiso), for large structures.

The matrix is passed as real symmetric indefinite (type -2), upper triangle by rows. PARDISO counts
the eigenvalues by sign but keeps its pivots to itself: critical points are then located by
bisection on the count.
"""

from __future__ import annotations

import weakref
from importlib import import_module

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.superlu import SingularTangentError

SYMMETRIC_INDEFINITE = -2
NEGATIVE = 23  # number of the entry of iparm with the count of negative eigenvalues


class Pardiso:
    """Factorization by PARDISO."""

    def __init__(self, matrix: sparse.csc_array) -> None:
        if not np.isfinite(matrix.data).all():
            raise SingularTangentError("the tangent is not finite")
        # by rows: a symmetric matrix by columns, read by rows, is the same
        rows = sparse.csr_matrix((matrix.data, matrix.indices, matrix.indptr), shape=matrix.shape)
        self._upper = sparse.triu(rows, format="csr")
        self._upper.sort_indices()
        self._solver = import_module("pypardiso").PyPardisoSolver(mtype=SYMMETRIC_INDEFINITE)
        weakref.finalize(self, self._solver.free_memory, everything=True)
        try:
            self._solver.factorize(self._upper)
        except Exception as error:  # its own class, raised for zero pivots and for lack of memory
            raise SingularTangentError(f"PARDISO cannot factorize the tangent: {error}") from error

    def solve(self, b: NDArray) -> NDArray:
        """Solution x of A x = b."""
        return np.asarray(self._solver.solve(self._upper, b)).reshape(b.shape)

    def pivots(self) -> None:
        """None: PARDISO does not show its pivots."""
        return

    def negative(self) -> int:
        """Count of negative eigenvalues."""
        return int(self._solver.get_iparm(NEGATIVE))
