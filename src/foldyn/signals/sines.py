"""Stepped sine: amplitude and phase of the steady part of a record at a known frequency."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.arguments import Unit, brief
from foldyn.errors import InputError
from foldyn.signals.records import real_array
from foldyn.values import number, whole


@brief
@dataclass(frozen=True)
class SineFit:
    """Fit of a sine of known frequency to a record, with its harmonics.

    x(t) = offset + slope (t - t_mid) + sum over k of Re(amplitude[k - 1] exp(2 pi i k f t)) + rest.

    Attributes
    ----------
    frequency : float
        The given frequency f (Hz).
    amplitude : ndarray, shape (harmonics, ...), complex
        Complex amplitudes of f, 2 f, ... in the unit of the record; phases refer to a cosine at
        t = 0 of the given times.
    offset, slope : ndarray, shape (...)
        Value at the middle t_mid of the fitted part, and trend per second.
    rest : ndarray, shape (...)
        Root mean square of the remainder.
    unsteadiness : ndarray, shape (...)
        Difference between the amplitudes at f in the two halves of the fitted part, relative to the
        amplitude: a measure of transients, or of noise.
    samples : int
        Number of samples fitted.
    """

    frequency: Annotated[float, Unit("Hz")]
    amplitude: NDArray[np.complex128]
    offset: NDArray[np.float64]
    slope: NDArray[np.float64]
    rest: NDArray[np.float64]
    unsteadiness: NDArray[np.float64]
    samples: int


def fit_sine(
    time: ArrayLike,
    x: ArrayLike,
    *,
    frequency: float,
    cycles: int | None = None,
    harmonics: int = 1,
) -> SineFit:
    """Fit the steady part of a record by a sine of known frequency, an offset and a trend.

    Uses linear least squares; times need not be evenly spaced, and cycles need not be complete.

    Parameters
    ----------
    time : array_like, shape (n,)
        Sample times (s), increasing.
    x : array_like, shape (n, ...)
        Record; further axes are channels.
    frequency : float
        Frequency of the excitation (Hz).
    cycles : int or None
        Number of cycles to fit at the end of the record, at least 2, after the transient has
        decayed; None fits the whole record.
    harmonics : int
        Number of multiples of the frequency to fit, at least 1. More than 1 gives the distortion by
        a nonlinear structure, and keeps it out of `rest`.

    Returns
    -------
    SineFit
        Complex amplitudes, offset, trend, rest and a measure of steadiness.

    Raises
    ------
    InputError
        The record is shorter than the requested cycles, or than two cycles, or has too few samples
        per cycle to tell the highest harmonic from its alias.

    Notes
    -----
    This is the three-parameter fit of IEEE Std 1057 for a known frequency, with a trend and
    harmonics added. White noise with the standard deviation s gives the real and the imaginary part
    of the amplitude the standard deviation s sqrt(2 / n).

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(200) * 0.01
    >>> fit = fit_sine(t, 0.5 + 0.3 * t + 2.0 * np.cos(2 * np.pi * 3.1 * t - 1.0), frequency=3.1)
    >>> print(np.round(np.abs(fit.amplitude[0]), 12), np.round(np.angle(fit.amplitude[0]), 12))
    2.0 -1.0
    """
    f = number("frequency", frequency, above=0.0)
    count = whole("harmonics", harmonics, least=1)
    t, samples = _steady_part(time, x, f, cycles)
    if np.diff(t).max() * f * count >= 0.5:
        raise InputError(
            f"harmonics: {count} times {f:g} Hz needs more than {2 * count} samples per cycle, "
            f"but samples are up to {np.diff(t).max():g} s apart; sample faster or fit fewer"
        )
    basis = _basis(t, f, count)
    coefficients = np.linalg.lstsq(basis, samples, rcond=None)[0]
    left = samples - basis @ coefficients
    # both halves use the offset and trend of the whole part: in a short half, the fit could not
    # separate them from the sine
    waves = basis[:, 2:] @ coefficients[2:] + left
    first, second = (
        _amplitudes(np.linalg.lstsq(basis[half, 2:], waves[half], rcond=None)[0])[0]
        for half in (slice(None, t.size // 2), slice(t.size // 2, None))
    )
    amplitude = _amplitudes(coefficients[2:])
    with np.errstate(divide="ignore", invalid="ignore"):
        unsteadiness = np.abs(second - first) / np.abs(amplitude[0])

    channels = np.shape(x)[1:]
    return SineFit(
        frequency=f,
        amplitude=amplitude.reshape(count, *channels),
        offset=coefficients[0].reshape(channels),
        slope=coefficients[1].reshape(channels),
        rest=np.sqrt(np.mean(left**2, axis=0)).reshape(channels),
        unsteadiness=unsteadiness.reshape(channels),
        samples=t.size,
    )


def stepped_sine(
    time: ArrayLike,
    force: ArrayLike,
    *,
    response: ArrayLike,
    frequency: float,
    cycles: int | None = None,
    harmonics: int = 1,
) -> NDArray[np.complex128]:
    """Response per force at the frequency of a sine excitation, from the steady part of records.

    It is the quotient of the complex amplitudes at this frequency; for a nonlinear structure, this
    is the describing function at the amplitude reached. Use one call per frequency (and amplitude).

    Parameters
    ----------
    time : array_like, shape (n,)
        Sample times (s), increasing.
    force : array_like, shape (n,)
        Force (N), or the motion of the base.
    response : array_like, shape (n, ...)
        Response; further axes are channels.
    frequency, cycles, harmonics
        As in `fit_sine`, which also returns the quality of the fit to a record.

    Returns
    -------
    ndarray, shape (...), complex
        Response per force, for the time dependence exp(+i w t).

    Raises
    ------
    InputError
        Input that `fit_sine` refuses, or a force without content at the frequency.
    """
    if np.ndim(force) != 1:
        raise InputError(f"force: shape {np.shape(force)}; give one record, shape (n,)")
    asked: dict[str, Any] = {"frequency": frequency, "cycles": cycles, "harmonics": harmonics}
    push = fit_sine(time, force, **asked).amplitude[0]
    if not np.abs(push) > 1e-12 * np.abs(real_array("force", force)).max():
        raise InputError(f"force: no content at {frequency:g} Hz; a response per force needs one")
    return fit_sine(time, response, **asked).amplitude[0] / push


def _steady_part(
    time: ArrayLike, x: ArrayLike, f: float, cycles: int | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times (n,) and samples (n, channels) of the part to fit."""
    t, samples = real_array("time", time), real_array("x", x)
    if t.ndim != 1 or t.size < 2 or (np.diff(t) <= 0.0).any():
        raise InputError("time: give one row of increasing sample times")
    if samples.ndim == 0 or samples.shape[0] != t.size:
        raise InputError(f"x: shape {samples.shape}, but there are {t.size} times")
    # each sample stands for one interval: n samples are n dt long, not (n - 1) dt
    there = (t[-1] - t[0]) * t.size / (t.size - 1) * f
    wanted = 2 if cycles is None else whole("cycles", cycles, least=2)
    if there < wanted * (1.0 - 1e-9):
        raise InputError(
            f"time: the record holds {there:.3g} cycles of {f:g} Hz, and {wanted} are needed; "
            f"record longer{'' if cycles is None else ', or fit fewer cycles'}"
        )
    # with half an interval of tolerance, the part does not depend on the rounding of times
    start = 0 if cycles is None else np.searchsorted(t, t[-1] - cycles / f + 0.5 * np.diff(t)[-1])
    return t[start:], samples.reshape(t.size, -1)[start:]


def _basis(t: NDArray[np.float64], f: float, harmonics: int) -> NDArray[np.float64]:
    """Columns 1, t - middle, then cosine and sine of each harmonic, shape (n, 2 + 2 harmonics)."""
    phase = 2.0 * np.pi * f * np.outer(t, np.arange(1, harmonics + 1))
    waves = np.stack([np.cos(phase), np.sin(phase)], axis=2).reshape(t.size, -1)
    line = np.column_stack([np.ones(t.size), t - 0.5 * (t[0] + t[-1])])
    return np.hstack([line, waves])


def _amplitudes(coefficients: NDArray) -> NDArray[np.complex128]:
    """Complex amplitudes from cosine and sine coefficients: a cos + b sin = Re((a - i b) e^...)."""
    return coefficients[0::2] - 1j * coefficients[1::2]
