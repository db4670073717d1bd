"""Uniform sampling: is a record evenly spaced, and at which interval."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from foldyn.errors import InputError

# Times written as n*dt are rounded in proportion to their own size, so the slack of an interval is
# a fraction of the interval plus a few units in the last place of the largest time.
_RELATIVE_SLACK = 1e-6
_ROUNDING_UNITS = 8.0


def is_uniform(time: ArrayLike, rtol: float = _RELATIVE_SLACK) -> bool:
    """Tell whether sample times are evenly spaced and increasing.

    Parameters
    ----------
    time : array_like, shape (n,)
        Sample times (s).
    rtol : float
        Allowed deviation of any sample from the even grid between the first and the last one,
        as a fraction of the mean interval.

    Returns
    -------
    bool
        False also for fewer than two samples, for NaN and infinity, and for anything that is not
        one-dimensional.
    """
    t = np.asarray(time, dtype=np.float64)
    if t.ndim != 1 or t.size < 2 or not np.isfinite(t).all():
        return False
    step = (t[-1] - t[0]) / (t.size - 1)
    if step <= 0.0:
        return False
    # Compared with the grid and not step by step: rounding then does not add up, drift shows.
    grid = t[0] + step * np.arange(t.size)
    slack = rtol * step + _ROUNDING_UNITS * np.finfo(np.float64).eps * np.abs(t).max()
    return bool(np.abs(t - grid).max() <= min(slack, 0.5 * step))


def sampling_interval(time: ArrayLike) -> float:
    """Return the interval of evenly spaced sample times.

    Parameters
    ----------
    time : array_like, shape (n,)
        Sample times (s), n >= 2.

    Returns
    -------
    float
        Mean interval (s).

    Raises
    ------
    InputError
        Where the times are not evenly spaced and increasing.
    """
    t = np.asarray(time, dtype=np.float64)
    if t.ndim != 1 or t.size < 2:
        raise InputError(
            f"time: shape {t.shape} has no sampling interval; give at least two times in one row"
        )
    if not is_uniform(t):
        if not np.isfinite(t).all():
            where = int(np.flatnonzero(~np.isfinite(t))[0])
            raise InputError(f"time: sample {where} is {t[where]}; every time must be finite")
        steps = np.diff(t)
        raise InputError(
            f"time: samples are not evenly spaced (intervals from {steps.min():.6g} to "
            f"{steps.max():.6g} s); store at a fixed interval, or resample before a spectrum"
        )
    return float((t[-1] - t[0]) / (t.size - 1))
