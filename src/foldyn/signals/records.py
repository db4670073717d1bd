"""Checks of records, intervals, windows and curves that the estimators share."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.values import show, whole

Window: TypeAlias = str | tuple | ArrayLike | None

# time derivatives of the displacement that a frequency response holds, per force
DERIVATIVES: dict[str, int] = {"receptance": 0, "mobility": 1, "accelerance": 2}
DETRENDS = (None, "constant", "linear")


def real_numbers(name: str, x: ArrayLike) -> NDArray[np.float64]:
    """Return `x` as float64 numbers."""
    try:
        values = np.asarray(x)
        if not np.iscomplexobj(values):
            return values.astype(np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name}: not an array of numbers ({error})") from error
    raise InputError(f"{name}: complex samples; a real record is needed here")


def finite(name: str, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return `values`, time along axis 0, where all of them are finite."""
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
    try:
        interval = float(dt)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"dt: {dt!r} is not one number; for sample times use signals.sampling_interval(time)"
        ) from error
    if not (np.isfinite(interval) and interval > 0.0):
        raise InputError(f"dt: {dt!r}; the sampling interval is a positive number of seconds")
    return interval


def checked_window(window: Window, n: int) -> NDArray[np.float64]:
    """Return the n samples of a window, by name or as given; None is a window of ones."""
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


def detrended(x: NDArray[np.float64], kind: str | None, axis: int = 0) -> NDArray[np.float64]:
    """Return `x` without its mean ("constant") or its line of best fit ("linear")."""
    if kind not in DETRENDS:
        raise InputError(f'detrend: {kind!r} is unknown; use None, "constant" or "linear"')
    if kind is None:
        return x
    from scipy.signal import detrend  # slow to import, and seldom needed

    return detrend(x, axis=axis, type=kind)


def checked_number(
    name: str,
    value: Any,
    least: float = -np.inf,
    above: float = -np.inf,
    below: float = np.inf,
) -> float:
    """Return `value` as a finite float within the bounds."""
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{name}: {show(value)} is not a finite number") from error
    if not (np.isfinite(number) and number >= least and above < number < below):
        bounds = {"at least": least, "above": above, "below": below}
        words = [f"{word} {bound:g}" for word, bound in bounds.items() if np.isfinite(bound)]
        raise InputError(
            f"{name}: {value!r} must be finite{''.join(', ' + word for word in words)}"
        )
    return number


def checked_count(name: str, value: Any, least: int = 1) -> int:
    """Return `value` as a whole number, at least `least`."""
    return whole(name, value, least=least)


def checked_choice(name: str, value: Any, known: Any) -> str:
    """Return `value` where it is one of the `known` words."""
    if not isinstance(value, str) or value not in known:
        raise InputError(f"{name}: {value!r} is unknown; use one of {', '.join(known)}")
    return value


def checked_frequencies(frequency: ArrayLike, fewest: int) -> NDArray[np.float64]:
    """Return frequencies (Hz), at least `fewest`, increasing and not negative."""
    f = real_array("frequency", frequency)
    if f.ndim != 1 or f.size < fewest:
        raise InputError(
            f"frequency: shape {f.shape}; at least {fewest} frequencies in one row are needed"
        )
    if f[0] < 0.0 or (np.diff(f) <= 0.0).any():
        raise InputError("frequency: must increase from 0 Hz or more; sort it and drop doubles")
    return f


def checked_curve(
    name: str, values: ArrayLike, frequency: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """Return a complex curve over the frequencies, finite at each of them."""
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
    """First index along the first axis of the first bad value."""
    return int(np.argwhere(np.atleast_1d(bad))[0][0])
