"""Factorization of large structures by PARDISO, from Intel's Math Kernel Library, or by rslab.

The matrix is passed as symmetric indefinite (for PARDISO type -2), upper triangle by rows. This is
as fast as the factorization of a definite matrix, and also counts the eigenvalues by sign. Pivots
stay within blocks of the diagonal (Bunch and Kaufman), so only the count is known: critical points
are then located by bisection on the count.

Nested dissection and the symbolic factorization take a third of the time of the numeric one. They
depend only on the sparsity pattern. As long as it stays the same, they are done once, and once more
for each further set of factors that is alive at the same time. Parameters are those of `iparm` in
the Developer Reference of oneMKL, counted from 0. The package mkl has no Python interface; its
libraries are called through their C interface. rslab's results have the same bits for any number of
threads.
"""

from __future__ import annotations

import ctypes
import os
import re
import weakref
from collections import deque
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, files
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.superlu import Factorization, SingularTangentError, finite
from foldyn.errors import ComputationError
from foldyn.threads import processors

LIBRARY = re.compile(r"(lib)?mkl_rt(\.\d+)*\.(so|dll)(\.\d+)*")
SAME_BITS = 2  # MKL_CBWR_AUTO: the same arithmetic in every run on one machine
SYMMETRIC_INDEFINITE = -2
ANALYSIS, NUMERIC, SOLVE, RELEASE = 11, 22, 33, -1
OWN_VALUES, ORDERING, PERTURBATION, REPLACED, NEGATIVE, REPRODUCIBLE = 0, 1, 9, 13, 22, 33
NESTED_DISSECTION = 2
SMALL = 16  # pivots below 10^-16 of the matrix are zero to rounding, and replaced
NO_MEMORY = {-2, -9}
_NONE = np.zeros(1)


class Pattern:
    """Sparsity pattern of a symmetric matrix, with its upper triangle in PARDISO's format."""

    def __init__(self, matrix: sparse.csc_array) -> None:
        self._indptr, self._indices = matrix.indptr, matrix.indices
        self.size, count = matrix.shape[0], len(matrix.indices)
        # PARDISO needs all diagonal entries: missing ones are zeros, before the entries
        diagonal = np.arange(self.size)
        row = np.r_[matrix.indices, diagonal]
        column = np.r_[np.repeat(diagonal, np.diff(matrix.indptr)), diagonal]
        number = np.r_[np.arange(1, count + 1), 0 * diagonal]  # of an entry, from 1
        # the upper triangle by rows is the lower one by columns
        whole = sparse.csc_array((number, (row, column)), matrix.shape)
        self.lower = sparse.tril(whole, format="csc")
        self.first = self.lower.indptr.astype(np.int32) + np.int32(1)
        self.column = self.lower.indices.astype(np.int32) + np.int32(1)

    def values(self, matrix: sparse.csc_array) -> NDArray:
        """Entries of the upper triangle."""
        return np.r_[0.0, matrix.data][self.lower.data]

    def fits(self, matrix: sparse.csc_array) -> bool:
        """Whether a matrix has this pattern."""
        pairs = (matrix.indptr, self._indptr), (matrix.indices, self._indices)
        return all(one is other or np.array_equal(one, other) for one, other in pairs)


class _Memory:
    """PARDISO's memory for one matrix at a time, with its analysis of a pattern."""

    def __init__(self, pattern: Pattern) -> None:
        self.pattern = pattern
        self._handle, self.parameters = np.zeros(64, np.int64), np.zeros(64, np.int32)
        self.parameters[[OWN_VALUES, ORDERING, PERTURBATION]] = 1, NESTED_DISSECTION, SMALL
        self.parameters[REPRODUCIBLE] = library().MKL_Get_Max_Threads()
        end = weakref.finalize(self, _call, RELEASE, self._handle, self.parameters, pattern, _NONE)
        end.atexit = False  # the process frees all memory at its end

    def call(self, phase: int, values: NDArray, b: NDArray = _NONE, x: NDArray = _NONE) -> None:
        """Run one phase of PARDISO."""
        error = _call(phase, self._handle, self.parameters, self.pattern, values, b, x)
        if error in NO_MEMORY:
            raise ComputationError(
                f"PARDISO finds no memory for the factors of {self.pattern.size} directions: take "
                "fewer panels, or a machine with more memory"
            )
        if error:
            raise SingularTangentError(f"PARDISO cannot factorize the tangent (error {error})")


class Pardiso:
    """Factorizes symmetric matrices; keeps the analysis of the last pattern."""

    _pattern: Pattern | None = None

    def __call__(self, matrix: sparse.csc_array) -> PardisoFactors:
        """Factorize a matrix (n, n).

        Raises
        ------
        SingularTangentError
            The matrix is singular or not finite.
        ComputationError
            There is no memory for the factors.
        """
        if self._pattern is None or not self._pattern.fits(matrix):
            self._pattern, self._spare = Pattern(matrix), deque[_Memory](maxlen=1)
        values = self._pattern.values(finite(matrix))
        if self._spare:
            memory = self._spare.pop()
        else:
            memory = _Memory(self._pattern)
            memory.call(ANALYSIS, values)
        memory.call(NUMERIC, values)
        if memory.parameters[REPLACED]:
            raise SingularTangentError("the tangent is singular")
        factors = PardisoFactors(memory, values)
        weakref.finalize(factors, self._spare.append, memory).atexit = False
        return factors


class PardisoFactors(Factorization):
    """Factors by PARDISO; when they are released, their memory is reused."""

    def __init__(self, memory: _Memory, values: NDArray) -> None:
        self._memory, self._values = memory, values
        self._negative = int(memory.parameters[NEGATIVE])

    def solve(self, b: NDArray) -> NDArray:
        """Solution x of A x = b, (n,) or (n, k)."""
        b = np.asarray(b, float, order="F")
        x = np.empty_like(b)
        self._memory.call(SOLVE, self._values, b, x)
        return x

    def negative(self) -> int:
        """Number of negative eigenvalues."""
        return self._negative


class Rslab:
    """Factorizes symmetric matrices by rslab; keeps the analysis of the last pattern."""

    _pattern: Pattern | None = None

    def __call__(self, matrix: sparse.csc_array) -> RslabFactors:
        """Factorize a matrix (n, n); `SingularTangentError` if it is singular or not finite."""
        from rslab import analyze

        if self._pattern is None or not self._pattern.fits(matrix):
            pattern = Pattern(matrix)
            threads = int(os.environ.get("NUMBA_NUM_THREADS", processors()))
            self._analysis = analyze(pattern.lower.astype(float), path="ldlt", threads=threads)
            self._pattern = pattern
        try:
            return RslabFactors(self._analysis.factor(self._pattern.values(finite(matrix))))
        except RuntimeError as error:  # "matrix is numerically rank-deficient"
            raise SingularTangentError(f"the tangent is singular ({error})") from error


class RslabFactors(Factorization):
    """Factors by rslab."""

    def __init__(self, factors: Any) -> None:
        self._factors = factors

    def solve(self, b: NDArray) -> NDArray:
        """Solution x of A x = b, (n,) or (n, k)."""
        if not b.size:
            return b.astype(float)
        return self._factors.solve_many(np.asarray(b, float).reshape(len(b), -1)).reshape(b.shape)

    def negative(self) -> int:
        """Number of negative eigenvalues."""
        return self._factors.inertia[1]


def _call(
    phase: int, handle: NDArray, parameters: NDArray, pattern: Pattern, values: NDArray,
    b: NDArray = _NONE, x: NDArray = _NONE,
) -> int:  # fmt: skip
    """Call PARDISO; return the error code, 0 if there is no error."""
    error = ctypes.c_int32(0)
    whole = [ctypes.c_int32(value) for value in (1, 1, SYMMETRIC_INDEFINITE, phase, pattern.size)]
    none, sides, quiet = np.zeros(1, np.int32), ctypes.c_int32(b[0].size), ctypes.c_int32(0)
    arguments: list[Any] = [handle, *whole, values, pattern.first, pattern.column, none, sides]
    arguments += [parameters, quiet, b, x, error]
    library().pardiso(*map(_reference, arguments))
    return error.value


def _reference(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.ctypes.data_as(ctypes.c_void_p)
    return ctypes.byref(value)


@cache
def library() -> Any:
    """The loaded library; None if it is missing or cannot be loaded."""
    with suppress(PackageNotFoundError):
        for file in files("mkl") or []:
            with suppress(OSError):
                if LIBRARY.fullmatch(file.name):
                    loaded = ctypes.CDLL(str(file.locate()))
                    loaded.MKL_CBWR_Set(SAME_BITS)  # refused if MKL is already in use, harmlessly
                    return loaded
    return None
