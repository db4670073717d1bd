"""Histories: how a load varies in time, as a factor of time.

A history is called with times (s), a number or an array of any shape, and gives factors of the
same shape. To add one: a frozen dataclass with `kind` and `factor`, and its line in `HISTORIES`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.cases.values import number, numbers, show
from foldyn.errors import InputError


class History(ABC):
    """A factor of time.

    A subclass computes `factor` for an array of times (s) and, as a frozen dataclass, compares
    equal to another with the same arguments: loads with equal histories are summed.
    """

    kind: ClassVar[str]

    @abstractmethod
    def factor(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Factors at an array of times (s), of the same shape."""

    def __call__(self, time: ArrayLike) -> Any:
        """Factor at each time (s): a float for a number, else an array of the same shape."""
        times = np.asarray(time, dtype=np.float64)
        factors = self.factor(times)
        return factors if times.ndim else float(factors)


@dataclass(frozen=True)
class Constant(History):
    """Factor 1 at all times."""

    kind: ClassVar[str] = "constant"

    def factor(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `History.factor`."""
        return np.ones_like(time)


@dataclass(frozen=True)
class Pulse(History):
    """Factor 1 for 0 <= t < duration, else 0.

    Parameters
    ----------
    duration : float
        Length of the pulse (s), greater than 0.

    Examples
    --------
    >>> Pulse(duration=0.5)([0.0, 0.4, 0.5])
    array([1., 1., 0.])
    """

    duration: float
    kind: ClassVar[str] = "pulse"

    def __post_init__(self) -> None:
        """Check the arguments."""
        _set(self, "duration", number("duration", self.duration, above=0.0))

    def factor(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `History.factor`."""
        return np.where((time >= 0.0) & (time < self.duration), 1.0, 0.0)


@dataclass(frozen=True)
class HalfSine(History):
    """Factor sin(pi t / duration) for 0 <= t < duration, else 0.

    Parameters
    ----------
    duration : float
        Length of the pulse (s), greater than 0.
    """

    duration: float
    kind: ClassVar[str] = "half_sine"

    def __post_init__(self) -> None:
        """Check the arguments."""
        _set(self, "duration", number("duration", self.duration, above=0.0))

    def factor(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `History.factor`."""
        inside = (time >= 0.0) & (time < self.duration)
        return np.where(inside, np.sin(np.pi * time / self.duration), 0.0)


@dataclass(frozen=True)
class Ramp(History):
    """Factor t / duration, held at 0 before t = 0 and at 1 from t = duration on.

    Parameters
    ----------
    duration : float
        Length of the rise (s), greater than 0.
    """

    duration: float
    kind: ClassVar[str] = "ramp"

    def __post_init__(self) -> None:
        """Check the arguments."""
        _set(self, "duration", number("duration", self.duration, above=0.0))

    def factor(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `History.factor`."""
        return np.clip(time / self.duration, 0.0, 1.0)


@dataclass(frozen=True)
class Step(History):
    """Factor 0 before `time`, 1 from then on.

    Parameters
    ----------
    time : float
        Time of the step (s).
    """

    time: float = 0.0
    kind: ClassVar[str] = "step"

    def __post_init__(self) -> None:
        """Check the arguments."""
        _set(self, "time", number("time", self.time))

    def factor(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `History.factor`."""
        return np.where(time >= self.time, 1.0, 0.0)


@dataclass(frozen=True)
class Harmonic(History):
    """Factor sin(2 pi frequency t + phase).

    Parameters
    ----------
    frequency : float
        Frequency (Hz), greater than 0.
    phase : float
        Phase at t = 0 (degrees).
    """

    frequency: float
    phase: float = 0.0
    kind: ClassVar[str] = "harmonic"

    def __post_init__(self) -> None:
        """Check the arguments."""
        _set(self, "frequency", number("frequency", self.frequency, above=0.0))
        _set(self, "phase", number("phase", self.phase))

    def factor(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `History.factor`."""
        return np.sin(2.0 * np.pi * self.frequency * time + math.radians(self.phase))


@dataclass(frozen=True, eq=False)
class Table(History):
    """Factors given at times, linear between them, the first and the last held outside.

    Parameters
    ----------
    times : array_like, shape (n,)
        Times (s), strictly increasing, n >= 2.
    values : array_like, shape (n,)
        Factors at these times.
    """

    times: Any
    values: Any
    kind: ClassVar[str] = "table"

    def __post_init__(self) -> None:
        """Check the arguments."""
        times, values = numbers("times", self.times), numbers("values", self.values)
        if times.ndim != 1 or times.size < 2:
            raise InputError(f"times = {show(self.times)}: must be a list of at least two numbers")
        if values.shape != times.shape:
            raise InputError(
                f"values = {show(self.values)}: must be a list of as many numbers as times "
                f"({times.size})"
            )
        back = np.flatnonzero(np.diff(times) <= 0.0)
        if back.size:
            i = int(back[0]) + 1
            raise InputError(
                f"times[{i}] = {times[i]}: must be greater than the time before it ({times[i - 1]})"
            )
        _set(self, "times", times)
        _set(self, "values", values)

    def factor(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `History.factor`."""
        return np.asarray(np.interp(time, self.times, self.values))

    def __eq__(self, other: object) -> bool:
        """Tell whether the other is a table of the same numbers."""
        if not isinstance(other, Table):
            return NotImplemented
        return np.array_equal(self.times, other.times) and np.array_equal(self.values, other.values)

    def __hash__(self) -> int:
        """Hash of the numbers."""
        return hash((self.times.tobytes(), self.values.tobytes()))


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
        return factors if factors.shape == time.shape else None

    def _at(self, time: float) -> float:
        value = self.function(time)
        try:
            return float(value)
        except (TypeError, ValueError):
            raise InputError(
                f"history {self._name} gives {show(value)} at t = {time} s: must be a number"
            ) from None

    @property
    def _name(self) -> str:
        return getattr(self.function, "__name__", repr(self.function))


HISTORIES: Mapping[str, type[History]] = {
    history.kind: history for history in (Constant, Pulse, HalfSine, Ramp, Step, Harmonic, Table)
}


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


def _set(instance: Any, name: str, value: Any) -> None:
    object.__setattr__(instance, name, value)  # the dataclasses are frozen
