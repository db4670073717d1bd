"""Decaying exponentials of a free vibration by the matrix pencil."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.arguments import brief
from foldyn.errors import InputError
from foldyn.signals.records import checked_interval, real_array
from foldyn.values import number, whole

_FEWEST = 8
_WIDEST = 500  # most samples of a window: the singular value decomposition costs n width^2
_ROWS = 4096  # windows factorized at a time
# Singular values of white noise: the largest is 2.5 to 4 times the lower quartile (measured for
# windows of a third of the record, 40 to 1500 samples).
_ABOVE_NOISE = 4.5


@brief
@dataclass(frozen=True)
class DecayingModes:
    """A record as a sum of decaying cosines, by increasing natural frequency.

    x(t) = sum over k of amplitude[k] exp(-z w t) cos(w_d t + phase[k]), with w = 2 pi times the
    natural frequency, the damping ratio z and w_d = w sqrt(1 - z^2). An exponential that does not
    oscillate has z = 1 (if it grows, z = -1) and the phase 0 or pi; an offset has the natural
    frequency 0.

    Attributes
    ----------
    natural_frequency, damping_ratio, damped_frequency : ndarray, shape (k,)
        Frequencies in Hz; a negative damping ratio is a growing part, often noise.
    pole : ndarray, shape (k,), complex
        Poles -z w + i w_d (1/s): of each conjugate pair, the pole above the real axis.
    amplitude, phase : ndarray, shape (k, ...)
        Amplitude (unit of the record) and phase (rad) at the first sample, t = 0, in each channel.
    rest : ndarray, shape (...)
        Root mean square of the remainder, relative to the record.
    singular_values : ndarray
        Singular values of the Hankel matrix, in decreasing order; the first `order` of them exceed
        the noise.
    order : int
        Number of poles: two for each oscillating mode.
    """

    natural_frequency: NDArray[np.float64]
    damping_ratio: NDArray[np.float64]
    damped_frequency: NDArray[np.float64]
    pole: NDArray[np.complex128]
    amplitude: NDArray[np.float64]
    phase: NDArray[np.float64]
    rest: NDArray[np.float64]
    singular_values: NDArray[np.float64]
    order: int

    def at(self, time: ArrayLike) -> NDArray[np.float64]:
        """Sum of the modes (n, ...) at times (s) after the first sample."""
        t = np.asarray(time, dtype=np.float64)
        parts = self.amplitude * np.exp(1j * self.phase)
        return np.real(np.tensordot(np.exp(np.outer(t, self.pole)), parts, axes=1))


def matrix_pencil(
    x: ArrayLike,
    dt: float,
    *,
    order: int | None = None,
    threshold: float | None = None,
    width: int | None = None,
) -> DecayingModes:
    """Fit a free vibration by decaying cosines: frequencies, damping ratios, amplitudes, phases.

    The rows of a Hankel matrix are windows of the record. Each window is a combination of vectors,
    one for each pole s, and a shift by one sample multiplies each vector by exp(s dt). All channels
    share the poles.

    Parameters
    ----------
    x : array_like, shape (n,) or (n, ...)
        Free vibration, after all loads have ended; further axes are channels. Scale channels of
        different units to similar size. An offset or a slow drift appears as a pole near 0, so
        detrending is not needed; subtracting the mean of a decaying record would add an offset.
    dt : float
        Sampling interval (s).
    order : int or None
        Number of poles: two for each mode, one for an offset.
    threshold : float or None
        Without `order`, the number of poles is the number of singular values above this fraction of
        the largest. None takes the lower quartile as noise and counts values above 4.5 times the
        quartile: this is correct for white noise, and gives too many poles for colored noise. Check
        `singular_values`.
    width : int or None
        Length of a window minus one (the pencil parameter), from the order to n - order. None takes
        a third of the record (least sensitive to noise), but at most 500.

    Returns
    -------
    DecayingModes
        The modes; modes with small amplitude or negative damping may be noise.

    Raises
    ------
    InputError
        A record too short for the order, an order of 0 (nothing but noise), NaN.

    Notes
    -----
    Hua and Sarkar, IEEE Transactions on Acoustics, Speech, and Signal Processing 38, 1990, 814-824;
    Sarkar and Pereira, IEEE Antennas and Propagation Magazine 37(1), 1995, 48-55. For several
    channels the method is equivalent to the eigensystem realization algorithm without input (Juang
    and Pappa, Journal of Guidance, Control, and Dynamics 8, 1985, 620-627). Amplitudes are fitted
    by least squares to the whole record. Sample at 4 to 20 times the highest frequency. In a record
    with much finer sampling all exp(s dt) are close to 1, which costs accuracy: decimate it.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(200) / 100.0
    >>> modes = matrix_pencil(0.3 + 2.0 * np.exp(-1.5 * t) * np.cos(40.0 * t - 0.5), dt=0.01)
    >>> print(modes.damped_frequency.round(6), modes.amplitude.round(6), modes.phase.round(6))
    [0.       6.366198] [0.3 2. ] [ 0.  -0.5]
    """
    interval = checked_interval(dt)
    samples = real_array("x", x)
    if samples.ndim == 0 or samples.shape[0] < _FEWEST:
        raise InputError(f"x: shape {samples.shape}; at least {_FEWEST} samples are needed")
    channels = samples.shape[1:]
    n = samples.shape[0]
    samples = samples.reshape(n, -1)
    span = min(n // 3, _WIDEST) if width is None else whole("width", width, least=1)
    if span > n - 1:
        raise InputError(f"width: {span}, but the record has {n} samples; give about {n // 3}")

    values, vectors = _windows(samples, span)
    if order is None:
        order = _order(values, n, threshold)
    most = min(span, (n - span) * samples.shape[1])
    if whole("order", order, least=1) > most:
        raise InputError(
            f"order: {order}, but {n} samples with windows of {span + 1} hold at most {most} "
            "poles; record longer, or ask for fewer"
        )
    basis = vectors[:order].T
    z = np.linalg.eigvals(np.linalg.lstsq(basis[:-1], basis[1:], rcond=None)[0])
    z = z[(z.imag >= 0.0) & (np.abs(z) > np.finfo(np.float64).eps)].astype(np.complex128)
    pole = (np.log(z) / interval).astype(np.complex128)
    pole = pole[np.argsort(np.abs(pole), kind="stable")]

    amplitude, left = _amplitudes(samples, pole * interval)
    natural = np.abs(pole)
    with np.errstate(divide="ignore", invalid="ignore"):
        damping = np.where(natural > 0.0, -pole.real / natural, 1.0)
        rest = np.sqrt(np.sum(left**2, axis=0) / np.sum(samples**2, axis=0))
    return DecayingModes(
        natural_frequency=natural / (2.0 * np.pi),
        damping_ratio=damping,
        damped_frequency=pole.imag / (2.0 * np.pi),
        pole=pole,
        amplitude=np.abs(amplitude).reshape(-1, *channels),
        phase=np.angle(amplitude).reshape(-1, *channels),
        rest=rest.reshape(channels),
        singular_values=values,
        order=order,
    )


def _windows(x: NDArray[np.float64], span: int) -> tuple[NDArray, NDArray]:
    """Singular values and right singular vectors (rows) of all windows of span + 1 samples."""
    triangle = np.zeros((0, span + 1))
    for channel in x.T:
        windows = np.lib.stride_tricks.sliding_window_view(channel, span + 1)
        for start in range(0, len(windows), _ROWS):
            # in blocks, to limit memory
            triangle = np.linalg.qr(np.vstack([triangle, windows[start : start + _ROWS]]), mode="r")
    _, values, vectors = np.linalg.svd(triangle, full_matrices=False)
    return values, vectors


def _order(values: NDArray[np.float64], n: int, threshold: float | None) -> int:
    """Number of singular values above the noise, or above a threshold."""
    if not values[0] > 0.0:
        raise InputError("x: zero throughout; there is no vibration in it")
    if threshold is None:
        noise = float(np.quantile(values, 0.25))
        level = max(_ABOVE_NOISE * noise, n * np.finfo(np.float64).eps * float(values[0]))
    else:
        level = number("threshold", threshold, above=0.0, below=1.0) * float(values[0])
    count = int(np.sum(values > level))
    if count == 0:
        raise InputError("x: nothing but noise; start the record earlier, or give `order`")
    return count


def _amplitudes(
    x: NDArray[np.float64], exponent: NDArray[np.complex128]
) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """Complex amplitudes C (modes, channels) of Re(C exp(exponent k)), and the remainder."""
    n = x.shape[0]
    # growing parts are scaled to 1 at their end, to avoid overflow
    origin = np.where(exponent.real > 0.0, n - 1, 0)
    waves = np.exp((np.arange(n)[:, np.newaxis] - origin) * exponent)
    turning = (exponent.imag > 0.0) & (exponent.imag < np.pi * (1.0 - 1e-12))
    basis = np.hstack([waves.real, -waves.imag[:, turning]])
    coefficients = np.linalg.lstsq(basis, x, rcond=None)[0]
    amplitude = coefficients[: exponent.size].astype(np.complex128)
    amplitude[turning] += 1j * coefficients[exponent.size :]
    return amplitude * np.exp(-origin * exponent)[:, np.newaxis], x - basis @ coefficients
