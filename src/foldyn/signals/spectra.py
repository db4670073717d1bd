"""Amplitude spectrum of a uniformly sampled record."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.signals import records
from foldyn.values import whole

MINIMUM_SAMPLES = 4


def spectrum(
    x: ArrayLike,
    dt: float,
    *,
    axis: int = 0,
    window: records.Window = None,
    detrend: str | None = None,
    pad: int = 1,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """One-sided amplitude spectrum: a sine of amplitude A on a bin gives a peak of height A.

    The transform is divided by the sum of the window (its coherent gain) and doubled to include the
    negative frequencies; values at zero and, for an even length, at the Nyquist frequency are not
    doubled. Without window and padding Parseval's identity is
    ``mean(x**2) == a[0]**2 + sum(a[1:]**2)/2``, in which the Nyquist term (even length) is not
    halved.

    Parameters
    ----------
    x : array_like
        Real samples, in any unit; evenly spaced along `axis`.
    dt : float
        Sampling interval (s); `foldyn.signals.sampling_interval` finds and checks it.
    axis : int
        Axis along which time runs.
    window : str, tuple, array_like of shape (n,), or None
        None leaves the record as it is. A name or a (name, parameter) tuple selects the periodic
        window of `scipy.signal.get_window`; an array holds the samples of the window.
    detrend : {None, "constant", "linear"}
        Trend removed before windowing: nothing, the mean, or the straight line of best fit.
    pad : int
        Zeros are appended up to `pad` times the length. This refines the grid of frequencies, but
        not the resolution 1/(n dt).

    Returns
    -------
    frequencies : ndarray, shape (m,)
        Frequencies (Hz) from 0 to 1/(2 dt), m = pad*n//2 + 1.
    amplitude : ndarray
        Amplitudes in the unit of `x`, with the shape of `x` but m in place of n along `axis`.

    Raises
    ------
    InputError
        Fewer than 4 samples, NaN or infinity in the record, complex samples, an interval that is
        not positive, an unknown window or detrend, or a padding factor below 1.
    """
    import scipy.fft

    samples = records.real_numbers("x", x)
    if samples.ndim == 0 or not -samples.ndim <= axis < samples.ndim:
        raise InputError(f"axis: {axis} is no axis of a record of shape {samples.shape}")
    samples = records.finite("x", np.moveaxis(samples, axis, 0))
    n = samples.shape[0]
    if n < MINIMUM_SAMPLES:
        raise InputError(
            f"x: {n} samples along axis {axis}; a spectrum needs at least {MINIMUM_SAMPLES}: run "
            "longer or store more often"
        )
    interval = records.checked_interval(dt)
    length = n * whole("pad", pad, least=1)

    samples, weights = records.detrended(samples, detrend), records.checked_window(window, n)
    waves = scipy.fft.rfft(samples * records.beside(weights, samples), n=length, axis=0)
    amplitude = np.abs(waves) / weights.sum()
    doubled = slice(1, -1) if length % 2 == 0 else slice(1, None)
    amplitude[doubled] *= 2.0
    return scipy.fft.rfftfreq(length, interval), np.moveaxis(amplitude, 0, axis)
