"""The linear solvers: which one suits a matrix size, and the memory of the factors."""

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
    """A linear solver for symmetric matrices."""

    make: Callable[[], Factorizer]  # makes a factorizer, best used for matrices of one pattern
    package: str  # package that provides the solver
    found: Callable[[], bool]  # whether that package is installed
    worthwhile: int  # number of rows above which the solver is worth its overhead
    band: float  # number of operations up to which a band factorization is faster
    memory: float  # memory of the factors, relative to SuperLU's


SOLVERS: Mapping[str, Backend] = {
    "superlu": Backend(lambda: SuperLU, "scipy", lambda: True, 0, 8e9, 1.0),
    "pardiso": Backend(Pardiso, "mkl", lambda: library() is not None, 3_000, 2e9, 0.3),
}


def factorizer(name: str, size: int) -> tuple[str, Factorizer]:
    """Name of a backend, and a factorizer by it for matrices with `size` rows.

    "auto" chooses the last of `SOLVERS` that is installed and worthwhile for the size.
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
    """Factors of a symmetric matrix by the solver that "auto" selects."""
    return factorizer("auto", matrix.shape[0])[1](matrix)


MOST_UNSYMMETRIC = 4e9  # number of products of an unsymmetric band above which SuperLU is faster


def takes_band(size: int, width: int, symmetric: bool) -> bool:
    """Whether to factorize a matrix with `size` rows as a band of a given width.

    A band factorization takes about rows times squared width operations.
    """
    most = SOLVERS[factorizer("auto", size)[0]].band if symmetric else MOST_UNSYMMETRIC
    return float(size) * (width + 1) ** 2 <= most


class Fill(NamedTuple):
    """Measured memory of SuperLU's factors for a model, and the remedy if it is too large."""

    per_doubling: float  # bytes per dof for each doubling of the number of dofs
    least: int  # number of dofs from which `per_doubling` holds
    field: str
    remedy: str


def check_fill(fill: Fill, dofs: int) -> None:
    """Refuse a structure whose factors exceed memory."""
    needed = fill.per_doubling * dofs * max(math.log2(max(dofs, 1) / fill.least), 1.0)
    needed *= SOLVERS[factorizer("auto", dofs)[0]].memory
    check_memory(fill.field, f"solving for {dofs} dofs", needed, fill.remedy)
