"""Histories from functions of the user's own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.histories import Constant, History
from foldyn.cases.history import set_field
from foldyn.errors import InputError
from foldyn.values import numbers, show


@dataclass(frozen=True)
class Function(History):
    """A history from the user's own function of time.

    Parameters
    ----------
    function : callable
        Takes a time (s), a float, and gives a factor.
    at : sequence of float, optional
        Times (s) at which it jumps or turns a corner, none of them if empty: integrators that
        choose their steps end one there. Without it they can only look at the function here and
        there within a step, and warn that a short pulse may be missed.

    Notes
    -----
    A function cannot be written to a file: results store it sampled at the stage times of the run.

    Examples
    --------
    >>> tap = Function(lambda t: max(0.0, 1.0 - abs(t - 0.3) / 0.01), at=[0.29, 0.3, 0.31])
    >>> tap.knots()
    (0.29, 0.3, 0.31)
    """

    function: Callable[[Any], Any]
    at: Sequence[float] | None = None
    kind: ClassVar[str] = "function"

    def __post_init__(self) -> None:
        """Check the arguments."""
        if self.at is not None:
            times = np.atleast_1d(numbers("at", self.at))
            set_field(self, "at", tuple(np.unique(times).tolist()))

    def knots(self) -> tuple[float, ...] | None:
        """See `History.knots`."""
        return None if self.at is None else tuple(self.at)

    def factor(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `History.factor`."""
        flat = [self._at(t) for t in time.ravel().tolist()]
        factors = np.array(flat, dtype=np.float64).reshape(time.shape)
        bad = ~np.isfinite(factors)
        if bad.any():
            raise InputError(
                f"history {self._name} gives {factors[bad][0]} at t = {time[bad][0]} s: must be a "
                "finite number at every time of the run"
            )
        return factors

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
