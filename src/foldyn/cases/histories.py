"""The built-in histories, and the registry of all.

A new history needs a formula, a frozen dataclass with `kind`, `formulas` and `parameters`, and a
line in `HISTORIES`.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check, Flag
from foldyn.cases.csv_table import read_columns
from foldyn.cases.history import Constant, Formula, Waveform
from foldyn.errors import InputError
from foldyn.jit.compiled import inner_scalar
from foldyn.values import increasing, number, numbers, show

TABLE = 8  # code of tables
SHARP = 0.01  # deviation from a straight line at a sharp corner, relative to the table's range


@dataclass(frozen=True)
class _Lasting(Formula):
    """A history that begins at t = 0 and changes until `duration` (s)."""

    duration: Annotated[float, Check(number, above=0.0, unit="s")]

    def parameters(self) -> tuple[float, ...]:
        """See `History.parameters`."""
        return (self.duration,)

    def knots(self) -> tuple[float, ...]:
        """See `History.knots`."""
        return 0.0, self.duration


@inner_scalar
def pulse(t, duration):
    """See `Waveform`."""
    return (1.0 if 0.0 <= t < duration else 0.0), 0.0, 0.0


@dataclass(frozen=True)
class Pulse(_Lasting):
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

    kind: ClassVar[str] = "pulse"
    formulas = (Waveform(1, pulse),)

    def jumps(self) -> tuple[float, ...]:
        """See `History.jumps`."""
        return 0.0, self.duration


@inner_scalar
def half_sine(t, duration):
    """See `Waveform`."""
    if not 0.0 <= t < duration:
        return 0.0, 0.0, 0.0
    p = math.pi / duration
    s = math.sin(math.pi * t / duration)
    return s, p * math.cos(math.pi * t / duration), -p * p * s


@dataclass(frozen=True)
class HalfSine(_Lasting):
    """Factor sin(pi t / duration) for 0 <= t < duration, else 0.

    Parameters
    ----------
    duration : float
        Length of the pulse (s), greater than 0.
    """

    kind: ClassVar[str] = "half_sine"
    formulas = (Waveform(2, half_sine),)


@inner_scalar
def ramp(t, duration):
    """See `Waveform`."""
    rate = 1.0 / duration if 0.0 <= t < duration else 0.0
    return min(max(t / duration, 0.0), 1.0), rate, 0.0


@inner_scalar
def smooth_ramp(t, duration):
    """See `Waveform`."""
    x = min(max(t / duration, 0.0), 1.0)
    d = x * (1.0 - x)
    factor = x * x * x * (10.0 + x * (6.0 * x - 15.0))
    return factor, 30.0 * d * d / duration, 60.0 * d * (1.0 - 2.0 * x) / (duration * duration)


@dataclass(frozen=True)
class Ramp(_Lasting):
    """Factor t / duration, 0 before t = 0 and 1 from t = duration on.

    Parameters
    ----------
    duration : float
        Length of the rise (s), greater than 0.
    smooth : bool
        Whether the rise has continuous first and second derivatives, so that a motion starts and
        ends without a jolt: x^3 (10 - 15 x + 6 x^2) with x = t / duration.

    Examples
    --------
    >>> Ramp(duration=2.0)([0.5, 1.0, 3.0])
    array([0.25, 0.5 , 1.  ])
    >>> Ramp(duration=2.0, smooth=True)([0.5, 1.0, 3.0])
    array([0.10351562, 0.5       , 1.        ])
    """

    smooth: Flag = False
    kind: ClassVar[str] = "ramp"
    formulas = Waveform(3, ramp), Waveform(4, smooth_ramp)

    @property
    def code(self) -> int:  # type: ignore[override]
        """Code of the compiled formula."""
        return self.formulas[self.smooth].code


@inner_scalar
def step(t, begin):
    """See `Waveform`."""
    return (1.0 if t >= begin else 0.0), 0.0, 0.0


@dataclass(frozen=True)
class Step(Formula):
    """Factor 0 before `time`, 1 from then on.

    Parameters
    ----------
    time : float
        Time of the step (s).
    """

    time: Annotated[float, Check(number, unit="s")] = 0.0
    kind: ClassVar[str] = "step"
    formulas = (Waveform(5, step),)

    def parameters(self) -> tuple[float, ...]:
        """See `History.parameters`."""
        return (self.time,)

    def jumps(self) -> tuple[float, ...]:
        """See `History.jumps`."""
        return (self.time,)


@inner_scalar
def harmonic(t, frequency, phase):
    """See `Waveform`."""
    omega = 2.0 * math.pi * frequency
    s = math.sin(omega * t + phase)
    return s, omega * math.cos(omega * t + phase), -omega * omega * s


@dataclass(frozen=True)
class Harmonic(Formula):
    """Factor sin(2 pi frequency t + phase).

    Parameters
    ----------
    frequency : float
        Frequency (Hz), greater than 0.
    phase : float
        Phase at t = 0 (degrees).
    """

    frequency: Annotated[float, Check(number, above=0.0, unit="Hz")]
    phase: Annotated[float, Check(number, unit="degrees")] = 0.0
    kind: ClassVar[str] = "harmonic"
    formulas = (Waveform(6, harmonic),)

    def parameters(self) -> tuple[float, ...]:
        """See `History.parameters`."""
        return self.frequency, math.radians(self.phase)


@inner_scalar
def chirp(t, start, slope, phase, duration):
    """See `Waveform`; `slope` (Hz/s) is the rate of the frequency."""
    if not 0.0 <= t < duration:
        return 0.0, 0.0, 0.0
    angle = 2.0 * math.pi * ((start + 0.5 * slope * t) * t) + phase
    omega = 2.0 * math.pi * (start + slope * t)
    s, r = math.sin(angle), math.cos(angle)
    return s, omega * r, 2.0 * math.pi * slope * r - omega * omega * s


@dataclass(frozen=True)
class Chirp(Formula):
    """Factor sin(2 pi (f0 t + (f1 - f0) t^2 / (2 duration)) + phase), 0 <= t < duration.

    The frequency changes linearly from one to the other; before and after, the factor is 0.

    Parameters
    ----------
    from_frequency, to_frequency : float
        Frequencies f0 and f1 (Hz) at t = 0 and at t = duration, at least 0 and not both 0, in any
        order.
    duration : float
        Length of the sweep (s), greater than 0.
    phase : float
        Phase at t = 0 (degrees).

    Examples
    --------
    >>> sweep = Chirp(from_frequency=0.0, to_frequency=2.0, duration=1.0)
    >>> sweep([0.0, 0.5, 1.0]).round(12)
    array([0., 1., 0.])
    """

    from_frequency: Annotated[float, Check(number, least=0.0, unit="Hz")]
    to_frequency: Annotated[float, Check(number, least=0.0, unit="Hz")]
    duration: Annotated[float, Check(number, above=0.0, unit="s")]
    phase: Annotated[float, Check(number, unit="degrees")] = 0.0
    kind: ClassVar[str] = "chirp"
    formulas = (Waveform(7, chirp),)

    def agree(self) -> None:
        """Refuse a chirp that does not oscillate."""
        if self.from_frequency == self.to_frequency == 0.0:
            raise InputError(" = 0.0: this or from_frequency must be above 0", "to_frequency")

    def parameters(self) -> tuple[float, ...]:
        """See `History.parameters`."""
        slope = (self.to_frequency - self.from_frequency) / self.duration
        return self.from_frequency, slope, math.radians(self.phase), self.duration

    def jumps(self) -> tuple[float, ...]:
        """See `History.jumps`."""
        ends = (0.0, math.nextafter(self.duration, 0.0))
        return tuple(
            time for time, end in zip(self.knots(), ends, strict=True) if abs(self(end)) > 1e-9
        )

    def knots(self) -> tuple[float, ...]:
        """See `History.knots`."""
        return 0.0, self.duration


@dataclass(frozen=True, eq=False)
class Table(Formula):
    """Factors given at times, linear between them and constant outside.

    Parameters
    ----------
    times : array_like, shape (n,)
        Times (s), strictly increasing, n >= 2.
    values : array_like, shape (n,)
        Factors at these times.
    smooth : bool
        Whether to use a cubic spline through the values instead of straight lines: for measured
        displacements of supports, whose velocity must not jump at every value.
    """

    times: Annotated[Any, Check(increasing, unit="s")]
    values: Annotated[Any, Check(numbers)]
    smooth: Flag = False
    kind: ClassVar[str] = "table"
    formulas = (Waveform(TABLE, None),)

    def agree(self) -> None:
        """Refuse a single time, and numbers of times and values that differ."""
        times, values = self.times, self.values
        if times.size < 2:
            raise InputError(f" = {show(times)}: must be a list of at least two numbers", "times")
        if values.shape != times.shape:
            raise InputError(
                f" = {show(values)}: must be a list of as many numbers as times ({times.size})",
                "values",
            )

    @classmethod
    def from_csv(
        cls,
        path: str | os.PathLike[str],
        *,
        time: str | None = None,
        value: str | None = None,
        unit: str = "-",
        smooth: bool = False,
    ) -> Table:
        """Table from two columns of a CSV file; units are checked and converted.

        The file is a text in UTF-8: a line with the names of the columns and their units in
        brackets, such as ``time [ms],force [mN]``, then lines of numbers. Cells are separated by
        tabs if the header has one, else by semicolons if it has one, else by commas. Empty lines
        and lines that begin with # are skipped.

        Parameters
        ----------
        path : path
            The file.
        time, value : str, optional
            Headings of the two columns, with or without the unit; the first and the second column
            by default. The unit of the time is s, ms, us or min.
        unit : str
            Unit to convert the values to. The default "-" is a factor without unit, from a column
            with [-], [1], [%] or no unit. With "N", "mN" or "kN" the column must be a force: the
            load's vector is then a direction, (1, 0, 0) for a force along x. The same applies to
            "m", "cm", "mm" and to "m/s2", "mm/s2".
        smooth : bool
            See the class.

        Raises
        ------
        InputError
            The file cannot be read, a column is missing or ambiguous, a unit is missing, unknown
            or of another quantity, a cell is not a finite number, times do not increase, or there
            are fewer than two lines of numbers. The message names the file and the line.
        """
        return cls(*read_columns(path, time, value, unit), smooth)

    def polynomials(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """See `History.polynomials`."""
        from scipy.interpolate import CubicSpline

        cubics = np.zeros((len(self.times), 4))
        if self.smooth:
            cubics[:-1] = CubicSpline(self.times, self.values).c.T
        else:
            cubics[:-1, 2] = np.diff(self.values) / np.diff(self.times)
        cubics[:, 3] = self.values
        return self.times, cubics

    def knots(self) -> tuple[float, ...]:
        """See `History.knots`: both ends and sharp corners, not the points of a smooth curve."""
        sharp = np.ones(len(self.times), bool)
        sharp[1:-1] = False
        if not self.smooth:
            steps = np.diff(self.times)
            turn = np.abs(np.diff(np.diff(self.values) / steps))
            sharp[1:-1] = turn * np.minimum(steps[1:], steps[:-1]) > SHARP * np.ptp(self.values)
        return tuple(self.times[sharp].tolist())

    def __eq__(self, other: object) -> bool:
        """Whether the other is a table with the same numbers."""
        return self._key() == other._key() if isinstance(other, Table) else NotImplemented

    def __hash__(self) -> int:
        """Hash of the numbers."""
        return hash(self._key())

    def _key(self) -> tuple[bytes, bytes, bool]:
        return (self.times + 0.0).tobytes(), (self.values + 0.0).tobytes(), self.smooth  # no -0


HISTORIES: Mapping[str, type[Formula]] = {
    history.kind: history
    for history in (Constant, Pulse, HalfSine, Ramp, Step, Harmonic, Chirp, Table)
}
