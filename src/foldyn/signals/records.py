"""Checks of records, sampling, windows and curves that all estimators share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.values import number

Window: TypeAlias = str | tuple | ArrayLike | None

# order of the time derivative of displacement in each kind of response per force
DERIVATIVES: dict[str, int] = {"receptance": 0, "mobility": 1, "accelerance": 2}
DETRENDS = (None, "constant", "linear")

# Times computed as n*dt have rounding errors in proportion to their size. So the tolerance of an
# interval is a fraction of the interval plus a few units in the last place of the largest time.
_RELATIVE_SLACK = 1e-6
_ROUNDING_UNITS = 8.0


def real_numbers(name: str, x: ArrayLike) -> NDArray[np.float64]:
    """Return `x` as float64 numbers."""
    try:
        values = np.asarray(x)
        if not np.iscomplexobj(values):
            return values.astype(np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{name}: not an array of numbers ({error})") from error
    raise InputError(f"{name}: complex samples; a real record is needed here")


def finite(name: str, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return `values`, with time along axis 0; raises an error if any value is not finite."""
    bad = ~np.isfinite(values)
    if bad.any():
        raise InputError(
            f"{name}: {int(bad.sum())} samples are NaN or infinite, the first at index "
            f"{_first(bad)}; cut the record or fill the gap first"
        )
    return values


def real_array(name: str, x: ArrayLike) -> NDArray[np.float64]:
    """Return `x` as finite float64 numbers."""
    return finite(name, real_numbers(name, x))


def checked_record(name: str, x: ArrayLike, fewest: int) -> NDArray[np.float64]:
    """Return one real record, shape (n,) with n >= fewest."""
    samples = real_array(name, x)
    if samples.ndim != 1:
        raise InputError(f"{name}: shape {samples.shape}; give one record, shape (n,)")
    if samples.size < fewest:
        raise InputError(f"{name}: {samples.size} samples; at least {fewest} are needed")
    return samples


def checked_interval(dt: float) -> float:
    """Return the sampling interval as a positive float."""
    if isinstance(dt, Sequence) or np.ndim(dt):
        raise InputError("dt: is not one number; for sample times use signals.sampling_interval")
    return number("dt", dt, above=0.0)


def checked_window(window: Window, n: int) -> NDArray[np.float64]:
    """Return the n samples of a window, given by name or as samples; None is a window of ones."""
    if window is None:
        return np.ones(n)
    if isinstance(window, str | tuple):
        try:
            from scipy.signal import get_window  # slow to import, and seldom needed

            weights = np.asarray(get_window(window, n), dtype=np.float64)
        except (ValueError, TypeError) as error:
            raise InputError(f"window: {window!r} is not known to scipy ({error})") from error
    else:
        weights = np.asarray(window, dtype=np.float64)
        if weights.shape != (n,):
            raise InputError(f"window: shape {weights.shape}, but the record has {n} samples")
    if not np.isfinite(weights).all() or weights.sum() <= 0.0:
        raise InputError("window: its samples must be finite and their sum positive")
    return weights


def detrended(x: NDArray[np.float64], kind: str | None) -> NDArray[np.float64]:
    """Return `x` minus its mean ("constant") or line of best fit ("linear"), by columns."""
    if kind not in DETRENDS:
        raise InputError(f'detrend: {kind!r} is unknown; use None, "constant" or "linear"')
    if kind is None:
        return x
    from scipy.signal import detrend  # slow to import, and seldom needed

    return detrend(x, axis=0, type=kind)


def checked_frequencies(frequency: ArrayLike, fewest: int) -> NDArray[np.float64]:
    """Return frequencies (Hz) after checks: at least `fewest`, increasing and not negative."""
    f = real_array("frequency", frequency)
    if f.ndim != 1 or f.size < fewest:
        raise InputError(f"frequency: shape {f.shape}; give at least {fewest} frequencies")
    if f[0] < 0.0 or (np.diff(f) <= 0.0).any():
        raise InputError("frequency: must increase from 0 Hz or more; sort it and drop doubles")
    return f


def checked_curve(
    name: str, values: ArrayLike, frequency: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """Return a complex curve with a finite value at each frequency."""
    try:
        curve = np.asarray(values).astype(np.complex128)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name}: not an array of numbers ({error})") from error
    if curve.shape != frequency.shape:
        raise InputError(
            f"{name}: shape {curve.shape}, but there are {frequency.size} frequencies; "
            "give one curve at a time"
        )
    bad = ~np.isfinite(curve)
    if bad.any():
        raise InputError(
            f"{name}: {int(bad.sum())} values are NaN or infinite, the first at "
            f"{frequency[_first(bad)]:g} Hz; cut the curve to the band that was excited"
        )
    return curve


def _first(bad: NDArray[np.bool_]) -> int:
    """Index of the first bad value along the first axis."""
    return int(np.argwhere(np.atleast_1d(bad))[0][0])


def beside(row: NDArray, other: NDArray) -> NDArray:
    """Reshape `row` to multiply `other`, an array with the same first axis and further axes."""
    return row.reshape(row.shape + (1,) * (other.ndim - 1))


def is_uniform(time: ArrayLike, rtol: float = _RELATIVE_SLACK) -> bool:
    """Return whether sample times are evenly spaced and increasing.

    Parameters
    ----------
    time : array_like, shape (n,)
        Sample times (s).
    rtol : float
        Allowed deviation of a sample from the even grid between the first and the last sample, as a
        fraction of the mean interval.

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
    # compared with a grid, not step by step: rounding does not add up, and a drift shows
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
        The times are not evenly spaced and increasing.
    """
    t = np.asarray(time, dtype=np.float64)
    if t.ndim != 1 or t.size < 2:
        raise InputError(f"time: shape {t.shape}: give at least two times in one row")
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
