"""Fourier series with real coefficients, in the phase tau of the base frequency.

x(tau) = a_0 + sum_k (a_k cos k tau + b_k sin k tau) has the coefficients a_0, a_1, b_1, a_2, ...;
an even series has only cosines.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

OVER = 8  # samples per harmonic and period


class Fourier:
    """A truncated series, and the samples at which forces are evaluated.

    Parameters
    ----------
    harmonics : int
    even : bool
        Only cosines, sampled over half the period: motions that retrace their path.
    samples : int, optional
        Samples in a period; `OVER` per harmonic by default.
    """

    def __init__(self, harmonics: int, even: bool = False, samples: int | None = None) -> None:
        self.harmonics, self.even = harmonics, even
        self.samples = max(OVER * harmonics, 4 * OVER) if samples is None else samples

    def memory(self, unknowns: int) -> float:
        """Bytes of a balance with this number of unknowns, its derivative and their parts."""
        h, s = float(self.harmonics), self.samples
        c, s = (h + 1.0, s // 2 + 1) if self.even else (2.0 * h + 1.0, s)
        return 24.0 * (c * unknowns) ** 2 + 8.0 * s * (c**2 + unknowns**2)

    @cached_property
    def order(self) -> NDArray:
        """Harmonic (c,) of each coefficient."""
        if self.even:
            return np.arange(self.harmonics + 1)
        return np.concatenate([[0], np.repeat(np.arange(1, self.harmonics + 1), 2)])

    @cached_property
    def phase(self) -> NDArray:
        """Phases (s,) of the samples."""
        count = self.samples // 2 + 1 if self.even else self.samples
        return 2.0 * np.pi * np.arange(count) / self.samples

    def at(self, phase: NDArray) -> NDArray:
        """Value (s, c) of each function at phases (s,)."""
        angle = np.multiply.outer(phase, self.order)
        if self.even:
            return np.cos(angle)
        out = np.cos(angle)
        out[:, 2::2] = np.sin(angle[:, 2::2])
        return out

    @cached_property
    def values(self) -> NDArray:
        """Values (s, c) at the samples."""
        return self.at(self.phase)

    @cached_property
    def fit(self) -> NDArray:
        """Coefficients (c, s) of samples: the projection of a function on the series."""
        weight = np.full(len(self.phase), 2.0 / self.samples)
        if self.even:
            weight[1:-1] *= 2.0
        scale = np.where(self.order == 0, 0.5, 1.0)
        return scale[:, None] * self.values.T * weight

    @cached_property
    def rate(self) -> NDArray:
        """Matrix (c, c) that differentiates a series with sines once."""
        out = np.zeros((len(self.order), len(self.order)))
        for k in range(1, self.harmonics + 1):
            out[2 * k - 1, 2 * k], out[2 * k, 2 * k - 1] = k, -k
        return out

    @cached_property
    def curvature(self) -> NDArray:
        """Factors (c,) of the second derivative: -k^2."""
        return -(self.order.astype(float) ** 2)

    def complex_of(self, coefficients: NDArray) -> NDArray:
        """Amplitudes (h + 1, ...) of exp(i k tau), x = Re sum, from coefficients (c, ...)."""
        if self.even:
            return coefficients.astype(complex)
        out = np.zeros((self.harmonics + 1, *coefficients.shape[1:]), complex)
        out[0] = coefficients[0]
        out[1:] = coefficients[1::2] - 1j * coefficients[2::2]
        return out

    def real_of(self, amplitudes: NDArray[np.complex128]) -> NDArray:
        """Coefficients (c, ...) of any number of amplitudes; others are zero or dropped."""
        kept = min(len(amplitudes), self.harmonics + 1)
        out = np.zeros((len(self.order), *amplitudes.shape[1:]))
        out[0] = amplitudes[0].real
        if self.even:
            out[1:kept] = amplitudes[1:kept].real
        else:
            out[1 : 2 * kept - 1 : 2] = amplitudes[1:kept].real
            out[2 : 2 * kept - 1 : 2] = -amplitudes[1:kept].imag
        return out


def values_of(amplitudes: NDArray, phase: NDArray, derivative: int = 0) -> NDArray:
    """Values (s, ...) of Re sum_k amplitude_k exp(i k tau), or of a derivative, at phases (s,)."""
    order = np.arange(len(amplitudes))
    turned = (1j * order) ** derivative * np.exp(1j * np.multiply.outer(phase, order))
    return np.tensordot(turned, amplitudes, 1).real
