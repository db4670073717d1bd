"""The linear solvers: which one factorizes a matrix of a size, and the memory of its factors."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

from scipy import sparse

from foldyn.algebra.pardiso import Pardiso, library
from foldyn.algebra.superlu import Factorization, Factorizer, SuperLU
from foldyn.errors import InputError
from foldyn.ram_limit import check_memory
from foldyn.values import choice


class Backend(NamedTuple):
    """A linear solver of symmetric matrices."""

    make: Callable[[], Factorizer]  # for matrices one after the other, best of the same pattern
    package: str  # that it comes with
    found: Callable[[], bool]  # whether that is installed
    worthwhile: int  # rows from which it is worth its overhead
    band: float  # products of a band's factorization up to which that is quicker
    memory: float  # of its factors, as a share of SuperLU's


SOLVERS: Mapping[str, Backend] = {
    "superlu": Backend(lambda: SuperLU, "scipy", lambda: True, 0, 8e9, 1.0),
    "pardiso": Backend(Pardiso, "mkl", lambda: library() is not None, 3_000, 2e9, 0.3),
}


def factorizer(name: str, size: int) -> tuple[str, Factorizer]:
    """Name of a backend, and what factorizes matrices of so many rows.

    "auto" is the last of `SOLVERS` that is installed and worthwhile for the size.
    """
    choice("solver", name, ("auto", *SOLVERS))
    if name == "auto":
        fit = [key for key, item in SOLVERS.items() if size >= item.worthwhile and item.found()]
        name = fit[-1]
    if not SOLVERS[name].found():
        raise InputError(
            f"solver = {name!r}: needs the package {SOLVERS[name].package}, which is not "
            "installed; install it, or choose 'superlu'"
        )
    return name, SOLVERS[name].make()


def factorized(matrix: sparse.csc_array) -> Factorization:
    """Factors of a symmetric matrix by the solver that "auto" takes."""
    return factorizer("auto", matrix.shape[0])[1](matrix)


MOST_UNSYMMETRIC = 4e9  # products of an unsymmetric band above which SuperLU is quicker


def takes_band(size: int, width: int, symmetric: bool) -> bool:
    """Whether a matrix of so many rows with all entries in a band is factorized as one.

    Its factorization takes products of the number of rows and the width squared.
    """
    most = SOLVERS[factorizer("auto", size)[0]].band if symmetric else MOST_UNSYMMETRIC
    return float(size) * (width + 1) ** 2 <= most


class Fill(NamedTuple):
    """Memory that SuperLU's factors take, by experience with a model, and what makes it less."""

    per_doubling: float  # bytes a dof for each doubling of the number of dofs,
    least: int  # from so many dofs on
    field: str
    remedy: str


def check_fill(fill: Fill, dofs: int) -> None:
    """Refuse a structure whose factors memory cannot hold."""
    needed = fill.per_doubling * dofs * max(math.log2(max(dofs, 1) / fill.least), 1.0)
    needed *= SOLVERS[factorizer("auto", dofs)[0]].memory
    check_memory(fill.field, f"solving for {dofs} dofs", needed, fill.remedy)
