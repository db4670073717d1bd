"""Peaks of a magnitude curve, interpolated between samples, and damping from half-power points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.arguments import Unit, brief
from foldyn.errors import InputError, warn
from foldyn.signals import records
from foldyn.values import choice, number, whole

_LOPSIDED = 0.1
LOWEST = 1e-4  # least height, relative to the maximum; lower peaks may be simulation errors


@brief
@dataclass(frozen=True)
class Peaks:
    """Peaks of a magnitude curve, by increasing frequency.

    Attributes
    ----------
    frequency : ndarray, shape (p,)
        Frequencies (Hz), interpolated between samples.
    height : ndarray, shape (p,)
        Heights in the unit of the curve, interpolated.
    prominence : ndarray, shape (p,)
        Prominences, in the unit of the curve, from its samples. On each side, the curve has a
        lowest point between the peak and the next higher value (or the end of the curve); the
        prominence is the height above the higher of these two points.
    index : ndarray of int, shape (p,)
        Indices of the curve's samples at the peaks.
    """

    frequency: Annotated[NDArray[np.float64], Unit("Hz")]
    height: NDArray[np.float64]
    prominence: NDArray[np.float64]
    index: NDArray[np.int64]


def find_peaks(
    frequency: ArrayLike,
    magnitude: ArrayLike,
    *,
    prominence: float = 0.05,
    count: int | None = None,
    quantity: str = "receptance",
    rise: float | None = None,
) -> Peaks:
    """Find the peaks of a magnitude curve: a frequency response, or an amplitude spectrum.

    Between samples the curve is interpolated through three points as a viscously damped mode: the
    inverse square of its receptance is a parabola in the squared frequency. For a single mode the
    interpolated peak is exact at any spacing.

    Parameters
    ----------
    frequency : array_like, shape (m,)
        Frequencies (Hz), increasing, m >= 3; the spacing may vary.
    magnitude : array_like, shape (m,)
        Magnitudes; for complex values, the modulus is taken.
    prominence : float
        Least prominence, as a fraction of the curve's maximum.
    count : int or None
        Number of peaks to keep, in order of prominence.
    quantity : {"receptance", "mobility", "accelerance"}
        Quantity of the curve; "receptance" for the spectrum of a displacement.
    rise : float or None
        Also keep lower peaks that exceed the lowest points on both sides (see `Peaks.prominence`)
        by this factor: on a logarithmic axis they are as clear as high peaks.

    Returns
    -------
    Peaks
        Arrays of length 0 if no peak is found. A maximum at an end of the curve does not count.

    Raises
    ------
    InputError
        NaN in the curve (cut it to the band that was excited), or frequencies that do not increase.

    Notes
    -----
    A mode with natural frequency w has its peak at w sqrt(1 - 2 z^2) in a receptance, at w in a
    mobility, and at w / sqrt(1 - 2 z^2) in an accelerance: `half_power` and `circle_fit` give w.

    Examples
    --------
    >>> import numpy as np
    >>> f = np.linspace(8.0, 12.0, 9)
    >>> peaks = find_peaks(f, 1 / np.abs(1 - (f / 10) ** 2 + 2j * 0.05 * f / 10))
    >>> print(peaks.frequency, 10 * np.sqrt(1 - 2 * 0.05**2))
    [9.97496867] 9.974968671630002
    """
    curve = magnitude_curve(frequency, magnitude, quantity)
    share = number("prominence", prominence, least=0.0, below=1.0)
    from scipy.signal import find_peaks as search  # slow to import
    from scipy.signal import peak_prominences

    # an absolute floor of 0 would keep round-off on flat stretches
    least = max(share, np.finfo(np.float64).eps) * curve.size.max()
    index, _ = search(curve.size, prominence=least)
    if rise is not None and curve.size.any():
        step = np.log(number("rise", rise, above=1.0))
        decibel = np.log(np.maximum(curve.size, LOWEST * curve.size.max()))
        index = np.union1d(index, search(decibel, prominence=step)[0])
    rises = peak_prominences(curve.size, index)[0]
    if count is not None:
        keep = np.sort(np.argsort(rises, kind="stable")[::-1][: whole("count", count, least=1)])
        index, rises = index[keep], rises[keep]
    place, height = np.array([curve.peak(i) for i in index]).reshape(-1, 2).T
    return Peaks(frequency=place, height=height, prominence=rises, index=index.astype(np.int64))


class Curve(NamedTuple):
    """A magnitude curve (m,) over frequencies (Hz), the `order`-th derivative of a receptance."""

    f: NDArray[np.float64]
    size: NDArray[np.float64]
    order: int

    def peak(self, index: int) -> tuple[float, float]:
        """Frequency and height of the peak at a sample, from this sample and its two neighbors."""
        v = self._top(index)
        if v is None:
            return float(self.f[index]), float(self.size[index])
        a, b, c, center = self.stiffness_parabola(index)
        value = (a * v + b) * v + c
        height = self.size[index] * np.sqrt((1.0 + v) ** self.order / value)
        return float(center * np.sqrt(1.0 + v)), float(height)

    def _top(self, index: int) -> float | None:
        """Place v of the peak (see `stiffness_parabola`); None if it is not shaped like a mode."""
        f, order = self.f, self.order
        a, b, c, center = self.stiffness_parabola(index)
        # p(v) / (1 + v)^order is stationary; p = a v^2 + b v + c, 1 + v is the squared frequency
        if order == 0:
            v = -b / (2.0 * a)
        elif order == 1:
            q = (c - b) / a
            v = q / (1.0 + np.sqrt(1.0 + q))
        else:
            v = (2.0 * c - b) / (2.0 * a - b)
        low, high = (f[[index - 1, index + 1]] / center) ** 2 - 1.0
        value = (a * v + b) * v + c
        return v if low < v < high and value > 0.0 else None  # else a zero, a kink or a spike

    def peak_slopes(self, index: int) -> PeakSlopes | None:
        """Derivatives of the peak with respect to the magnitudes at a sample and its two neighbors.

        None if the peak is not shaped like a mode. Let p = sum p_i L_i(v) be the parabola through
        the squared stiffnesses p_i of the three samples. The peak lies at the v for which
        g = (1 + v) p' - order p = 0. The height is stationary at this v, so the height changes only
        with p, not with v.
        """
        v = self._top(index)
        if v is None:
            return None
        near = slice(index - 1, index + 2)
        a, b, c, center = self.stiffness_parabola(index)
        at = (self.f[near] / center) ** 2 - 1.0
        own = (self.size[index] / self.size[near]) ** 2 * (1.0 + at) ** self.order
        # in each row, the place of one sample, then the places of the others
        shape = np.stack([np.roll(at, -k) for k in range(3)])
        one, other = v - shape[:, 1], v - shape[:, 2]
        scale = (shape[:, 0] - shape[:, 1]) * (shape[:, 0] - shape[:, 2])
        part, slope = one * other / scale, (one + other) / scale  # L_i and L_i'
        by_size = -2.0 * own / self.size[near]
        value, steep = (a * v + b) * v + c, 2.0 * a * v + b
        bent = 2.0 * a * (1.0 + v) + (1.0 - self.order) * steep  # g'
        moved = ((1.0 + v) * slope - self.order * part) / bent  # -dv / dp_i
        frequency, height = self.peak(index)
        by_place = -0.5 * frequency / (1.0 + v) * moved * by_size
        return PeakSlopes(by_place, -0.5 * height / value * part * by_size)

    def stiffness_parabola(self, index: int) -> tuple[float, float, float, float]:
        """Parabola a v^2 + b v + c through the squared dynamic stiffness at three samples.

        Here v = (f / center)^2 - 1, where center is the frequency at `index`, and the stiffness
        1 / |receptance| is scaled to c = 1. The squared stiffness of a damped oscillator,
        |k - m w^2 + i c w|^2, is a parabola in w^2. A magnitude of 0, or a division by 0 Hz, makes
        the coefficients NaN or infinite.
        """
        f, size, order = self
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


class PeakSlopes(NamedTuple):
    """Derivatives (3,) of a peak's frequency (Hz) and height; see `Curve.peak_slopes`."""

    frequency: NDArray[np.float64]
    height: NDArray[np.float64]


def magnitude_curve(frequency: ArrayLike, magnitude: ArrayLike, quantity: str) -> Curve:
    """Checked curve of a quantity with at least three points."""
    order = records.DERIVATIVES[choice("quantity", quantity, records.DERIVATIVES)]
    f = records.checked_frequencies(frequency, fewest=3)
    curve = records.checked_curve("magnitude", magnitude, f)
    if (curve.imag == 0.0).all() and (curve.real < 0.0).any():
        raise InputError("magnitude: below 0; give the modulus, or the complex response")
    return Curve(f, np.abs(curve), order)


@dataclass(frozen=True)
class HalfPower:
    """Half-power points of a peak and the damping from them.

    Attributes
    ----------
    peak, height : float
        Frequency (Hz) and height of the peak.
    lower, upper : float
        Frequencies (Hz) left and right at which the curve has fallen to height / sqrt(2).
    textbook_damping_ratio : float
        (upper - lower) / (2 peak), as in most publications. It is exact for a mobility; for a
        receptance it is too large by a relative error of about 2 z^2 (4 % at z = 0.135).
    damping_ratio, natural_frequency : float
        Values of the single viscously damped mode that has these half-power points (frequency in
        Hz), exact at any damping.
    asymmetry : float
        Distance of the peak from the middle of the two half-power points, divided by the distance
        between these points. It is 0 for a single viscously damped mode; neighboring modes, noise
        and nonlinearity increase it.
    """

    peak: float
    height: float
    lower: float
    upper: float
    textbook_damping_ratio: float
    damping_ratio: float
    natural_frequency: float
    asymmetry: float


def half_power(
    frequency: ArrayLike,
    magnitude: ArrayLike,
    *,
    near: float | None = None,
    quantity: str = "receptance",
    ripple: float = 0.05,
) -> HalfPower:
    """Damping from the half-power points of a peak.

    The half-power points are interpolated as in `find_peaks`; this is exact for a single mode at
    any spacing.

    Parameters
    ----------
    frequency : array_like, shape (m,)
        Frequencies (Hz), increasing, m >= 3; the spacing may vary.
    magnitude : array_like, shape (m,)
        Magnitudes; of complex values the modulus is taken.
    near : float or None
        Take the peak nearest to this frequency (Hz), ignoring rises below `ripple`; None takes the
        highest peak.
    quantity : {"receptance", "mobility", "accelerance"}
        Quantity of the curve.
    ripple : float
        Between the peak and the half-power points the curve may rise again, because of noise, by
        this fraction of its least value so far; a larger rise counts as a neighboring peak.

    Returns
    -------
    HalfPower
        The half-power points, the textbook damping ratio, and the exact damping ratio.

    Raises
    ------
    InputError
        There is no peak; or the curve ends, or rises again, before it has fallen by 3 dB. If it
        rises again, peaks overlap: use `circle_fit` or `matrix_pencil`.

    Warns
    -----
    FoldynWarning
        The asymmetry is above 0.1.

    Notes
    -----
    With r = f / f0 and z the damping ratio, ``|receptance|^2 = height^2 / 2`` is a quadratic
    equation in r^2 with the roots 1 - 2 z^2 -+ 2 z sqrt(1 - z^2). With z = sin a, the quotient
    (upper^2 - lower^2) / (upper^2 + lower^2) is tan 2 a, and so z is the sine of half its
    arctangent. An accelerance has the reciprocal roots and the same quotient; a mobility has
    upper lower = f0^2 and upper - lower = 2 z f0. A receptance falls by 3 dB toward 0 Hz only if
    z < sin(pi / 8) = 0.383. For the textbook formula see Ewins, Modal Testing, 2nd ed. 2000,
    chapter 4 (peak amplitude method).

    Examples
    --------
    >>> import numpy as np
    >>> f = np.linspace(5.0, 15.0, 41)
    >>> result = half_power(f, 1 / np.abs(1 - (f / 9.3) ** 2 + 2j * 0.135 * f / 9.3))
    >>> print(f"{result.textbook_damping_ratio:.4f} {result.damping_ratio:.4f}")
    0.1402 0.1350
    """
    curve = magnitude_curve(frequency, magnitude, quantity)
    bumps = number("ripple", ripple, least=0.0)
    index = _peak_index(curve, quantity, near, bumps)
    peak, height = curve.peak(index)

    level = height / np.sqrt(2.0)
    if curve.size[index] <= level:
        raise InputError(
            f"frequency: no sample lies within the half-power points of the peak at {peak:.6g} Hz; "
            "refine the frequencies near it (for spectra: record longer)"
        )
    lower, upper = (_crossing(curve, index, level, side, bumps) for side in (-1, 1))
    if curve.order == 1:
        natural = np.sqrt(lower * upper)
        damping = (upper - lower) / (2.0 * natural)
        middle = natural
    else:
        double = np.arctan((upper**2 - lower**2) / (upper**2 + lower**2))
        damping = np.sin(0.5 * double)
        power = 2 - 2 * curve.order  # 2 or -2: the points are symmetric in f^power about its peak
        middle = (0.5 * (lower**power + upper**power)) ** (1.0 / power)
        natural = middle * np.cos(double) ** (-1.0 / power)
    asymmetry = float(abs(peak - middle) / (upper - lower))
    if asymmetry > _LOPSIDED:
        warn(
            f"half power: the peak at {peak:.6g} Hz lies {asymmetry:.0%} of its width off the "
            "middle of the half-power points: other modes, noise or nonlinearity shape it, and the "
            "damping is not that of one mode; use circle_fits",
            "signals.md#half-power-points",
        )
    return HalfPower(
        peak=peak,
        height=height,
        lower=lower,
        upper=upper,
        textbook_damping_ratio=(upper - lower) / (2.0 * peak),
        damping_ratio=float(damping),
        natural_frequency=float(natural),
        asymmetry=asymmetry,
    )


def _peak_index(curve: Curve, quantity: str, near: float | None, ripple: float) -> int:
    """Index of the highest peak, or of the peak nearest to a frequency."""
    peaks = find_peaks(curve.f, curve.size, prominence=0.0, quantity=quantity)
    if peaks.index.size == 0:
        raise InputError("magnitude: no peak between the ends of the curve; extend the frequencies")
    if near is None:
        return int(peaks.index[np.argmax(peaks.height)])
    distance = np.abs(peaks.frequency - number("near", near, least=0.0))
    bump = peaks.prominence < ripple * curve.size[peaks.index]
    return int(peaks.index[np.argmin(np.where(bump, np.inf, distance))])


def _crossing(curve: Curve, index: int, level: float, side: int, ripple: float) -> float:
    """Frequency on one side of a peak at which the curve falls to a level."""
    f, size, _ = curve
    where = "above" if side > 0 else "below"
    least = size[index]
    inner = index
    while True:
        outer = inner + side
        if not 0 <= outer < f.size:
            raise InputError(
                f"magnitude: {where} the peak at {f[index]:.6g} Hz the curve ends at "
                f"{f[inner]:.6g} Hz before it has fallen by 3 dB; extend the frequencies, or use "
                "circle_fit"
            )
        if size[outer] <= level:
            break
        if size[outer] > (1.0 + ripple) * least:
            raise InputError(
                f"magnitude: {where} the peak at {f[index]:.6g} Hz the curve rises again at "
                f"{f[outer]:.6g} Hz before it has fallen by 3 dB; a neighbor overlaps, or there is "
                "noise above `ripple`: use circle_fit or matrix_pencil, or smooth the curve"
            )
        least = min(least, size[outer])
        inner = outer
    return _between(curve, inner, outer, level)


def _between(curve: Curve, inner: int, outer: int, level: float) -> float:
    """Frequency between two samples at which the curve crosses a level."""
    f, size, order = curve
    middle = min(max(inner, 1), f.size - 2)
    a, b, c, center = curve.stiffness_parabola(middle)
    # (size / level)^2 (1 + v)^order = a v^2 + b v + c, with the size at the sample `middle`
    ratio = (size[middle] / level) ** 2
    a, b, c = np.array([a, b, c]) - ratio * np.array([[0, 0, 1], [0, 1, 1], [1, 2, 1]][order])
    ends = np.sort((f[[inner, outer]] / center) ** 2 - 1.0)
    if np.isfinite([a, b, c]).all():
        root = np.sqrt(max(b * b - 4.0 * a * c, 0.0))
        q = -0.5 * (b + np.copysign(root, b))
        with np.errstate(divide="ignore", invalid="ignore"):
            candidates = np.array([q / a, c / q])
        inside = candidates[(candidates >= ends[0]) & (candidates <= ends[1])]
        if inside.size == 1:
            return float(center * np.sqrt(1.0 + inside[0]))
    # if there is noise or a zero, interpolate the magnitude linearly
    part = (size[inner] - level) / (size[inner] - size[outer])
    return float(f[inner] + part * (f[outer] - f[inner]))
