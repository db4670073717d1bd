"""Exponential window: a known damping added to records, and taken off again."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.signals.records import checked_count, checked_interval, checked_number, real_array


def exponential_window(n: int, dt: float, rate: float) -> NDArray[np.float64]:
    """Window exp(-rate t) for records that have not died away at their end.

    On force and response alike it moves every pole by -rate along the real axis, exactly: what
    is then estimated is H(i w + rate). `without_window` takes the added damping off again.

    Parameters
    ----------
    n : int
        Samples of the record or segment.
    dt : float
        Sampling interval (s).
    rate : float
        Decay rate (1/s), greater than 0; 4.6 / (n dt) leaves 1 % at the end.

    Returns
    -------
    ndarray, shape (n,)
        The window, 1 at its start.
    """
    rate = checked_number("rate", rate, above=0.0)
    return np.exp(-rate * checked_interval(dt) * np.arange(checked_count("n", n)))


def without_window(
    frequency: ArrayLike, damping_ratio: ArrayLike, rate: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Natural frequencies and damping ratios without the damping of an exponential window.

    The damped frequency stays, and the real part of the pole moves: -z w + rate.

    Parameters
    ----------
    frequency, damping_ratio : array_like
        Natural frequencies w / (2 pi) (Hz) and damping ratios z < 1, as estimated.
    rate : float
        The window's decay rate (1/s).

    Returns
    -------
    frequency, damping_ratio : ndarray
        Those of the system; a damping ratio below 0 is more noise than damping.

    Examples
    --------
    >>> frequency, damping_ratio = without_window(10.0, 0.05, rate=2.0)
    >>> print(f"{frequency:.4f} {damping_ratio:.6f}")
    9.9891 0.018189
    """
    rate = checked_number("rate", rate, above=0.0)
    natural = 2.0 * np.pi * real_array("frequency", frequency)
    damping = real_array("damping_ratio", damping_ratio)
    if (np.abs(damping) >= 1.0).any():
        raise InputError("damping_ratio: must be below 1: an oscillating mode is meant")
    real, imaginary = rate - damping * natural, natural * np.sqrt(1.0 - damping**2)
    size = np.hypot(real, imaginary)
    return size / (2.0 * np.pi), -real / size
