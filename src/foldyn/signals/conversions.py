"""Conversions between receptance, mobility and accelerance; transmissibility."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.signals.records import DERIVATIVES, beside, checked_frequencies
from foldyn.values import choice


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
        Response per force (m/N, m/(N s) or m/(N s^2)), or any motion per any input.
    source, target : {"receptance", "mobility", "accelerance"}
        Given and wanted quantity.

    Returns
    -------
    ndarray, shape (m, ...), complex
        The response; NaN at 0 Hz if a division by i w would be needed.

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
    order = (
        DERIVATIVES[choice("target", target, DERIVATIVES)]
        - DERIVATIVES[choice("source", source, DERIVATIVES)]
    )
    f, H = _over_frequency(frequency, response)
    if order == 0:
        return H
    iw = 2j * np.pi * np.where((f == 0.0) & (order < 0), np.nan, f)
    with np.errstate(invalid="ignore"):
        return H * beside(iw**order, H)


def transmissibility(response: ArrayLike, reference: ArrayLike) -> NDArray[np.complex128]:
    """Motion at one point per motion at another, both under the same excitation.

    Parameters
    ----------
    response : array_like, shape (m, ...), complex
        Frequency response of the points of interest.
    reference : array_like, shape (m,), complex
        Response of the reference, of the same quantity and excitation.

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

    x = y + z with z the motion relative to the base, and H = z / y'' = z / (-w^2 y) gives
    x / y = 1 - w^2 H. A structure on a moving base obeys its equation of motion in z with the force
    -M r y'', so that H is the relative response per base acceleration.

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
