"""The linear solvers: which one factorizes a matrix of a size, and the memory of its factors."""

from __future__ import annotations

import math
from collections.abc import Mapping
from importlib.util import find_spec
from typing import NamedTuple

from foldyn.algebra.pardiso import Pardiso
from foldyn.algebra.superlu import Factorizer, SuperLU
from foldyn.errors import InputError
from foldyn.memory import check_memory


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


class Fill(NamedTuple):
    """Memory that SuperLU's factors take, by experience with a model, and what makes it less."""

    per_doubling: float  # bytes a dof for each doubling of the number of dofs,
    least: int  # from so many dofs on
    field: str
    remedy: str


def check_fill(fill: Fill, dofs: int) -> None:
    """Refuse a structure whose factors memory cannot hold."""
    needed = fill.per_doubling * dofs * max(math.log2(max(dofs, 1) / fill.least), 1.0)
    if factorizer("auto", dofs)[0] == "pardiso":
        needed *= 0.3  # 1.4 GiB instead of 3.5 for the modes of 240,600 dofs
    check_memory(fill.field, f"solving for {dofs} dofs", needed, fill.remedy)
