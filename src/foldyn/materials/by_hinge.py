"""Laws that differ from hinge to hinge, in the place of one law for all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.materials.law import HingeLaw


@dataclass(frozen=True)
class LawByHinge(HingeLaw):
    """A law for each of n hinges, which are the last axis of all arrays.

    Parameters
    ----------
    laws : tuple of HingeLaw
    which : tuple of int
        Number of the law of each hinge.
    """

    laws: tuple[HingeLaw, ...]
    which: tuple[int, ...]

    @property
    def name(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Names of all laws."""
        return ", ".join(law.name for law in self.laws)

    def __str__(self) -> str:
        """Names of all laws, for messages."""
        return self.name

    @property
    def parts(self) -> tuple[tuple[HingeLaw, Any], ...]:
        """See `HingeLaw`."""
        which = np.array(self.which)
        return tuple((law, np.flatnonzero(which == k)) for k, law in enumerate(self.laws))

    def at(self, rows: Any) -> HingeLaw:
        """See `HingeLaw`."""
        used, which = np.unique(np.array(self.which)[rows], return_inverse=True)
        laws = tuple(self.laws[k] for k in used.tolist())
        return laws[0] if len(laws) == 1 else LawByHinge(laws, tuple(which.tolist()))

    def each(self, of: Callable[[HingeLaw, Any], NDArray]) -> NDArray:
        """See `HingeLaw`."""
        found = [(rows, of(law, rows)) for law, rows in self.parts]
        first = found[0][1]
        out = np.empty((*first.shape[:-1], len(self.which)), first.dtype)
        for rows, own in found:
            out[..., rows] = own
        return out

    @property
    def elastic(self) -> HingeLaw:  # pyright: ignore[reportIncompatibleVariableOverride]
        """See `HingeLaw`."""
        laws = tuple(law.elastic for law in self.laws)
        return self if laws == self.laws else LawByHinge(laws, self.which)

    @property
    def follows_rest(self) -> bool:  # pyright: ignore[reportIncompatibleVariableOverride]
        """See `HingeLaw`."""
        return any(law.follows_rest for law in self.laws)

    def parameters(self, rest: NDArray) -> NDArray:
        """See `HingeLaw`."""
        columns = self.each(lambda law, rows: law.parameters(rest[rows]).T)
        return np.ascontiguousarray(columns.T)

    def reach(self, theta: NDArray, rest: NDArray, parameters: NDArray) -> NDArray:
        """See `HingeLaw`."""
        return self.each(lambda law, rows: law.reach(theta[rows], rest[rows], parameters[rows]))

    def least_slope(self, rest: NDArray, stiffness: NDArray, length: NDArray) -> NDArray:
        """See `HingeLaw`."""
        return self.each(
            lambda law, rows: law.least_slope(rest[rows], stiffness[rows], length[rows])
        )

    def _rows(self, compiled: Callable[..., NDArray], theta: ArrayLike, rest: ArrayLike) -> NDArray:
        theta, rest = np.broadcast_arrays(theta, rest)
        return self.each(lambda law, rows: law._rows(compiled, theta[..., rows], rest[..., rows]))
