"""What a history is: how a load varies in time, as a factor of time.

A history is called with times (s), a number or an array of any shape, and gives factors of the
same shape.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.cases import waveforms
from foldyn.errors import InputError
from foldyn.values import show


class History(ABC):
    """A factor of time.

    A subclass computes `factor` for an array of times (s) and, as a frozen dataclass, compares
    equal to another with the same arguments: loads with equal histories are summed.
    """

    kind: ClassVar[str]
    code: ClassVar[int] = waveforms.CALLED

    @abstractmethod
    def factor(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Factors at an array of times (s), of the same shape."""

    def __call__(self, time: ArrayLike) -> Any:
        """Factor at each time (s): a float for a number, else an array of the same shape."""
        times = np.asarray(time, dtype=np.float64)
        factors = self.factor(times)
        return factors if times.ndim else float(factors)

    def parameters(self) -> tuple[float, ...]:
        """Numbers of the compiled formula, at most four."""
        return ()

    def polynomials(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Knots (k,) and coefficients (k, 4) of the cubics between them; none but for tables."""
        return np.zeros(0), np.zeros((0, 4))

    def jumps(self) -> tuple[float, ...]:
        """Times (s) at which the factor jumps: no motion can be imposed across them."""
        return ()

    def knots(self) -> tuple[float, ...] | None:
        """Times (s), in order, at which it jumps or turns a corner; None if nobody knows them."""
        return self.jumps()


class Formula(History):
    """A history whose formula is compiled, the one of its `code` in `waveforms`."""

    def factor(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `History.factor`."""
        return self.derivatives(time)[0]

    def derivatives(self, time: ArrayLike) -> NDArray[np.float64]:
        """Factor and its first and second derivative, shape (3, ...), at each time (s)."""
        times = np.asarray(time, dtype=np.float64)
        packed = waveforms.pack([self], waveforms.Callbacks())
        flat = np.ascontiguousarray(times.ravel())
        return waveforms.waveform_table(packed, 0, flat).reshape((3, *times.shape))


def set_field(instance: Any, name: str, value: Any) -> None:
    """Set a checked value of a history: the dataclasses are frozen."""
    object.__setattr__(instance, name, value)


def check_flag(name: str, value: Any) -> None:
    """Refuse what is neither true nor false."""
    if not isinstance(value, bool):
        raise InputError(f"{name} = {show(value)}: must be true or false")
