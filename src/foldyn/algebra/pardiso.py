"""Factorization by PARDISO, from Intel's Math Kernel Library, for large structures.

The matrix is passed as real symmetric indefinite (type -2), upper triangle by rows. This is as
fast as the factorization of a definite matrix, and also counts the eigenvalues by sign. Pivots stay
within blocks of the diagonal (Bunch and Kaufman), so only the count is known: critical points are
then located by bisection on the count.

Nested dissection and the symbolic factorization take a third of the time of the numeric one. They
depend only on the sparsity pattern. As long as it stays the same, they are done once, and once more
for each further set of factors that is alive at the same time. Parameters are those of `iparm` in
the Developer Reference of oneMKL, counted from 0. The package mkl has no Python interface; its
libraries are called through their C interface.
"""

from __future__ import annotations

import ctypes
import re
import weakref
from functools import cache
from importlib.metadata import PackageNotFoundError, files
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.superlu import Factorization, SingularTangentError
from foldyn.errors import ComputationError

LIBRARY = re.compile(r"(lib)?mkl_rt(\.\d+)*\.(so|dll)(\.\d+)*")
SAME_BITS = 2  # MKL_CBWR_AUTO: the same arithmetic in every run on one machine
SYMMETRIC_INDEFINITE = -2
ANALYSIS, NUMERIC, SOLVE, RELEASE = 11, 22, 33, -1
OWN_VALUES, ORDERING, PERTURBATION, REPLACED, NEGATIVE, REPRODUCIBLE = 0, 1, 9, 13, 22, 33
NESTED_DISSECTION = 2
SMALL = 16  # pivots below 10^-16 of the matrix are zero to rounding, and replaced
NO_MEMORY = {-2, -9}
_NONE = np.zeros(1)


class _Pattern:
    """Sparsity pattern of a symmetric matrix, with its upper triangle in PARDISO's format."""

    def __init__(self, matrix: sparse.csc_array) -> None:
        self._indptr, self._indices = matrix.indptr, matrix.indices
        size, count = matrix.shape[0], len(matrix.indices)
        # a symmetric matrix stored by columns is the same if read by rows
        row = np.repeat(np.arange(size), np.diff(matrix.indptr))
        kept = np.flatnonzero(matrix.indices >= row)
        # PARDISO needs all diagonal entries: missing entries are appended as zeros
        there = np.zeros(size, bool)
        there[row[matrix.indices == row]] = True
        none = np.flatnonzero(~there)
        row = np.r_[row[kept], none]
        column = np.r_[matrix.indices[kept], none]
        take = np.r_[kept, np.full(len(none), count)]
        if len(none) or not matrix.has_sorted_indices:
            order = np.lexsort((column, row))
            row, column, take = row[order], column[order], take[order]
        self._take, self._pad, self.size = take, len(none) > 0, size
        self.first = np.searchsorted(row, np.arange(size + 1)).astype(np.int32) + np.int32(1)
        self.column = column.astype(np.int32) + np.int32(1)

    def values(self, matrix: sparse.csc_array) -> NDArray:
        """Entries of the upper triangle."""
        data = np.r_[matrix.data, 0.0] if self._pad else matrix.data
        return data[self._take].astype(float, copy=False)

    def fits(self, matrix: sparse.csc_array) -> bool:
        """Whether a matrix has this pattern."""
        pairs = (matrix.indptr, self._indptr), (matrix.indices, self._indices)
        return all(one is other or np.array_equal(one, other) for one, other in pairs)


class _Memory:
    """PARDISO's memory for one matrix at a time, with its analysis of a pattern."""

    def __init__(self, pattern: _Pattern) -> None:
        self.pattern = pattern
        self._handle, self.parameters = np.zeros(64, np.int64), np.zeros(64, np.int32)
        self.parameters[OWN_VALUES] = 1
        self.parameters[ORDERING] = NESTED_DISSECTION
        self.parameters[PERTURBATION] = SMALL
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

    def __init__(self) -> None:
        self._spare: list[_Memory] = []
        self._pattern: _Pattern | None = None

    def __call__(self, matrix: sparse.csc_array) -> PardisoFactors:
        """Factorize a matrix (n, n).

        Raises
        ------
        SingularTangentError
            The matrix is singular or not finite.
        ComputationError
            There is no memory for the factors.
        """
        if not np.isfinite(matrix.data).all():
            raise SingularTangentError("the tangent is not finite")
        if self._pattern is None or not self._pattern.fits(matrix):
            self._pattern, self._spare = _Pattern(matrix), []
        values = self._pattern.values(matrix)
        if self._spare:
            memory = self._spare.pop()
        else:
            memory = _Memory(self._pattern)
            memory.call(ANALYSIS, values)
        memory.call(NUMERIC, values)
        if memory.parameters[REPLACED]:
            raise SingularTangentError("the tangent is singular")
        factors = PardisoFactors(memory, values)
        weakref.finalize(factors, _hand_back, self._spare, memory).atexit = False
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


def _hand_back(spare: list[_Memory], memory: _Memory) -> None:
    """Keep the memory of released factors for the next factors."""
    if not spare:
        spare.append(memory)


def _call(
    phase: int, handle: NDArray, parameters: NDArray, pattern: _Pattern, values: NDArray,
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
    try:
        listed = files("mkl") or []
    except PackageNotFoundError:
        return None
    for file in listed:
        if LIBRARY.fullmatch(file.name):
            try:
                loaded = ctypes.CDLL(str(file.locate()))
            except OSError:
                continue
            loaded.MKL_CBWR_Set(SAME_BITS)  # refused if MKL is already in use, which is harmless
            return loaded
    return None
