"""Cycles of a vibration that is not a pure tone: their starts and durations.

The record is demodulated at its fundamental frequency f under a sliding Hann window of two periods,

    z(t) = 2 int w(s - t) x(s) exp(-2 pi i f s) ds / int w(s) ds,  w(s) = cos^2(pi f s/2),

whose spectrum is zero at f, 3 f/2, 2 f, ...: neither the mean, nor the image at -f, nor the
harmonics of f leak into the phase. The phase of z exp(2 pi i f t) is that of the
fundamental; a cycle ends when it has advanced by 2 pi, whatever the higher modes do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import fftconvolve

PERIODS = 2.0  # length of the window
PADDED = 8  # multiple of the record's length, zero-padded for the spectrum of the peak search
SETTLED = 1e-6  # the iteration stops at this relative change of the frequency
ROUNDS = 30


class NoCyclesError(ValueError):
    """A record too short, or without an oscillation in the band."""


@dataclass(frozen=True, eq=False)
class Cycles:
    """Cycles of the fundamental of a record.

    Attributes
    ----------
    extreme : (2 k + 1,)
        Times (s) of the fundamental's extremes: starts, middles and ends of cycles.
    period : (k,)
        Periods, s: from an extreme to the next but one.
    share : float
        The fundamental's share of the record's variance about its moving mean.
    """

    extreme: NDArray
    share: float

    @property
    def period(self) -> NDArray:
        """Periods (k,), s."""
        return np.diff(self.extreme[::2])


def fundamental(x: NDArray, dt: float, low: float, high: float) -> float:
    """Frequency (Hz) of the highest peak in the spectrum of a record (n,) within a band."""
    n = PADDED * len(x)
    height = np.abs(np.fft.rfft((x - x.mean()) * np.hanning(len(x)), n))
    frequency = np.fft.rfftfreq(n, dt)
    inside = np.flatnonzero((frequency >= low) & (frequency <= high))
    if not len(inside):
        raise NoCyclesError(f"no frequency between {low:g} and {high:g} Hz in this record")
    return float(frequency[inside[np.argmax(height[inside])]])


def demodulated(x: NDArray, dt: float, f: float) -> tuple[NDArray, NDArray]:
    """The fundamental z exp(2 pi i f t) of a record (n,), and its moving mean, (m,) each.

    They exist for samples whose windows lie within the record: all except equal numbers at both
    ends.
    """
    half = int(PERIODS / (2.0 * f * dt))
    window = np.cos(np.pi * f * dt * np.arange(-half, half + 1) / PERIODS) ** 2
    window /= window.sum()
    if len(x) < 2 * half + 2:
        raise NoCyclesError("the record is shorter than two periods")
    tone = np.exp(-2j * np.pi * f * dt * np.arange(len(x)))
    inside = slice(half, len(x) - half)
    z = 2.0 * fftconvolve((x - x.mean()) * tone, window, "valid")
    mean = fftconvolve(x - x.mean(), window, "valid")
    return z * tone[inside].conj(), mean + x.mean()


def phase(x: NDArray, dt: float, low: float, high: float) -> tuple[NDArray, NDArray, float]:
    """Times (m,) from the first sample, the fundamental's phase (m,), rad, and its share.

    The demodulation frequency equals the mean frequency of the resulting phase.

    Parameters
    ----------
    x : (n,)
        Record.
    dt : float
        Sampling interval, s.
    low, high : float
        Band (Hz) in which the fundamental is sought.

    Raises
    ------
    NoCyclesError
        No oscillation in the band, or too short a one.
    """
    f = fundamental(x, dt, low, high)
    for _ in range(ROUNDS):
        tone, mean = demodulated(x, dt, f)
        angle = np.unwrap(np.angle(tone))
        last, f = f, float((angle[-1] - angle[0]) / (2.0 * np.pi * dt * (len(angle) - 1)))
        if not low / 2.0 < f < 2.0 * high:
            raise NoCyclesError("the phase of the fundamental does not advance evenly")
        if abs(f - last) < SETTLED * f:
            break
    skipped = (len(x) - len(tone)) // 2
    about = x[skipped : skipped + len(tone)] - mean
    share = 1.0 - np.var(about - np.real(tone)) / np.var(about)
    return dt * (skipped + np.arange(len(tone))), angle, float(share)


def cycles(x: NDArray, dt: float, low: float, high: float, released: bool = False) -> Cycles:
    """Cycles of a record.

    Parameters
    ----------
    x, dt, low, high
        As in `phase`.
    released : bool
        The record starts from rest without loads, and nothing is damped: then it is even in time,
        x(-t) = x(t), so that the first cycles are complete.
    """
    if released:
        time, angle, share = phase(np.concatenate([x[:0:-1], x]), dt, low, high)
        time = time - dt * (len(x) - 1)
        angle = angle - angle[np.argmin(np.abs(time))]
        first = 0
    else:
        time, angle, share = phase(x, dt, low, high)
        angle = angle - 2.0 * np.pi * np.floor(angle[0] / (2.0 * np.pi))
        first = 2
    if np.any(np.diff(angle) <= 0.0):
        raise NoCyclesError("the phase of the fundamental runs backwards")
    last = int(angle[-1] // np.pi)
    if last < first + 2:
        raise NoCyclesError("not one cycle is whole")
    turns = np.arange(first, last + 1 - (last - first) % 2)
    return Cycles(np.interp(np.pi * turns, angle, time), share)
