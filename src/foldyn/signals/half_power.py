"""Half-power damping: from the width of a peak where it has fallen by 3 dB."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import FoldynWarning, InputError
from foldyn.signals.peaks import find_peaks, magnitude_curve, refined_peak, stiffness_parabola
from foldyn.signals.records import DERIVATIVES, checked_choice, checked_number

_LOPSIDED = 0.1


@dataclass(frozen=True)
class HalfPower:
    """Half-power points of a peak and the damping that they tell.

    Attributes
    ----------
    peak, height : float
        Frequency (Hz) and height of the peak.
    lower, upper : float
        Frequencies (Hz) left and right at which the curve has fallen to height / sqrt(2).
    textbook_damping_ratio : float
        (upper - lower) / (2 peak), as most publications mean it: exact for a mobility, too large
        by about 2 z^2 relative for a receptance (4 % at 0.135), growing with damping.
    damping_ratio, natural_frequency : float
        Those of the single viscously damped mode with these half-power points (frequency in Hz):
        exact for it at any damping.
    asymmetry : float
        0 for a single viscously damped mode: how far off the middle of the half-power points the
        peak lies, as a part of their distance. Neighbors, noise and nonlinearity raise it.
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
    near: float | None = None,
    quantity: str = "receptance",
    ripple: float = 0.05,
) -> HalfPower:
    """Damping from the half-power points of a peak.

    The points are interpolated as in `find_peaks`: exact for a single mode at any spacing.

    Parameters
    ----------
    frequency : array_like, shape (m,)
        Frequencies (Hz), increasing, m >= 3; the spacing may vary.
    magnitude : array_like, shape (m,)
        Magnitudes; of complex values the modulus is taken.
    near : float or None
        The peak nearest to this frequency (Hz), bumps below `ripple` left out; None takes the
        highest.
    quantity : {"receptance", "mobility", "accelerance"}
        What the curve is.
    ripple : float
        On its way down to the half-power points the curve may rise again by this part of its
        least value so far (noise); more is taken for a neighbor.

    Returns
    -------
    HalfPower
        The points, the textbook damping ratio, and the exact one.

    Raises
    ------
    InputError
        No peak; a curve that ends before it has fallen by 3 dB, or rises again before: overlapping
        neighbors, for which `circle_fit` or `matrix_pencil` serve.

    Warns
    -----
    FoldynWarning
        Where the asymmetry is above 0.1.

    Notes
    -----
    With r = f / f0 and z the damping ratio, ``|receptance|^2 = height^2 / 2`` is a quadratic
    equation in r^2 with the roots 1 - 2 z^2 -+ 2 z sqrt(1 - z^2). Hence, with z = sin a, the
    quotient of difference and sum of the squared points is tan 2 a, and
    z = sin(atan((upper^2 - lower^2) / (upper^2 + lower^2)) / 2). An accelerance has the reciprocal
    roots and the same quotient; for a mobility upper lower = f0^2 and upper - lower = 2 z f0. A
    receptance falls by 3 dB towards 0 Hz only if z < sin(pi / 8) = 0.383. The textbook formula:
    Ewins, Modal Testing, 2nd ed. 2000, chapter 4 (peak amplitude method).

    Examples
    --------
    >>> import numpy as np
    >>> f = np.linspace(5.0, 15.0, 41)
    >>> result = half_power(f, 1 / np.abs(1 - (f / 9.3) ** 2 + 2j * 0.135 * f / 9.3))
    >>> print(f"{result.textbook_damping_ratio:.4f} {result.damping_ratio:.4f}")
    0.1402 0.1350
    """
    order = DERIVATIVES[checked_choice("quantity", quantity, DERIVATIVES)]
    f, size = magnitude_curve(frequency, magnitude)
    bumps = checked_number("ripple", ripple, least=0.0)
    index = _peak_index(f, size, near, quantity, bumps)
    peak, height = refined_peak(f, size, index, order)

    level = height / np.sqrt(2.0)
    if size[index] <= level:
        raise InputError(
            f"frequency: no sample lies within the half-power points of the peak at {peak:.6g} Hz; "
            "refine the frequencies there (spectra: record longer)"
        )
    lower, upper = (_crossing(f, size, index, level, order, side, bumps) for side in (-1, 1))
    if order == 1:
        natural = np.sqrt(lower * upper)
        damping = (upper - lower) / (2.0 * natural)
        middle = natural
    else:
        double = np.arctan((upper**2 - lower**2) / (upper**2 + lower**2))
        damping = np.sin(0.5 * double)
        power = 2 - 2 * order  # of the frequency in which the points lie evenly: 2, or -2
        middle = (0.5 * (lower**power + upper**power)) ** (1.0 / power)
        natural = middle * np.cos(double) ** (-1.0 / power)
    asymmetry = float(abs(peak - middle) / (upper - lower))
    if asymmetry > _LOPSIDED:
        warnings.warn(
            f"half power: the peak at {peak:.6g} Hz lies {asymmetry:.0%} of its width off the "
            "middle of the half-power points: other modes, noise or nonlinearity shape it, and the "
            "damping is not that of one mode; use circle_fits",
            FoldynWarning,
            stacklevel=2,
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


def _peak_index(
    f: NDArray[np.float64],
    size: NDArray[np.float64],
    near: float | None,
    quantity: str,
    ripple: float,
) -> int:
    peaks = find_peaks(f, size, prominence=0.0, quantity=quantity)
    if peaks.index.size == 0:
        raise InputError(
            "magnitude: the curve has no peak between its ends; extend the frequencies"
        )
    if near is None:
        return int(peaks.index[np.argmax(peaks.height)])
    distance = np.abs(peaks.frequency - checked_number("near", near, least=0.0))
    bump = peaks.prominence < ripple * size[peaks.index]
    return int(peaks.index[np.argmin(np.where(bump, np.inf, distance))])


def _crossing(
    f: NDArray[np.float64],
    size: NDArray[np.float64],
    index: int,
    level: float,
    order: int,
    side: int,
    ripple: float,
) -> float:
    """Frequency on one side of a peak at which the curve falls to a level."""
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
    return _between(f, size, inner, outer, level, order)


def _between(
    f: NDArray[np.float64],
    size: NDArray[np.float64],
    inner: int,
    outer: int,
    level: float,
    order: int,
) -> float:
    """Frequency between two samples at which the curve crosses a level."""
    middle = min(max(inner, 1), f.size - 2)
    a, b, c, center = stiffness_parabola(f, size, middle, order)
    # (height / level)^2 (1 + v)^order = a v^2 + b v + c, heights counted in that at `middle`
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
    # noise or a zero: a straight line of the magnitude
    part = (size[inner] - level) / (size[inner] - size[outer])
    return float(f[inner] + part * (f[outer] - f[inner]))
