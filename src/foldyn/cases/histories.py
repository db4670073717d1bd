"""Histories: how a load varies in time, as a factor of time.

A history is called with times (s), a number or an array of any shape, and gives factors of the
same shape. To add one: a frozen dataclass with `kind` and `factor`, and its line in `HISTORIES`.
"""

from __future__ import annotations

import math
import os
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.cases.csv_table import read_columns
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


@dataclass(frozen=True)
class Chirp(History):
    """Factor sin(2 pi (start t + (end - start) t^2 / (2 duration)) + phase), 0 <= t < duration.

    The frequency goes from `start` to `end` in a straight line; before and after, the factor is 0.

    Parameters
    ----------
    start, end : float
        Frequency (Hz) at t = 0 and at t = duration, at least 0, not both 0; `end` may be the lower.
    duration : float
        Length of the sweep (s), greater than 0.
    phase : float
        Phase at t = 0 (degrees).

    Examples
    --------
    >>> sweep = Chirp(start=0.0, end=2.0, duration=1.0)
    >>> sweep([0.0, 0.5, 1.0]).round(12)
    array([0., 1., 0.])
    """

    start: float
    end: float
    duration: float
    phase: float = 0.0
    kind: ClassVar[str] = "chirp"

    def __post_init__(self) -> None:
        """Check the arguments."""
        for name in ("start", "end"):
            _set(self, name, number(name, getattr(self, name), least=0.0))
        if self.start == self.end == 0.0:
            raise InputError(f"end = {self.end}: start or end must be greater than 0")
        _set(self, "duration", number("duration", self.duration, above=0.0))
        _set(self, "phase", number("phase", self.phase))

    def factor(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `History.factor`."""
        inside = (time >= 0.0) & (time < self.duration)
        slope = (self.end - self.start) / self.duration
        turns = (self.start + 0.5 * slope * time) * time
        return np.where(inside, np.sin(2.0 * np.pi * turns + math.radians(self.phase)), 0.0)


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

    @classmethod
    def from_csv(
        cls,
        path: str | os.PathLike[str],
        time: str | None = None,
        value: str | None = None,
        unit: str = "-",
    ) -> Table:
        """Table from two columns of a CSV file, whose units are checked and converted.

        The file is a text in UTF-8: a line with the names of the columns and their units in
        brackets, as in ``time [ms],force [mN]``, then lines of numbers. Cells are separated by
        tabs, semicolons or commas, whichever of these the header has first in this order. Empty
        lines and lines that begin with # are skipped.

        Parameters
        ----------
        path : path
            The file.
        time, value : str, optional
            Headings of the two columns, with or without the unit; the first and the second column
            by default. The unit of the time is s, ms, us or min.
        unit : str
            What the values become. The default "-" is a factor without unit, from a column with
            [-], [1], [%] or no unit. With "N", "mN" or "kN" the column must be a force in one of
            these and is converted: the load's vector is then a direction, (1, 0, 0) for a force
            along x. Likewise "m", "cm", "mm" and "m/s2", "mm/s2".

        Raises
        ------
        InputError
            The file cannot be read, a column is missing or ambiguous, a unit is missing, unknown
            or of another quantity, a cell is not a finite number, times do not increase, or there
            are fewer than two lines of numbers. The message names the file and the line.
        """
        return cls(*read_columns(path, time, value, unit))

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


HISTORIES: Mapping[str, type[History]] = {
    history.kind: history
    for history in (Constant, Pulse, HalfSine, Ramp, Step, Harmonic, Chirp, Table)
}


def _set(instance: Any, name: str, value: Any) -> None:
    object.__setattr__(instance, name, value)  # the dataclasses are frozen
