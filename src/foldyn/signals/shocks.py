"""Shock response spectra: the largest accelerations of oscillators on a base that is shaken."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.arguments import Unit, brief
from foldyn.errors import InputError
from foldyn.signals.records import checked_interval, checked_record, real_array
from foldyn.values import number

PER_PERIOD = 100  # samples in a period: a peak between two of them is missed by 0.05 % at most
FEWEST = 2


@brief
@dataclass(frozen=True)
class ShockSpectrum:
    """Largest absolute accelerations of oscillators with one degree of freedom.

    Attributes
    ----------
    frequency : (k,)
        Natural frequencies without damping, Hz.
    positive, negative : (k,)
        Largest accelerations in both directions, both 0 or more, in the unit of the record, while
        the base is shaken and after that.
    residual : (k,)
        Largest magnitude after the end of the record.
    """

    frequency: Annotated[NDArray[np.float64], Unit("Hz")]
    positive: NDArray[np.float64]
    negative: NDArray[np.float64]
    residual: NDArray[np.float64]

    @property
    def maximax(self) -> NDArray[np.float64]:
        """Largest magnitudes (k,)."""
        return np.maximum(self.positive, self.negative)


def shock_spectrum(
    acceleration: ArrayLike, dt: float, *, frequency: ArrayLike, damping_ratio: float = 0.05
) -> ShockSpectrum:
    """Shock response spectrum of a base acceleration.

    Between its samples the record is a straight line, for which the steps are exact (ramp
    invariant; Smallwood, Shock Vib. Bull. 51, 1981; ISO 18431-4). After its end the base moves on
    without acceleration.

    Parameters
    ----------
    acceleration : (n,)
        Acceleration of the base, which is at rest before the first sample; m/s2 or any other unit.
    dt : float
        Sampling interval, s.
    frequency : array_like
        Natural frequencies, Hz, above 0.
    damping_ratio : float, default 0.05
        From 0 to below 1; 0.05 is the amplification Q = 10.

    Raises
    ------
    InputError
        Samples that are not finite, a frequency or damping ratio out of range.

    Examples
    --------
    A half sine of 11 ms, as in a standard shock test:

    >>> import numpy as np
    >>> from foldyn.signals import shock_spectrum
    >>> pulse = np.sin(np.linspace(0.0, np.pi, 111))
    >>> shock_spectrum(pulse, 1e-4, frequency=[20.0, 75.0, 2000.0]).maximax.round(2).tolist()
    [0.78, 1.65, 1.0]
    """
    record = checked_record("acceleration", acceleration, FEWEST)
    dt = checked_interval(dt)
    natural = np.atleast_1d(real_array("frequency", frequency))
    if natural.ndim != 1 or not len(natural) or natural.min() <= 0.0:
        raise InputError(": give a list of frequencies (Hz) above 0", "frequency")
    zeta = number("damping_ratio", damping_ratio, least=0.0)
    if zeta >= 1.0:
        raise InputError(f" = {zeta:g}: must be below 1, or nothing vibrates", "damping_ratio")
    found = np.array([_largest(record, dt, f, zeta) for f in natural.tolist()])
    return ShockSpectrum(natural, *found.T)


def _largest(record: NDArray, dt: float, f: float, zeta: float) -> tuple[float, float, float]:
    """Largest acceleration in both directions, and of both after the record."""
    from scipy.signal import lfilter  # slow to import, and seldom needed

    parts = max(1, int(np.ceil(PER_PERIOD * f * dt)))
    fine = np.arange((len(record) - 1) * parts + 1) / parts
    base = np.interp(fine, np.arange(len(record)), record)
    h, wait = dt / parts, int(np.ceil(1.0 / (f * dt / parts))) + 1
    # before and after, the base has no acceleration: it comes and goes within a step
    base = np.concatenate([[0.0], base, np.zeros(wait)])
    turn = 2.0 * np.pi * f * h
    decay, swing = np.exp(-zeta * turn), turn * np.sqrt(1.0 - zeta**2)
    c, s = decay * np.cos(swing), decay * np.sin(swing) / swing
    rising, falling = [1.0 - s, 2.0 * (s - c), decay**2 - s], [1.0, -2.0 * c, decay**2]
    moved = lfilter(rising, falling, base)
    after = np.abs(moved[len(fine) + 1 :]).max()
    return max(moved.max(), 0.0), max(-moved.min(), 0.0), after
