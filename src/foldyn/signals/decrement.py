"""Logarithmic decrement of a free vibration from its successive maxima."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.arguments import Unit, brief
from foldyn.errors import InputError
from foldyn.signals.records import checked_interval, checked_record
from foldyn.signals.spectra import spectrum
from foldyn.values import number

_FEWEST = 16
_PADDING = 8  # zero padding of the spectrum; the period is needed only to within a tenth
_FEWEST_PER_CYCLE = 8.0
_DEGREE = 6  # degree of the polynomial through the samples around a maximum


@brief
@dataclass(frozen=True)
class LogDecrement:
    """Decay of a free vibration per cycle.

    Attributes
    ----------
    decrement : float
        Natural logarithm of the ratio of successive maxima, by least squares over all maxima.
    standard_error : float
        Standard error of the decrement, from the scatter about the fit; NaN with two maxima.
    damping_ratio : float
        decrement / sqrt(4 pi^2 + decrement^2).
    damped_frequency, natural_frequency : float
        Frequency of the maxima (Hz), and this frequency divided by sqrt(1 - damping_ratio^2).
    time, height : ndarray, shape (k,)
        Times (s) of the maxima, and their heights above the rest position (unit of the record).
    successive : ndarray, shape (k - 1,)
        Logarithm of the ratio of each pair of successive maxima; a trend shows that damping depends
        on amplitude.
    """

    decrement: float
    standard_error: float
    damping_ratio: float
    damped_frequency: float
    natural_frequency: float
    time: Annotated[NDArray[np.float64], Unit("s")]
    height: NDArray[np.float64]
    successive: NDArray[np.float64]


def log_decrement(
    x: ArrayLike,
    dt: float,
    *,
    rest: float | None = None,
    floor: float = 0.1,
    frequency: float | None = None,
) -> LogDecrement:
    """Estimate the logarithmic decrement from the successive maxima of a free vibration.

    Each maximum is read from a polynomial of degree 6, fitted over two thirds of a period around
    it. The heights are fitted by height exp(-decrement k), with weights for noise of constant size.
    The count k starts with the highest maximum. Maxima less than a third of a period from the ends
    of the record are not used.

    Parameters
    ----------
    x : array_like, shape (n,)
        Free vibration in one mode, with at least two maxima; for several modes use `matrix_pencil`.
    dt : float
        Sampling interval (s), at most an eighth of the period.
    rest : float or None
        Rest position, in the unit of `x`. If None, heights are measured from the straight line
        between the minima before and after a maximum, which eliminates an unknown offset and a
        slow drift; a maximum without a minimum on each side is then not used.
    floor : float
        The count ends at the first maximum below this fraction of the highest, because noise
        dominates lower maxima.
    frequency : float or None
        Approximate damped frequency (Hz); None takes the highest line of the spectrum.

    Returns
    -------
    LogDecrement
        Decrement with its standard error, damping ratio, frequency and the maxima.

    Raises
    ------
    InputError
        Fewer than two maxima, or too few samples per period.

    Notes
    -----
    Successive maxima of exp(-z w t) cos(w_d t) lie at the same phase of each cycle. So their ratio
    is exactly exp(2 pi z / sqrt(1 - z^2)), and their distances from the chords between minima have
    the same ratio (Thomson, Theory of Vibration with Applications, chapter 2). In a sampled record,
    each maximum lies at another place between two samples: the polynomial leaves errors of up to
    5e-5 of the decrement at 12 samples per period or more, and 2e-4 at 8 samples. Noise raises low
    maxima more than high maxima: noise of 1 % at 25 samples per period lowers the decrement by
    0.2 % at z = 0.0255 and by 1.7 % at z = 0.135.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(240) / 240.0
    >>> x = 3.0 + np.exp(-0.05 * 60.0 * t) * np.cos(60.0 * np.sqrt(1 - 0.05**2) * t)
    >>> print(f"{log_decrement(x, 1 / 240.0).damping_ratio:.5f}")
    0.05000
    """
    samples = checked_record("x", x, _FEWEST)
    interval = checked_interval(dt)
    least = number("floor", floor, least=0.0, below=1.0)
    per_cycle = _samples_per_cycle(samples, interval, frequency)
    place, height = _heights(samples, per_cycle, rest)
    place, height = _decaying(place, height, least)
    if place.size < 2:
        raise InputError(
            f"x: {place.size} maxima above {least:g} of the highest; a decrement needs two: record "
            "longer, start earlier, lower `floor`, or give `rest`"
        )

    apart = np.maximum(np.rint(np.diff(place) / per_cycle), 1.0)  # 2 where noise hid a maximum
    cycle = np.concatenate([[0.0], np.cumsum(apart)])
    # noise of constant size in the heights becomes noise / height in the logarithms of the heights
    decrement, error = _slope(cycle, -np.log(height), weight=height**2)
    ratio = decrement / np.hypot(2.0 * np.pi, decrement)
    damped = cycle[-1] / ((place[-1] - place[0]) * interval)
    return LogDecrement(
        decrement=decrement,
        standard_error=error,
        damping_ratio=float(ratio),
        damped_frequency=float(damped),
        natural_frequency=float(damped / np.sqrt(1.0 - ratio**2)),
        time=place * interval,
        height=height,
        successive=-np.diff(np.log(height)) / apart,
    )


def _samples_per_cycle(x: NDArray[np.float64], dt: float, frequency: float | None) -> float:
    """Samples per cycle, from a given frequency or the highest spectral line."""
    if frequency is None:
        lines, amplitude = spectrum(x, dt, detrend="linear", pad=_PADDING)
        f = float(lines[1 + np.argmax(amplitude[1:])])
    else:
        f = number("frequency", frequency, above=0.0)
    per_cycle = 1.0 / (f * dt)
    if per_cycle < _FEWEST_PER_CYCLE:
        raise InputError(
            f"dt: {per_cycle:.3g} samples per cycle of {f:.6g} Hz; at least "
            f"{_FEWEST_PER_CYCLE:g} are needed: sample faster, give `frequency`, or use "
            "matrix_pencil"
        )
    return per_cycle


def _heights(
    x: NDArray[np.float64], per_cycle: float, rest: float | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Places (in samples) of the maxima, and heights of the maxima above the rest position."""
    place, value = _maxima(x, per_cycle)
    if rest is not None:
        return place, value - number("rest", rest)
    low_place, low_value = _maxima(-x, per_cycle)
    if low_place.size == 0:
        return place[:0], value[:0]
    after = np.searchsorted(low_place, place)
    inner = (after > 0) & (after < low_place.size)
    place, value, after = place[inner], value[inner], after[inner]
    return place, value + np.interp(place, low_place, low_value)


def _maxima(
    x: NDArray[np.float64], per_cycle: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Places (in samples) and values of one maximum per cycle, interpolated between samples."""
    from scipy.signal import find_peaks  # slow to import

    half = max(_DEGREE // 2, round(per_cycle / 3.0))
    indices = find_peaks(x, distance=max(1.0, 0.7 * per_cycle))[0]
    indices = indices[(indices >= half) & (indices < x.size - half)]
    maxima = np.array([_refined(x, int(index), half) for index in indices]).reshape(-1, 2)
    return maxima[:, 0], maxima[:, 1]


def _refined(x: NDArray[np.float64], index: int, half: int) -> tuple[float, float]:
    """Place and value of the maximum of the polynomial through the samples around an index."""
    s = np.arange(-half, half + 1) / half
    curve = np.polynomial.Polynomial.fit(s, x[index - half : index + half + 1], _DEGREE, [-1, 1])
    roots = curve.deriv().roots()
    level = roots.real[(np.abs(roots.imag) < 1e-9) & (np.abs(roots.real) < 1.0)]
    if level.size == 0:
        return float(index), float(x[index])
    top = level[np.argmax(curve(level))]
    return float(index + half * top), float(curve(top))


def _decaying(
    place: NDArray[np.float64], height: NDArray[np.float64], floor: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The maxima from the highest one to the last above the floor."""
    if height.size == 0 or height.max() <= 0.0:
        return place[:0], height[:0]
    first = int(np.argmax(height))
    low = np.flatnonzero(height[first:] <= floor * height[first])
    kept = slice(first, first + int(low[0]) if low.size else None)
    return place[kept], height[kept]


def _slope(
    k: NDArray[np.float64], y: NDArray[np.float64], weight: NDArray[np.float64]
) -> tuple[float, float]:
    """Slope of the weighted line of best fit and its standard error."""
    weight = weight / weight.sum()
    k_off, y_off = k - weight @ k, y - weight @ y
    spread = weight @ k_off**2
    slope = (weight @ (k_off * y_off)) / spread
    if k.size == 2:
        return float(slope), float("nan")
    left = weight @ (y_off - slope * k_off) ** 2 / (k.size - 2)
    return float(slope), float(np.sqrt(left / spread))
