"""Histories from functions of the user's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.histories import Constant, History
from foldyn.cases.values import show
from foldyn.errors import InputError


@dataclass(frozen=True)
class Function(History):
    """A history from the user's own function of time.

    Parameters
    ----------
    function : callable
        Takes a time (s) and gives a factor; one that takes an array of times and gives an array
        of the same shape is called once for all times.

    Notes
    -----
    A function cannot be written to a file: results store it sampled at the stage times of the run.
    """

    function: Callable[[Any], Any]
    kind: ClassVar[str] = "function"

    def factor(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `History.factor`."""
        factors = self._at_once(time) if time.ndim else None
        if factors is None:
            flat = [self._at(t) for t in time.ravel().tolist()]
            factors = np.array(flat, dtype=np.float64).reshape(time.shape)
        bad = np.argwhere(~np.isfinite(factors))
        if bad.size:
            place = tuple(bad[0])
            raise InputError(
                f"history {self._name} gives {factors[place]} at t = {time[place]} s: must be a "
                "finite number at every time of the run"
            )
        return factors

    def _at_once(self, time: NDArray[np.float64]) -> NDArray[np.float64] | None:
        try:
            factors = np.array(self.function(time.copy()), dtype=np.float64)
        except Exception:  # a scalar function may fail on an array in any way of its own
            return None
        return factors if factors.shape == time.shape and self._agrees(time, factors) else None

    def _agrees(self, time: NDArray[np.float64], factors: NDArray[np.float64]) -> bool:
        """Whether the answer to an array is that to its entries; `if` in a function spoils it."""
        entries = time.ravel()
        for k in {0, entries.size // 2, entries.size - 1}:
            try:
                one = float(self.function(entries[k]))
            except Exception:  # a function of arrays only
                return True
            if not np.isclose(one, factors.ravel()[k], rtol=1e-9, atol=1e-300, equal_nan=True):
                return False
        return True

    def _at(self, time: float) -> float:
        try:
            value = self.function(time)
        except Exception as error:
            raise InputError(
                f"history {self._name} fails at t = {time} s: {type(error).__name__}: {error}"
            ) from error
        try:
            return float(value)
        except (TypeError, ValueError):
            raise InputError(
                f"history {self._name} gives {show(value)} at t = {time} s: must be a number"
            ) from None

    @property
    def _name(self) -> str:
        return getattr(self.function, "__name__", repr(self.function))


def as_history(history: History | Callable[[Any], Any] | None) -> History:
    """Turn None (a constant), a history or any callable into a history."""
    if history is None:
        return Constant()
    if isinstance(history, History):
        return history
    if isinstance(history, type) and issubclass(history, History):
        raise InputError(
            f"history = {history.__name__}: give an object, as in {history.__name__}(...)"
        )
    if callable(history):
        return Function(history)
    raise InputError(
        f"history = {show(history)}: must be a history such as Pulse(duration=1.0), or a function "
        "of time"
    )
