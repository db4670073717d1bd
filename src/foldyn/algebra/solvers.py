"""The linear solvers: which one suits a matrix size, and the memory of the factors."""

from __future__ import annotations

import math
import platform
import sys
from collections.abc import Callable, Mapping
from functools import partial
from importlib.util import find_spec
from time import perf_counter
from typing import Any, NamedTuple

from scipy import sparse

from foldyn.algebra.pardiso import Pardiso, Rslab, library
from foldyn.algebra.superlu import Factorization, Factorizer, SuperLU
from foldyn.errors import InputError
from foldyn.notice import NOTICE
from foldyn.ram_limit import check_memory
from foldyn.values import choice


class Backend(NamedTuple):
    """A linear solver for symmetric matrices."""

    make: Callable[[], Factorizer]  # makes a factorizer, best used for matrices of one pattern
    package: str  # that provides the solver, as pip calls it
    found: Callable[[], Any]  # that package, if it is installed
    wheels: bool  # whether there are wheels of it for this machine
    worthwhile: int  # number of rows above which the solver is worth its overhead
    band: float  # number of operations up to which a band factorization is faster
    memory: float  # memory of the factors, relative to SuperLU's
    time: float  # of a factorization of a large sheet, its order known, relative to SuperLU's


_MKL = platform.machine() in ("x86_64", "AMD64") and sys.platform in ("linux", "win32")
SOLVERS: Mapping[str, Backend] = {
    "superlu": Backend(lambda: SuperLU, "scipy", lambda: True, True, 0, 8e9, 1.0, 1.0),
    "rslab": Backend(Rslab, "rslab", partial(find_spec, "rslab"), True, 3_000, 2e9, 0.3, 0.19),
    "pardiso": Backend(Pardiso, "foldyn[mkl]", library, _MKL, 3_000, 2e9, 0.3, 0.14),
}


def factorizer(name: str, size: int) -> tuple[str, Factorizer]:
    """Name of a backend, and a factorizer by it for matrices with `size` rows.

    "auto" chooses the last of `SOLVERS` that is installed and worthwhile for the size, and tells
    once whether a package that is missing would have saved `SAVED`.
    """
    choice("solver", name, ("auto", *SOLVERS))
    if name == "auto":
        fit = [key for key, item in SOLVERS.items() if size >= item.worthwhile]
        *_, name = (key for key in fit if SOLVERS[key].found())
        *_, best = (SOLVERS[key] for key in fit if key == name or SOLVERS[key].wheels)
        return name, _timed(SOLVERS[name], best)
    if not SOLVERS[name].found():
        raise InputError(f'solver = "{name}": needs pip install "{SOLVERS[name].package}"')
    return name, SOLVERS[name].make()


SAVED = 10.0
"""Time (s) in all factorizations of a process that is worth another package."""
_lost = [0.0]  # time that these took longer


def _timed(used: Backend, best: Backend) -> Factorizer:
    """Factorizer of a backend that tells once that the best would have saved much time."""
    factorize = used.make()

    def timed(matrix: sparse.csc_array) -> Factorization:
        begun, before = perf_counter(), _lost[0]
        factors = factorize(matrix)
        _lost[0] += (perf_counter() - begun) * (1.0 - best.time / used.time)
        if before <= SAVED < _lost[0]:
            NOTICE.tell(f'pip install "{best.package}" would have saved {_lost[0]:.0f} s so far')
        return factors

    return factorize if best is used else timed


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
