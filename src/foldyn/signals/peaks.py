"""Peaks of a magnitude curve, refined between its samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.signals import records

LOWEST = 1e-4  # of the maximum: what lies below may be the error of a simulation


@dataclass(frozen=True)
class Peaks:
    """Peaks of a magnitude curve, by increasing frequency.

    Attributes
    ----------
    frequency : ndarray, shape (p,)
        Frequencies (Hz), refined between the samples.
    height : ndarray, shape (p,)
        Heights in the unit of the curve, refined.
    prominence : ndarray, shape (p,)
        Height above the higher of the two lowest points on the way to higher ground left and
        right, or to the curve's ends; in the unit of the curve, from its samples.
    index : ndarray of int, shape (p,)
        Samples of the curve at the peaks.
    """

    frequency: NDArray[np.float64]
    height: NDArray[np.float64]
    prominence: NDArray[np.float64]
    index: NDArray[np.int64]


def find_peaks(
    frequency: ArrayLike,
    magnitude: ArrayLike,
    prominence: float = 0.05,
    count: int | None = None,
    quantity: str = "receptance",
    rise: float | None = None,
) -> Peaks:
    """Find the peaks of a magnitude curve: a frequency response, or an amplitude spectrum.

    Between samples the curve is taken as that of one viscously damped mode, through three points:
    the square of its inverse, as a receptance, is a parabola over the squared frequency. For a
    single mode the refined peak is exact at any spacing.

    Parameters
    ----------
    frequency : array_like, shape (m,)
        Frequencies (Hz), increasing, m >= 3; the spacing may vary.
    magnitude : array_like, shape (m,)
        Magnitudes; of complex values the modulus is taken.
    prominence : float
        Least prominence, as a part of the curve's maximum.
    count : int or None
        Keep only the so many most prominent ones.
    quantity : {"receptance", "mobility", "accelerance"}
        What the curve is; for the spectrum of a displacement "receptance".
    rise : float or None
        Also keep lower peaks that stand out by this factor from the lowest points on the way to
        higher ground: on a logarithmic axis they are as good as high ones.

    Returns
    -------
    Peaks
        None found: arrays of length 0. A maximum at an end of the curve is no peak.

    Raises
    ------
    InputError
        NaN in the curve (cut it to the band that was excited), or frequencies that do not increase.

    Notes
    -----
    The peak of a receptance lies at w sqrt(1 - 2 z^2), that of a mobility at w, and that of an
    accelerance at w / sqrt(1 - 2 z^2): `half_power` and `circle_fit` give w itself.

    Examples
    --------
    >>> import numpy as np
    >>> f = np.linspace(8.0, 12.0, 9)
    >>> peaks = find_peaks(f, 1 / np.abs(1 - (f / 10) ** 2 + 2j * 0.05 * f / 10))
    >>> print(peaks.frequency, 10 * np.sqrt(1 - 2 * 0.05**2))
    [9.97496867] 9.974968671630002
    """
    order = records.DERIVATIVES[records.checked_choice("quantity", quantity, records.DERIVATIVES)]
    f, size = magnitude_curve(frequency, magnitude)
    share = records.checked_number("prominence", prominence, least=0.0, below=1.0)
    from scipy.signal import find_peaks as search  # slow to import
    from scipy.signal import peak_prominences

    # an absolute floor of 0 would keep rounding on flat stretches
    least = max(share, np.finfo(np.float64).eps) * size.max()
    index, _ = search(size, prominence=least)
    if rise is not None and size.any():
        factor = records.checked_number("rise", rise, above=1.0)
        decibel = np.log(np.maximum(size, LOWEST * size.max()))
        index = np.union1d(index, search(decibel, prominence=np.log(factor))[0])
    height = peak_prominences(size, index)[0]
    if count is not None:
        most = np.argsort(height, kind="stable")[::-1][: records.checked_count("count", count)]
        keep = np.sort(most)
        index, height = index[keep], height[keep]
    refined = [refined_peak(f, size, i, order) for i in index]
    return Peaks(
        frequency=np.array([peak[0] for peak in refined]),
        height=np.array([peak[1] for peak in refined]),
        prominence=height,
        index=index.astype(np.int64),
    )


def magnitude_curve(
    frequency: ArrayLike, magnitude: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Frequencies and magnitudes, at least three, checked."""
    f = records.checked_frequencies(frequency, fewest=3)
    curve = records.checked_curve("magnitude", magnitude, f)
    if (curve.imag == 0.0).all() and (curve.real < 0.0).any():
        raise InputError("magnitude: below 0; give the modulus, or the complex response")
    return f, np.abs(curve)


def refined_peak(
    f: NDArray[np.float64], size: NDArray[np.float64], index: int, order: int
) -> tuple[float, float]:
    """Frequency and height of the peak at a sample, from it and its two neighbors."""
    a, b, c, center = stiffness_parabola(f, size, index, order)
    # stationary p(v) / (1 + v)^order, p = a v^2 + b v + c and 1 + v the squared frequency
    if order == 0:
        v = -b / (2.0 * a)
    elif order == 1:
        q = (c - b) / a
        v = q / (1.0 + np.sqrt(1.0 + q))
    else:
        v = (2.0 * c - b) / (2.0 * a - b)
    low, high = (f[[index - 1, index + 1]] / center) ** 2 - 1.0
    value = (a * v + b) * v + c
    if not (low < v < high and value > 0.0):  # not shaped like a mode: a zero, a kink, a spike
        return float(f[index]), float(size[index])
    peak = center * np.sqrt(1.0 + v)
    return float(peak), float(size[index] * np.sqrt((1.0 + v) ** order / value))


def stiffness_parabola(
    f: NDArray[np.float64], size: NDArray[np.float64], index: int, order: int
) -> tuple[float, float, float, float]:
    """Parabola a v^2 + b v + c through the squared dynamic stiffness at three samples.

    v = (f / center)^2 - 1 with center the frequency at `index`, and the stiffness 1 / |receptance|
    scaled to c = 1: |k - m w^2 + i c w|^2 is a parabola in w^2. Zero as a magnitude, or 0 Hz where
    it is divided by, make it NaN or infinite.
    """
    center, near = f[index], slice(index - 1, index + 2)
    u = (f[near] / center) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        p = (size[index] / size[near]) ** 2 * u**order
        v = u - 1.0
        right = (p[2] - p[1]) / v[2]
        left = (p[0] - p[1]) / v[0]
        a = (right - left) / (v[2] - v[0])
        b = left - a * v[0]
    return float(a), float(b), 1.0, float(center)
