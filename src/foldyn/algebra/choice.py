"""The choice of a factorization by the size of a matrix."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.util import find_spec
from typing import NamedTuple

from foldyn.algebra.pardiso import Pardiso
from foldyn.algebra.superlu import Factorizer, SuperLU
from foldyn.errors import InputError


class Backend(NamedTuple):
    """A factorizer, the module that it needs, and the rows from which it is worth its overhead."""

    factorize: Factorizer
    module: str
    worthwhile: int

    @property
    def present(self) -> bool:
        """Whether its module is installed."""
        return find_spec(self.module) is not None


SOLVERS: Mapping[str, Backend] = {
    "superlu": Backend(SuperLU, "scipy", 0),
    "pardiso": Backend(Pardiso, "pypardiso", 10_000),
}


def factorizer(name: str, size: int) -> tuple[str, Factorizer]:
    """Name and function of a backend for matrices of so many rows.

    "auto" is the last of `SOLVERS` that is installed and worthwhile for the size.
    """
    if name == "auto":
        fit = [key for key, item in SOLVERS.items() if size >= item.worthwhile and item.present]
        name = fit[-1]
    if name not in SOLVERS:
        raise InputError(f"solver = {name!r}: choose 'auto' or one of {', '.join(SOLVERS)}")
    if not SOLVERS[name].present:
        raise InputError(
            f"solver = {name!r}: needs the package {SOLVERS[name].module}, which is not installed; "
            "install it, or choose 'superlu'"
        )
    return name, SOLVERS[name].factorize


# products of a band's factorization (rows times width squared) above which a sparse one is quicker
MOST_SYMMETRIC, MOST_UNSYMMETRIC = 8e9, 4e9


def takes_band(size: int, width: int, symmetric: bool) -> bool:
    """Whether a matrix of so many rows with all entries in a band is factorized as one."""
    return float(size) * (width + 1) ** 2 <= (MOST_SYMMETRIC if symmetric else MOST_UNSYMMETRIC)
