"""Frequency response from the motion after a pulse."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foldyn.dynamics.progress import Reporter
from foldyn.errors import InputError
from foldyn.linear.answer import Answer
from foldyn.linear.records import Record, check_records, record_of, smooth_history, transform
from foldyn.linear.time_domain import Integration, Rig
from foldyn.values import number

PER_PULSE = 10  # samples in the pulse
WIDTH = 0.5  # of a cycle of the highest frequency: the pulse
WEAK = 1.5  # cycles of a frequency in a pulse, from which it has next to no strength there
FEWEST = 4  # samples in the pulse
STILL = 8  # samples of rest before and after it, in which its spline dies away


@dataclass(frozen=True)
class Impulse(Integration):
    """Options of the impulse method, beside those of the integration.

    Parameters
    ----------
    pulse : float, optional
        Duration (s) of the pulse (1 - cos(2 pi t / pulse)) / 2, whose height is the drive. Without
        it half a cycle of the highest frequency, where it then still has 0.85 of its strength.
    duration : float, optional
        Time (s) to simulate. Without it until damping leaves 1e-5 of a motion; without alpha, the
        inverse of the frequencies' spacing.
    every : float, optional
        Largest sampling interval (s); a tenth of the pulse by default, at most a 20th of a cycle
        of the highest frequency.
    window_rate : float
        Decay rate (1/s) of an exponential window, for motions that have not died away at the end.
        It adds its damping to the response, which `peaks_of` takes off again.
    """

    pulse: float | None = None
    duration: float | None = None
    every: float | None = None
    window_rate: float = 0.0

    def __post_init__(self) -> None:
        """Check the arguments."""
        super().__post_init__()
        for name in ("pulse", "duration", "every"):
            if getattr(self, name) is not None:
                number(name, getattr(self, name), above=0.0)
        number("window_rate", self.window_rate, least=0.0)


def impulse(rig: Rig, frequency: NDArray, options: Impulse, report: Reporter) -> Answer:
    """Response to a pulse.

    Warns
    -----
    FoldynWarning
        The motion has not died away at the end.
    """
    width = WIDTH / float(frequency[-1])
    pulse = width if options.pulse is None else options.pulse
    every = min(pulse, width) / PER_PULSE if options.every is None else options.every
    record = record_of(frequency, rig.case.damping.alpha, 1.0, every, options.duration)
    check_records("duration", record, 1, len(rig.state))
    factor = _pulse(float(frequency[-1]), pulse, record)
    history = smooth_history(factor, record.every)
    _, response, _ = rig.run(history, record.duration, record.every, report)
    pushed = rig.drive.value * np.pad(factor, (0, record.length - len(factor)))
    found = transform(pushed[None], response[None], record, options.window_rate, "h1")
    facts = {
        "pulse": (len(factor) - 1 - 2 * STILL) * record.every,
        "record": record.duration,
        "every": record.every,
        "window_rate": options.window_rate,
        "left_at_end": found.left,
    }
    return Answer(found.response, {}, facts)


def _pulse(highest: float, pulse: float, record: Record) -> NDArray[np.float64]:
    """Samples of the pulse between two of rest."""
    if highest * pulse > WEAK:
        raise InputError(
            f"pulse = {pulse:g} s: has no strength left at {highest:g} Hz; take at most "
            f"{1.0 / highest:.3g} s, or lower frequencies"
        )
    count = round(pulse / record.every)
    if count < FEWEST:
        raise InputError(
            f" = {record.every:g} s: the pulse of {pulse:g} s has only {count} samples, and "
            f"at least {FEWEST} are needed; sample faster, or leave every out",
            "every",
        )
    if count + 2 * STILL >= record.samples:
        raise InputError(
            f"pulse = {pulse:g} s: does not end within the {record.duration:.3g} s of the motion; "
            "shorten it, or give a longer duration"
        )
    return np.pad(0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(count + 1) / count), STILL)
