"""Waves in a chain of cells: spectra with respect to phase and frequency, and traveling pulses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.signals import records
from foldyn.values import number

FEWEST = 4  # least number of cells, and of samples, of a field


class WavenumberSpectrum(NamedTuple):
    """Amplitudes of waves exp(i (omega t - kappa n)) in a field; see `wavenumber_spectrum`.

    Attributes
    ----------
    phase : ndarray, shape (p,)
        Phase kappa (rad per cell), increasing from -pi in steps of 2 pi/n for n cells. Waves with a
        positive phase travel to higher cell numbers.
    frequency : ndarray, shape (f,)
        Frequencies (Hz) from 0, in steps of 1/(m dt) for m samples.
    amplitude : ndarray, shape (p, f)
        Amplitudes in the unit of the field; the root of the sum of squares over the components.
    """

    phase: NDArray[np.float64]
    frequency: NDArray[np.float64]
    amplitude: NDArray[np.float64]


def wavenumber_spectrum(
    values: ArrayLike, dt: float, *, window: records.Window = "hann"
) -> WavenumberSpectrum:
    """Two-dimensional spectrum of a motion of a chain of cells.

    The transform over time and cells is divided by the sums of the windows and doubled to include
    negative frequencies, so a traveling wave of amplitude A on a bin gives a peak of height A.

    Parameters
    ----------
    values : array_like, shape (m, n, ...)
        Values at m evenly spaced times in n cells; further axes are components of a cell.
    dt : float
        Sampling interval (s).
    window : str, tuple, array_like, or None
        Window along time and along cells, as in `spectrum` (an array is a window along time only);
        None applies no window.

    Returns
    -------
    WavenumberSpectrum

    Raises
    ------
    InputError
        Fewer than 4 times or cells, values that are not finite, or an unknown window.

    Examples
    --------
    >>> import numpy as np
    >>> from foldyn.signals import wavenumber_spectrum
    >>> n, t = np.arange(16), np.arange(64)[:, None] * 0.1
    >>> found = wavenumber_spectrum(np.cos(2 * np.pi * 1.25 * t - np.pi / 2 * n), 0.1)
    >>> k, f = np.unravel_index(found.amplitude.argmax(), found.amplitude.shape)
    >>> float(found.phase[k] / np.pi), float(found.frequency[f]), float(found.amplitude[k, f])
    (0.5, 1.25, 1.0)
    """
    import scipy.fft

    field = records.real_array("values", values)
    if field.ndim < 2 or min(field.shape[:2]) < FEWEST:
        raise InputError(f"values: shape {field.shape}: give at least {FEWEST} times and cells")
    interval = records.checked_interval(dt)
    times, cells = field.shape[:2]
    over_time = records.checked_window(window, times)
    over_cells = records.checked_window(window if isinstance(window, str | tuple) else None, cells)
    gain = over_time.sum() * over_cells.sum()
    flat = field.reshape(times, cells, -1) * (over_time[:, None] * over_cells)[..., None]
    # the transform along time has exp(-i omega t), so the one along cells needs exp(+i kappa n)
    waves = scipy.fft.ifft(scipy.fft.rfft(flat, axis=0), axis=1) * (cells / gain)
    waves[1 : (times + 1) // 2] *= 2.0
    amplitude = np.linalg.norm(scipy.fft.fftshift(waves, axes=1), axis=2).T
    phase = 2.0 * np.pi * scipy.fft.fftshift(scipy.fft.fftfreq(cells))
    return WavenumberSpectrum(phase, scipy.fft.rfftfreq(times, interval), amplitude)


class Pulse(NamedTuple):
    """A pulse traveling along cells; see `pulse`.

    Attributes
    ----------
    arrival : ndarray, shape (n,)
        Time of the pulse's peak in each cell; nan if the pulse does not arrive.
    peak : ndarray, shape (n,)
        Signed value at the peak in each cell.
    width : ndarray, shape (n,)
        Full width at half maximum, as a time; nan if the record ends before the pulse has passed.
    speed : float
        Cells per time, from the median of the slopes between all pairs of arrivals; nan with fewer
        than three arrivals.
    """

    arrival: NDArray[np.float64]
    peak: NDArray[np.float64]
    width: NDArray[np.float64]
    speed: float


def pulse(time: ArrayLike, values: ArrayLike, *, sign: int = 1, share: float = 0.5) -> Pulse:
    """Follow the first pulse of one sign along a chain of cells.

    The pulse arrives in a cell at the first maximum that reaches a given share of the largest value
    with this sign in the cell.

    Parameters
    ----------
    time : array_like, shape (m,)
        Times (s), increasing.
    values : array_like, shape (m, n)
        Values in n cells, such as strains: a rarefaction has the sign 1, a compression -1.
    sign : {1, -1}
        Sign of the pulse.
    share : float
        Least height of a maximum, as a share (0 to 1) of the largest value.

    Returns
    -------
    Pulse

    Raises
    ------
    InputError
        Shapes that do not fit, values that are not finite, or a sign other than 1 and -1.

    Notes
    -----
    Speed: P. K. Sen, Estimates of the regression coefficient based on Kendall's tau, J. Am. Stat.
    Assoc. 63, 1968.

    Examples
    --------
    >>> import numpy as np
    >>> from foldyn.signals import pulse
    >>> t, n = np.linspace(0.0, 3.0, 301)[:, None], np.arange(5)
    >>> found = pulse(t[:, 0], -np.exp(-(((t - 0.5 - 0.25 * n) / 0.1) ** 2)), sign=-1)
    >>> round(found.speed, 6), found.peak.round(6).tolist()
    (4.0, [-1.0, -1.0, -1.0, -1.0, -1.0])
    """
    from scipy.stats import theilslopes

    moments = records.checked_record("time", time, FEWEST)
    field = records.real_array("values", values)
    if field.ndim != 2 or len(field) != len(moments):
        raise InputError(
            f"values: shape {field.shape}: give (times, cells) for the {len(moments)} times"
        )
    if (np.diff(moments) <= 0.0).any():
        raise InputError("time: must increase")
    if isinstance(sign, bool) or sign not in (1, -1):
        raise InputError(f"sign = {sign!r}: must be 1 or -1")
    number("share", share, least=0.0, most=1.0)
    found = np.array([_first_peak(moments, sign * each, share) for each in field.T])
    arrival, height, width = found.reshape(-1, 3).T
    come = np.flatnonzero(np.isfinite(arrival))
    slope = theilslopes(arrival[come], come)[0] if len(come) > 2 else np.nan
    return Pulse(arrival, sign * height, width, float(1.0 / slope if slope else np.nan))


def _first_peak(time: NDArray, values: NDArray, share: float) -> tuple[float, float, float]:
    """Time, height and full width at half maximum of the first high maximum inside the record."""
    inner = values[1:-1]
    high = (inner >= values[:-2]) & (inner > values[2:]) & (inner > 0.0)
    peaks = np.flatnonzero(high & (inner >= share * values.max())) + 1
    if not len(peaks):
        return np.nan, np.nan, np.nan
    k = int(peaks[0])
    a, b, c = np.polyfit(time[k - 1 : k + 2] - time[k], values[k - 1 : k + 2], 2)
    height = c - 0.25 * b * b / a
    before = np.flatnonzero(values[:k] < 0.5 * height)
    after = np.flatnonzero(values[k:] < 0.5 * height)
    width = np.nan
    if len(before) and len(after):
        i, j = int(before[-1]), k + int(after[0])
        start = np.interp(0.5 * height, values[i : i + 2], time[i : i + 2])
        width = np.interp(-0.5 * height, -values[j - 1 : j + 1], time[j - 1 : j + 1]) - start
    return time[k] - 0.5 * b / a, height, float(width)
