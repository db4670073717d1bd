"""Frequency response from records of force and response, and its conversion to other quantities.

The module estimates H1, H2 and the coherence.

Records that have not decayed at their end are multiplied by an exponential window; the damping that
it adds is known, and is subtracted again.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.arguments import Unit, brief
from foldyn.errors import InputError
from foldyn.signals import records
from foldyn.signals.records import DERIVATIVES, beside, checked_frequencies
from foldyn.values import choice, number, whole

ESTIMATORS = ("h1", "h2")
_FEWEST = 4  # least samples of a segment
# Lines with a force amplitude below this fraction of the largest hold only round-off.
_SILENCE = 1e-12


@brief
@dataclass(frozen=True)
class FrequencyResponse:
    """A frequency response estimated from records.

    Attributes
    ----------
    frequency : ndarray, shape (m,)
        Frequencies (Hz) from 0 to 1/(2 dt), m = segment // 2 + 1.
    response : ndarray, shape (m, ...), complex
        Response per force, in the unit of the response divided by the unit of the force, for the
        time dependence exp(+i w t): a lag is a negative phase. NaN at lines without force.
    coherence : ndarray, shape (m, ...)
        Fraction of the response's power that is linear in the force, from 0 to 1. NaN for a single
        segment, because the coherence would always be 1.
    force_density : ndarray, shape (m,)
        One-sided power density of the force (unit of the force squared per Hz). Where it is small
        compared to its maximum, the response is inaccurate, as a quotient of small numbers.
    segments : int
        Number of segments averaged, over all records.
    """

    frequency: Annotated[NDArray[np.float64], Unit("Hz")]
    response: NDArray[np.complex128]
    coherence: NDArray[np.float64]
    force_density: NDArray[np.float64]
    segments: int

    @property
    def random_error(self) -> NDArray[np.float64]:
        """Standard deviation of the relative error of the magnitude, and of the phase in rad.

        It is sqrt((1 - c) / (2 n c)), with the coherence c and the number n of segments, which must
        not overlap (Bendat and Piersol, Random Data, chapter 9); valid where it is well below 1.
        """
        with np.errstate(divide="ignore"):
            return np.sqrt((1.0 - self.coherence) / (2.0 * self.segments * self.coherence))


def frequency_response(
    force: ArrayLike,
    response: ArrayLike,
    *,
    dt: float,
    estimator: str = "h1",
    segment: int | None = None,
    overlap: float = 0.0,
    window: records.Window = None,
    detrend: str | None = None,
) -> FrequencyResponse:
    """Estimate a frequency response from records of force and response.

    F and X are the transforms of a windowed segment, and < > is the average over all segments.
    H1 = <F* X> / <F* F> has no bias from noise in the response; noise in the force makes H1 too
    small by the factor 1 + (power of noise / power of force). H2 = <X* X> / <X* F> has no bias from
    noise in the force; noise in the response makes H2 too large by the factor 1 + (power of noise /
    power of response). The coherence ``|<F* X>|^2 / (<F* F> <X* X>)`` is H1 / H2.

    For burst random, impulse and sweep excitation, use each record as a whole (`segment=None`, no
    window). The record must be periodic, or long enough for the response to decay within it; if
    the response does not decay, multiply by an `exponential_window`. For stationary noise, use
    segments with ``window="hann"`` and ``overlap=0.5``.

    Parameters
    ----------
    force : array_like, shape (n,) or (records, n)
        Force (N), or the motion of the base: one record, or several records of the same length.
    response : array_like, shape (n, ...) or (records, n, ...)
        Response (m, m/s or m/s^2); further axes are channels.
    dt : float
        Sampling interval (s); `foldyn.signals.sampling_interval` finds and checks it.
    estimator : {"h1", "h2"}
        Estimator to use; the two agree without noise, and for a single segment.
    segment : int or None
        Samples of a segment; None takes the whole record. Samples at the end of a record that do
        not fill a segment are not used.
    overlap : float
        Fraction of a segment that the next segment shares, 0 <= overlap < 1.
    window : str, tuple, array_like of shape (segment,), or None
        As in `spectrum`, for both force and response.
    detrend : {None, "constant", "linear"}
        Trend removed from each segment, force and response, before windowing.

    Returns
    -------
    FrequencyResponse
        Frequency, response, coherence, power density of the force and number of segments.

    Raises
    ------
    InputError
        Records of different length, a segment longer than the record, a force without content,
        or input that `spectrum` refuses.

    Notes
    -----
    Sources: Bendat and Piersol, Random Data, 4th ed. 2010, chapters 6 (H1, H2, coherence) and 9
    (errors); Brandt, Noise and Vibration Analysis, 2011, chapter 13. With n segments the coherence
    of unrelated records is about 1/n, not 0.

    Examples
    --------
    A gain of 2 with a delay of one sample, at a quarter of the sampling frequency:

    >>> import numpy as np
    >>> force = np.random.default_rng(1).normal(size=(8, 64))
    >>> estimate = frequency_response(force, 2.0 * np.roll(force, 1, axis=1), dt=0.01)
    >>> print(estimate.frequency[16], estimate.response[16].imag.round(12))
    25.0 -2.0
    """
    import scipy.fft

    choice("estimator", estimator, ESTIMATORS)
    interval = records.checked_interval(dt)
    forces, responses = _records(force, response)
    length = forces.shape[1] if segment is None else whole("segment", segment, least=_FEWEST)
    if not _FEWEST <= length <= forces.shape[1]:
        raise InputError(
            f"segment: {length} samples, but a record has {forces.shape[1]}; a segment has from "
            f"{_FEWEST} samples to all of a record"
        )
    shared = int(number("overlap", overlap, least=0.0, below=1.0) * length)
    weights = records.checked_window(window, length)

    channels = responses.shape[2:]
    lines = length // 2 + 1
    ff = np.zeros(lines)
    xx = np.zeros((lines, *channels))
    fx = np.zeros((lines, *channels), dtype=np.complex128)
    count = 0
    for f, x in zip(forces, responses, strict=True):
        for start in range(0, len(f) - length + 1, length - shared):
            part = slice(start, start + length)
            F = _transform(f[part], weights, detrend)
            X = _transform(x[part], weights, detrend)
            ff += np.abs(F) ** 2
            xx += np.abs(X) ** 2
            fx += np.conj(records.beside(F, X)) * X
            count += 1

    silent = ff <= _SILENCE**2 * ff.max()
    if silent.all():
        raise InputError("force: zero throughout; a response per force needs a force")
    power = records.beside(np.where(silent, np.nan, ff), fx)
    coherent = np.abs(fx) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):  # nan / nan, and channels at rest
        h1 = fx / power
        h2 = np.where(coherent > 0.0, xx * fx / coherent, np.nan)
        ratio = np.minimum(coherent / (power * xx), 1.0)
    density = ff * interval / (count * np.sum(weights**2))
    density[1 : -1 if length % 2 == 0 else None] *= 2.0
    return FrequencyResponse(
        frequency=scipy.fft.rfftfreq(length, interval),
        response=h1 if estimator == "h1" else np.where(np.isnan(h1), np.nan, h2),
        coherence=ratio if count > 1 else np.full_like(ratio, np.nan),
        force_density=density,
        segments=count,
    )


def _records(
    force: ArrayLike, response: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Force (records, n) and response (records, n, ...) of equal length."""
    f = records.real_array("force", force)
    x = records.real_array("response", response)
    if f.ndim not in (1, 2) or f.size == 0:
        raise InputError(
            f"force: shape {f.shape}; give one record, shape (n,), or several of one length, "
            "shape (records, n)"
        )
    if x.shape[: f.ndim] != f.shape:
        raise InputError(
            f"response: shape {x.shape} does not begin with the force's {f.shape}; force and "
            "response have the same records and samples, channels come last"
        )
    return (f, x) if f.ndim == 2 else (f[np.newaxis], x[np.newaxis])


def _transform(
    x: NDArray[np.float64], weights: NDArray[np.float64], detrend: str | None
) -> NDArray[np.complex128]:
    """Fourier transform of a detrended and windowed segment, along axis 0."""
    import scipy.fft

    return scipy.fft.rfft(records.detrended(x, detrend) * records.beside(weights, x), axis=0)


def exponential_window(n: int, dt: float, *, rate: float) -> NDArray[np.float64]:
    """Window exp(-rate t) for records that have not decayed at their end.

    Applied to both force and response, the window moves every pole by exactly -rate along the real
    axis: the estimate is then H(i w + rate). `without_window` subtracts the added damping again.

    Parameters
    ----------
    n : int
        Number of samples of the record or segment.
    dt : float
        Sampling interval (s).
    rate : float
        Decay rate (1/s), greater than 0; 4.6 / (n dt) leaves 1 % at the end.

    Returns
    -------
    ndarray, shape (n,)
        The window, 1 at its start.
    """
    rate = number("rate", rate, above=0.0)
    return np.exp(-rate * records.checked_interval(dt) * np.arange(whole("n", n, least=1)))


def without_window(
    frequency: ArrayLike, damping_ratio: ArrayLike, *, rate: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Natural frequencies and damping ratios without the damping that an exponential window adds.

    The damped frequency stays the same, and the real part of the pole becomes -z w + rate.

    Parameters
    ----------
    frequency, damping_ratio : array_like
        Natural frequencies w / (2 pi) (Hz) and damping ratios z < 1, as estimated.
    rate : float
        Decay rate of the window (1/s).

    Returns
    -------
    frequency, damping_ratio : ndarray
        Values without the window; a damping ratio below 0 is dominated by noise.

    Examples
    --------
    >>> frequency, damping_ratio = without_window(10.0, 0.05, rate=2.0)
    >>> print(f"{frequency:.4f} {damping_ratio:.6f}")
    9.9891 0.018189
    """
    rate = number("rate", rate, above=0.0)
    natural = 2.0 * np.pi * records.real_array("frequency", frequency)
    damping = records.real_array("damping_ratio", damping_ratio)
    if (np.abs(damping) >= 1.0).any():
        raise InputError("damping_ratio: must be below 1: an oscillating mode is meant")
    real, imaginary = rate - damping * natural, natural * np.sqrt(1.0 - damping**2)
    size = np.hypot(real, imaginary)
    return size / (2.0 * np.pi), -real / size


def convert_response(
    frequency: ArrayLike, response: ArrayLike, *, source: str, target: str
) -> NDArray[np.complex128]:
    """Convert a frequency response between receptance, mobility and accelerance.

    Mobility is i w times receptance, and accelerance i w times mobility (ISO 7626-1).

    Parameters
    ----------
    frequency : array_like, shape (m,)
        Frequencies (Hz), increasing, from 0 on.
    response : array_like, shape (m, ...), complex
        Response per force (m/N, m/(N s) or m/(N s^2)), or another motion per another input.
    source, target : {"receptance", "mobility", "accelerance"}
        Quantity that is given, and quantity that is wanted.

    Returns
    -------
    ndarray, shape (m, ...), complex
        The converted response; NaN at 0 Hz if the conversion divides by i w.

    Raises
    ------
    InputError
        Unknown quantities, or a response that does not fit the frequencies.

    Examples
    --------
    >>> found = convert_response([1.0, 2.0], [1.0, 1.0], source="receptance", target="mobility")
    >>> print(found.round(3))
    [0. +6.283j 0.+12.566j]
    """
    order = DERIVATIVES[choice("target", target, DERIVATIVES)]
    order -= DERIVATIVES[choice("source", source, DERIVATIVES)]
    f, H = _over_frequency(frequency, response)
    if order == 0:
        return H
    iw = 2j * np.pi * np.where((f == 0.0) & (order < 0), np.nan, f)
    with np.errstate(invalid="ignore"):
        return H * beside(iw**order, H)


def transmissibility(response: ArrayLike, reference: ArrayLike) -> NDArray[np.complex128]:
    """Motion at one point per motion at another point, both under the same excitation.

    Parameters
    ----------
    response : array_like, shape (m, ...), complex
        Frequency response of the points of interest.
    reference : array_like, shape (m,), complex
        Frequency response of the reference point, for the same quantity and excitation.

    Returns
    -------
    ndarray, shape (m, ...), complex
        Quotient; NaN where the reference is zero.
    """
    H = np.asarray(response, dtype=np.complex128)
    R = np.asarray(reference, dtype=np.complex128)
    if R.ndim != 1 or H.shape[:1] != R.shape:
        raise InputError(
            f"reference: shape {R.shape} does not fit the response's {H.shape}; both begin with "
            "the frequencies"
        )
    R = np.where(R == 0.0, np.nan, R)
    with np.errstate(invalid="ignore"):
        return H / beside(R, H)


def base_transmissibility(frequency: ArrayLike, relative: ArrayLike) -> NDArray[np.complex128]:
    """Absolute motion per motion of the base, from the relative motion per base acceleration.

    The absolute motion is x = y + z, with the motion y of the base and the motion z relative to it.
    A structure on a moving base obeys its equation of motion in z under the force -M r y''. So the
    relative response per base acceleration is H = z / y'' = z / (-w^2 y), and x / y = 1 - w^2 H.

    Parameters
    ----------
    frequency : array_like, shape (m,)
        Frequencies (Hz).
    relative : array_like, shape (m, ...), complex
        Relative displacement in the base's direction per acceleration of the base (s^2).

    Returns
    -------
    ndarray, shape (m, ...), complex
        Absolute displacement per displacement of the base, 1 at 0 Hz.
    """
    f, H = _over_frequency(frequency, relative)
    return 1.0 - (2.0 * np.pi * beside(f, H)) ** 2 * H


def _over_frequency(
    frequency: ArrayLike, response: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Checked frequencies (m,) and a response (m, ...)."""
    f = checked_frequencies(frequency, fewest=1)
    H = np.asarray(response, dtype=np.complex128)
    if H.shape[:1] != f.shape:
        raise InputError(f"response: shape {H.shape} does not begin with the {f.size} frequencies")
    return f, H
