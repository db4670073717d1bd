"""When the free vibrations of a damped linear system stop growing under an explicit method."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Rayleigh

# of frequencies (n,), damping (n,) and a step: largest factor of a free vibration in a step (n,)
Growth = Callable[[NDArray, NDArray, float], NDArray]
_FRACTIONS = np.concatenate([[0.0], np.geomspace(1e-6, 1.0, 400)])
ROUNDING = 1e-7  # of a factor of 1: the eigenvalues of a rigid motion are double


def roots(omega: NDArray, damping: NDArray) -> NDArray:
    """Both roots (2, n) of s^2 + damping s + omega^2 = 0, the small ones without cancellation."""
    root = np.sqrt((damping**2 - 4.0 * omega**2).astype(complex))
    fast = -0.5 * (damping + root)
    slow = np.where(np.abs(fast) > 0.0, omega**2 / np.where(fast == 0.0, 1.0, fast), 0.0)
    return np.stack([fast, slow])


def is_stable(growth: Growth, omega: float, damping: Rayleigh, dt: float) -> bool:
    """Whether no free vibration of a frequency up to `omega` (rad/s) grows with steps of dt.

    The spectrum is s^2 + c s + w^2 = 0, c the damping rate at w, for all w from 0 to omega.
    """
    w = omega * _FRACTIONS
    return bool((growth(w, damping.rate(w), dt) <= 1.0 + ROUNDING).all())


def stability_limit(growth: Growth, omega: float, damping: Rayleigh) -> float:
    """Largest dt that is stable in the sense of `is_stable`.

    Infinite for a system that neither vibrates nor decays.
    """
    if omega <= 0.0 and damping.alpha <= 0.0:
        return np.inf
    w = omega * _FRACTIONS
    low, high = 0.0, 10.0 / np.abs(roots(w, damping.rate(w))).max()
    for _ in range(45):
        middle = 0.5 * (low + high)
        stable = is_stable(growth, omega, damping, middle)
        low, high = (middle, high) if stable else (low, middle)
    return low
