"""What a row of the verification table is."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.cases import Case, Fix
from foldyn.errors import FoldynWarning
from foldyn.linear import modes
from foldyn.structures.discretized import Discretized


@dataclass(frozen=True)
class Benchmark:
    """A known problem and its numbers; `tests/test_verification_table.py` holds each.

    Parameters
    ----------
    name : str
    source : str
        Of the reference: who, and whether it is a formula, a computation or a measurement.
    model, mesh : str
        What of Foldyn computes it.
    quantity, unit : str
    reference : tuple of float
    error : float
        Largest relative difference of a value that is allowed.
    compute : callable
        Our values, in the order of the reference.
    why : str
        Where the difference comes from, if it is above 3 %.
    """

    name: str
    source: str
    model: str
    mesh: str
    quantity: str
    unit: str
    reference: tuple[float, ...]
    error: float
    compute: Callable[[], ArrayLike]
    why: str = ""

    def ours(self) -> NDArray:
        """Our values; the table says itself how far off they are."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FoldynWarning)
            return np.atleast_1d(np.asarray(self.compute(), float))

    def difference(self, ours: ArrayLike) -> float:
        """The relative difference that is largest, with its sign."""
        apart = np.asarray(ours) / self.reference - 1.0
        return float(apart[np.abs(apart).argmax()])


def frequencies(
    structure: Discretized, supports: list[Fix], count: int = 6, rigid: int = 0
) -> NDArray:
    """Lowest frequencies (Hz) above those of rigid motions."""
    case = Case(structure, list(supports))
    return modes(case, rigid + count, check_model=False).frequency.values[rigid:]
