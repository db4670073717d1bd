"""From a measured history to a free vibration: gaps, window, start, rest position and trend.

The functions are the steps, in order, that Herkal, Nagarajaiah and Paulino (Dynamic Behavior of
Origami Structures: Computational and Experimental Study) take between camera tracking and spectra.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.signals import records
from foldyn.values import number, whole

_FEWEST = 4


def fill_gaps(x: ArrayLike, longest: int = 5) -> NDArray[np.float64]:
    """Fill short gaps (NaN) of a record by interpolation.

    Uses a cubic spline, which reproduces a vibration with at least eight samples per period. A
    longer gap is an error, since data that were not measured must not be invented.

    Parameters
    ----------
    x : array_like, shape (n,)
    longest : int
        Largest number of samples in a gap.

    Raises
    ------
    InputError
        A gap is longer, or lies at an end of the record: cut the record at the gap.
    """
    values = records.real_numbers("x", x)
    most = whole("longest", longest, least=1)
    known = np.isfinite(values)
    if values.ndim != 1 or known.sum() < _FEWEST:
        raise InputError(
            f"x: shape {values.shape} with {int(known.sum())} known samples; give one record with "
            f"at least {_FEWEST}"
        )
    if known.all():
        return values.copy()
    if not (known[0] and known[-1]):
        raise InputError("x: a gap at an end of the record; cut the record first")
    from scipy.interpolate import CubicSpline  # slow to import

    at = np.flatnonzero(known)
    gaps = np.diff(at) - 1
    if gaps.max() > most:
        where = int(at[int(np.argmax(gaps))]) + 1
        raise InputError(
            f"x: a gap of {int(gaps.max())} samples at index {where}, longer than {most}: cut the "
            "record there, or raise `longest`"
        )
    filled = values.copy()
    filled[~known] = CubicSpline(at, values[known])(np.flatnonzero(~known))
    return filled


def choose_window(
    time: ArrayLike, x: ArrayLike, *, start: float, stop: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Samples of a record from the time `start` to the time `stop` (s), both included.

    Raises
    ------
    InputError
        Fewer than four samples lie in this range.
    """
    t = records.checked_record("time", time, 1)
    values = records.real_numbers("x", x)
    if values.shape[:1] != t.shape:
        raise InputError(f"x: shape {values.shape}, but there are {t.size} times")
    inside = (t >= start) & (t <= stop)
    if inside.sum() < _FEWEST:
        raise InputError(
            f"start, stop: {start:g} to {stop:g} s holds {int(inside.sum())} samples of a record "
            f"from {t[0]:g} to {t[-1]:g} s; at least {_FEWEST} are needed"
        )
    return t[inside], values[inside]


def first_turning_point(x: ArrayLike, least: float = 0.1) -> int:
    """Index of the first maximum or minimum at which a record turns back.

    Parameters
    ----------
    x : array_like, shape (n,)
    least : float
        Fraction of the record's range by which the record must rise and fall around the turn;
        smaller turns are noise.

    Raises
    ------
    InputError
        The record does not turn.
    """
    values = records.checked_record("x", x, _FEWEST)
    part = number("least", least, above=0.0, below=1.0)
    from scipy.signal import find_peaks  # slow to import

    limit = part * float(np.ptp(values))
    if limit <= 0.0:
        raise InputError("x: constant throughout; there is no motion in it")
    turns = [find_peaks(sign * values, prominence=limit)[0] for sign in (1.0, -1.0)]
    places = np.concatenate(turns)
    if not places.size:
        raise InputError(
            "x: does not turn: it has no maximum or minimum between its ends that stands out by "
            f"{part:g} of its range; choose another window, or a lower `least`"
        )
    return int(places.min())


def subtract_final(x: ArrayLike, part: float = 0.1) -> NDArray[np.float64]:
    """Record relative to its final rest position, the mean of its last part.

    Parameters
    ----------
    x : array_like, shape (n,)
    part : float
        Fraction of the record, at its end, over which the final position is averaged.
    """
    values = records.checked_record("x", x, _FEWEST)
    count = max(1, round(number("part", part, above=0.0, below=1.0) * values.size))
    return values - values[-count:].mean()


def remove_trend(x: ArrayLike, kind: str = "linear") -> NDArray[np.float64]:
    """Record minus its line of best fit ("linear") or its mean ("constant")."""
    return records.detrended(records.checked_record("x", x, _FEWEST), kind)
