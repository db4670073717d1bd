"""Histories: how a load varies in time, as a factor.

A history is called with times (s), a number or an array of any shape, and returns factors of the
same shape. This module has the constant history and user-defined functions; `histories` has the
other built-in histories.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.arguments import Check, Checked
from foldyn.errors import InputError
from foldyn.jit.compiled import inner_scalar
from foldyn.values import numbers, show

CALLED, CONSTANT = -1, 0  # codes of user's functions and of the constant history


class History(Checked, ABC):
    """A factor of time.

    A subclass computes `factor` for an array of times (s). It is a frozen data class, so histories
    with the same arguments are equal, and loads with equal histories are summed.
    """

    kind: ClassVar[str]
    code: ClassVar[int] = CALLED

    @abstractmethod
    def factor(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Factors at an array of times (s), of the same shape."""

    def __call__(self, time: ArrayLike) -> Any:
        """Factor at each time (s): a float for a number, else an array of the same shape."""
        times = np.asarray(time, dtype=np.float64)
        factors = self.factor(times)
        return factors if times.ndim else float(factors)

    def parameters(self) -> tuple[float, ...]:
        """Parameters of the compiled formula, at most four."""
        return ()

    def polynomials(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Knots (k,) of a table and coefficients (k, 4) of the cubics after them; else empty."""
        return np.zeros(0), np.zeros((0, 4))

    def jumps(self) -> tuple[float, ...]:
        """Times (s) at which the factor jumps; imposed motions cannot follow jumps."""
        return ()

    def knots(self) -> tuple[float, ...] | None:
        """Times (s), in order, at which the factor jumps or has a corner; None if unknown."""
        return self.jumps()


class Waveform(NamedTuple):
    """A compiled formula for the factor and its first and second derivative in time.

    It takes the time (s) and the history's `parameters`. At a jump of a derivative it returns the
    value after the jump.
    """

    code: int  # unique among histories
    formula: Any  # None if `polynomials` define the history


class Formula(History):
    """A history with a compiled formula, for loops over time."""

    formulas: ClassVar[tuple[Waveform, ...]] = ()
    """One waveform for each code of the history; the first is the default."""
    table: ClassVar[Callable[[History, NDArray], NDArray]]
    """Factors and derivatives at times; set by `cases`, as `waveforms` imports all histories."""

    def __init_subclass__(cls, **options: Any) -> None:
        """Set the code of a class with formulas to the code of its first formula."""
        super().__init_subclass__(**options)
        if "formulas" in vars(cls) and isinstance(cls.code, int):
            cls.code = cls.formulas[0].code

    def factor(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `History.factor`."""
        return self.derivatives(time)[0]

    def derivatives(self, time: ArrayLike) -> NDArray[np.float64]:
        """Factor and its first and second derivative, shape (3, ...), at each time (s)."""
        times = np.asarray(time, dtype=np.float64)
        return self.table(np.ascontiguousarray(times.ravel())).reshape((3, *times.shape))


@inner_scalar
def constant(t):
    """See `Waveform`."""
    return 1.0, 0.0, 0.0


@dataclass(frozen=True)
class Constant(Formula):
    """Factor 1 at all times."""

    kind: ClassVar[str] = "constant"
    formulas = (Waveform(CONSTANT, constant),)


def _times(name: str, value: Any) -> tuple[float, ...]:
    """Return sorted times without repetitions."""
    return tuple(np.unique(numbers(name, value)).tolist())


@dataclass(frozen=True)
class Function(History):
    """A history from a user-defined function of time.

    Parameters
    ----------
    function : callable
        Takes a time (s) and returns the factor, a float.
    at : sequence of float, optional
        Times (s) at which the function jumps or has a corner; empty if there are none. Integrators
        with adaptive steps end a step at each of these times. Without `at` they only sample the
        function within a step, and warn that a short pulse may be missed.

    Notes
    -----
    A function cannot be written to a file: results store its values at the stage times of the run.

    Examples
    --------
    >>> tap = Function(lambda t: max(0.0, 1.0 - abs(t - 0.3) / 0.01), at=[0.29, 0.3, 0.31])
    >>> tap.knots()
    (0.29, 0.3, 0.31)
    """

    function: Callable[[Any], Any]
    at: Annotated[Sequence[float] | None, Check(_times, unit="s")] = None
    kind: ClassVar[str] = "function"

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


def factor(history: History, time: float | None) -> float:
    """Factor at a time (s); if time is None, 1 for constant histories and 0 for all others."""
    return float(history.code == CONSTANT) if time is None else float(history(time))


def as_history(history: History | Callable[[Any], Any] | None) -> History:
    """History from None (constant), a history or any callable."""
    if history is None:
        return STEADY
    if isinstance(history, History):
        return history
    if isinstance(history, type) and issubclass(history, History):
        raise InputError(
            f" = {history.__name__}: give an object, as in {history.__name__}(...)", "history"
        )
    if callable(history):
        return Function(history)
    raise InputError(
        f" = {show(history)}: must be a history such as Pulse(duration=1.0), or a function of time",
        "history",
    )


STEADY = Constant()
