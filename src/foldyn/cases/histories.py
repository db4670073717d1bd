"""The built-in histories but tables, and the registry of all.

To add one: its formula in `waveforms`, a frozen dataclass with `kind`, `code` and `parameters`,
and its line in `HISTORIES`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from foldyn.cases import waveforms
from foldyn.cases.history import Formula, History, check_flag, set_field
from foldyn.cases.table import Table
from foldyn.errors import InputError
from foldyn.values import number

__all__ = [
    "HISTORIES", "Chirp", "Constant", "HalfSine", "Harmonic", "History", "Pulse", "Ramp", "Step",
    "Table",
]  # fmt: skip


@dataclass(frozen=True)
class Constant(Formula):
    """Factor 1 at all times."""

    kind: ClassVar[str] = "constant"
    code: ClassVar[int] = waveforms.CONSTANT


@dataclass(frozen=True)
class Pulse(Formula):
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
    code: ClassVar[int] = waveforms.PULSE

    def __post_init__(self) -> None:
        """Check the arguments."""
        set_field(self, "duration", number("duration", self.duration, above=0.0))

    def parameters(self) -> tuple[float, ...]:
        """See `History.parameters`."""
        return (self.duration,)

    def jumps(self) -> tuple[float, ...]:
        """See `History.jumps`."""
        return 0.0, self.duration


@dataclass(frozen=True)
class HalfSine(Formula):
    """Factor sin(pi t / duration) for 0 <= t < duration, else 0.

    Parameters
    ----------
    duration : float
        Length of the pulse (s), greater than 0.
    """

    duration: float
    kind: ClassVar[str] = "half_sine"
    code: ClassVar[int] = waveforms.HALF_SINE

    def __post_init__(self) -> None:
        """Check the arguments."""
        set_field(self, "duration", number("duration", self.duration, above=0.0))

    def parameters(self) -> tuple[float, ...]:
        """See `History.parameters`."""
        return (self.duration,)

    def knots(self) -> tuple[float, ...]:
        """See `History.knots`."""
        return 0.0, self.duration


@dataclass(frozen=True)
class Ramp(Formula):
    """Factor t / duration, held at 0 before t = 0 and at 1 from t = duration on.

    Parameters
    ----------
    duration : float
        Length of the rise (s), greater than 0.
    smooth : bool
        Rise without a jump of the first two derivatives: x^3 (10 - 15 x + 6 x^2) with
        x = t / duration. The smooth ramp starts and ends a motion without a jolt.

    Examples
    --------
    >>> Ramp(duration=2.0)([0.5, 1.0, 3.0])
    array([0.25, 0.5 , 1.  ])
    >>> Ramp(duration=2.0, smooth=True)([0.5, 1.0, 3.0])
    array([0.10351562, 0.5       , 1.        ])
    """

    duration: float
    smooth: bool = False
    kind: ClassVar[str] = "ramp"

    def __post_init__(self) -> None:
        """Check the arguments."""
        set_field(self, "duration", number("duration", self.duration, above=0.0))
        check_flag("smooth", self.smooth)

    @property
    def code(self) -> int:  # type: ignore[override]
        """Code of the compiled formula."""
        return waveforms.SMOOTH_RAMP if self.smooth else waveforms.RAMP

    def parameters(self) -> tuple[float, ...]:
        """See `History.parameters`."""
        return (self.duration,)

    def knots(self) -> tuple[float, ...]:
        """See `History.knots`."""
        return 0.0, self.duration


@dataclass(frozen=True)
class Step(Formula):
    """Factor 0 before `time`, 1 from then on.

    Parameters
    ----------
    time : float
        Time of the step (s).
    """

    time: float = 0.0
    kind: ClassVar[str] = "step"
    code: ClassVar[int] = waveforms.STEP

    def __post_init__(self) -> None:
        """Check the arguments."""
        set_field(self, "time", number("time", self.time))

    def parameters(self) -> tuple[float, ...]:
        """See `History.parameters`."""
        return (self.time,)

    def jumps(self) -> tuple[float, ...]:
        """See `History.jumps`."""
        return (self.time,)


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

    frequency: float
    phase: float = 0.0
    kind: ClassVar[str] = "harmonic"
    code: ClassVar[int] = waveforms.HARMONIC

    def __post_init__(self) -> None:
        """Check the arguments."""
        set_field(self, "frequency", number("frequency", self.frequency, above=0.0))
        set_field(self, "phase", number("phase", self.phase))

    def parameters(self) -> tuple[float, ...]:
        """See `History.parameters`."""
        return self.frequency, math.radians(self.phase)


@dataclass(frozen=True)
class Chirp(Formula):
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
    code: ClassVar[int] = waveforms.CHIRP

    def __post_init__(self) -> None:
        """Check the arguments."""
        for name in ("start", "end"):
            set_field(self, name, number(name, getattr(self, name), least=0.0))
        if self.start == self.end == 0.0:
            raise InputError(f"end = {self.end}: start or end must be greater than 0")
        set_field(self, "duration", number("duration", self.duration, above=0.0))
        set_field(self, "phase", number("phase", self.phase))

    def parameters(self) -> tuple[float, ...]:
        """See `History.parameters`."""
        slope = (self.end - self.start) / self.duration
        return self.start, slope, math.radians(self.phase), self.duration

    def jumps(self) -> tuple[float, ...]:
        """See `History.jumps`."""
        ends = (0.0, math.nextafter(self.duration, 0.0))
        return tuple(
            time
            for time, end in zip((0.0, self.duration), ends, strict=True)
            if abs(self(end)) > 1e-9
        )

    def knots(self) -> tuple[float, ...]:
        """See `History.knots`."""
        return 0.0, self.duration


HISTORIES: Mapping[str, type[History]] = {
    history.kind: history
    for history in (Constant, Pulse, HalfSine, Ramp, Step, Harmonic, Chirp, Table)
}
