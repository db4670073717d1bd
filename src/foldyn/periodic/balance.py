"""Harmonic balance: the equation of motion projected on a Fourier series.

The equation for the Fourier coefficients X (c, k) is

    R(X) = w^2 D^2 X M + w D X C + P F(G X) = 0.

Here w is the base frequency, D differentiates the series, G evaluates it at the samples of a
period, F gives the forces at the samples, and P projects them on the series (alternating
frequency-time: Cameron and Griffin, J. Appl. Mech. 56, 1989). With the tangents K at the samples,
the derivative of P F(G X) is exactly P K G (Krack and Gross, Harmonic Balance for Nonlinear
Vibration Problems, 2019). The base frequency is the drive frequency divided by `multiple`, so that
motions with longer periods are included.

The series has real coefficients in the order a_0, a_1, b_1, a_2, ... of
x(tau) = a_0 + sum_k (a_k cos k tau + b_k sin k tau), where tau is the phase of the base frequency;
an even series has only cosines.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.periodic.equation import Equation, Instants
from foldyn.threads import one_thread

OVER = 8  # samples per harmonic and period
ITERATIONS = 25  # most iterations of Newton's method


class Fourier:
    """A truncated series, and the samples at which forces are evaluated.

    Parameters
    ----------
    harmonics : int
    even : bool
        Whether the series has only cosines, sampled over half the period, for motions that retrace
        their path.
    samples : int, optional
        Samples in a period; `OVER` per harmonic by default.
    """

    def __init__(self, harmonics: int, even: bool = False, samples: int | None = None) -> None:
        self.harmonics, self.even = harmonics, even
        self.samples = max(OVER * harmonics, 4 * OVER) if samples is None else samples

    @property
    def count(self) -> int:
        """Number c of coefficients."""
        return self.harmonics + 1 if self.even else 2 * self.harmonics + 1

    def memory(self, unknowns: int) -> float:
        """Bytes that a balance with this number of unknowns needs, with its derivative."""
        c, s = float(self.count), self.samples // 2 + 1 if self.even else self.samples
        return 24.0 * (c * unknowns) ** 2 + 8.0 * s * (c**2 + unknowns**2)

    @cached_property
    def order(self) -> NDArray:
        """Harmonic (c,) of each coefficient."""
        number = np.arange(self.count)
        return number if self.even else (number + 1) // 2

    @cached_property
    def phase(self) -> NDArray:
        """Phases (s,) of the samples."""
        count = self.samples // 2 + 1 if self.even else self.samples
        return 2.0 * np.pi * np.arange(count) / self.samples

    def at(self, phase: NDArray) -> NDArray:
        """Value (s, c) of each function of the series at phases (s,)."""
        angle = np.multiply.outer(phase, self.order)
        out = np.cos(angle)
        if not self.even:
            out[:, 2::2] = np.sin(angle[:, 2::2])
        return out

    @cached_property
    def values(self) -> NDArray:
        """Value (s, c) of each function of the series at the samples."""
        return self.at(self.phase)

    @cached_property
    def fit(self) -> NDArray:
        """Matrix (c, s) that projects a function, given by its samples, on the series."""
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
        """Factor (c,) of each coefficient in the second derivative: -k^2."""
        return -(self.order.astype(float) ** 2)

    def complex_of(self, coefficients: NDArray) -> NDArray:
        """Complex amplitudes (h + 1, ...) of exp(i k tau) from coefficients (c, ...)."""
        if self.even:
            return coefficients.astype(complex)
        out = np.zeros((self.harmonics + 1, *coefficients.shape[1:]), complex)
        out[0] = coefficients[0]
        out[1:] = coefficients[1::2] - 1j * coefficients[2::2]
        return out

    def real_of(self, amplitudes: NDArray[np.complex128]) -> NDArray:
        """Coefficients (c, ...) from amplitudes; missing ones are zero, surplus ones dropped."""
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


class Balance:
    """The projected equation.

    Parameters
    ----------
    equation : Equation
    fourier : Fourier
    multiple : int
        Periods of the drive in one period of the motion.
    """

    def __init__(self, equation: Equation, fourier: Fourier, multiple: int = 1) -> None:
        self.equation, self.fourier, self.multiple = equation, fourier, multiple
        self.shape = len(fourier.order), equation.size
        self._bends = fourier.curvature[:, None]

    @property
    def threads(self) -> AbstractContextManager:
        """Context that limits LAPACK to one thread if the matrix of all unknowns is small."""
        return one_thread(math.prod(self.shape))

    @cached_property
    def _pairs(self) -> NDArray:
        """Products (c c, s) of the entries of P and G at each sample."""
        pairs = self.fourier.fit[:, None, :] * self.fourier.values.T[None, :, :]
        return np.ascontiguousarray(pairs.reshape(-1, len(self.fourier.phase)))

    def instants(self, level: float = 1.0) -> Instants:
        """The equation at the samples, with all varying terms times a level."""
        return self.equation.at(self.multiple * self.fourier.phase, level)

    def residual(self, x: NDArray, omega: float, at: Instants) -> NDArray:
        """R (c, k), N, for coefficients (c, k) and a drive of omega rad/s."""
        w, fourier = omega / self.multiple, self.fourier
        force = at.forces(fourier.values @ x) + at.driving(omega)
        if not np.isfinite(force).all():  # passes through a contact
            return np.full_like(x, np.inf)
        out = w**2 * (self._bends * x) @ self.equation.mass + fourier.fit @ force
        return out if fourier.even else out + w * (fourier.rate @ x) @ self.equation.damping.T

    def jacobian(self, x: NDArray, omega: float, at: Instants) -> NDArray:
        """Derivative (c k, c k) of R with respect to the coefficients."""
        c, k = self.shape
        w, fourier, equation = omega / self.multiple, self.fourier, self.equation
        tangents = at.tangents(fourier.values @ x).reshape(len(fourier.phase), -1)
        out = (self._pairs @ tangents).reshape(c, c, k, k)
        one = np.arange(c)
        out[one, one] += w**2 * self._bends[:, :, None] * equation.mass
        if not fourier.even:
            row, column = np.nonzero(fourier.rate)
            out[row, column] += w * fourier.rate[row, column][:, None, None] * equation.damping
        return out.transpose(0, 2, 1, 3).reshape(c * k, c * k)

    def frequency_slope(self, x: NDArray, omega: float, at: Instants) -> NDArray:
        """Derivative (c, k) of R with respect to omega."""
        n, fourier, equation = self.multiple, self.fourier, self.equation
        out = 2.0 * omega / n**2 * (self._bends * x) @ equation.mass
        out += fourier.fit @ (2.0 * omega * at.inertia + at.drag)
        return out if fourier.even else out + (fourier.rate @ x) @ equation.damping.T / n

    def rounding(self) -> float:
        """Norm (N) of the residual's rounding errors."""
        return 4.0 * self.equation.rounding * np.sqrt(len(self.fourier.order))


class Converged(NamedTuple):
    """A solution found by Newton's method."""

    x: NDArray
    iterations: int


def newton(
    residual: Callable[[NDArray], NDArray], jacobian: Callable[[NDArray], NDArray], x: NDArray,
    tolerance: float, rounding: float,
) -> Converged | None:  # fmt: skip
    """Solve residual(x) = 0 for a vector x (n,); None if it does not converge.

    Steps are halved if they pass through a contact, where forces are not finite.

    Parameters
    ----------
    residual, jacobian : callable
        Functions of x (n,) that return the residual (n,) and its derivative (n, n).
    x : ndarray, shape (n,)
        Start of the iteration.
    tolerance : float
        Largest norm of the last step, as a fraction of the norm of the solution.
    rounding : float
        Rounding errors of the residual's norm.
    """
    x, step, first = x.copy(), np.zeros_like(x), np.inf
    for iteration in range(ITERATIONS):
        left = residual(x)
        norm = float(np.linalg.norm(left))
        if not np.isfinite(norm):
            step *= 0.5
            x -= step
            continue
        first = min(first, norm)
        if norm > 1e8 * max(first, rounding):
            return None
        if norm == 0.0:
            return Converged(x, iteration)
        try:
            step = np.linalg.solve(jacobian(x), -left)
        except np.linalg.LinAlgError:
            return None
        if not np.isfinite(step).all():
            return None
        x += step
        size, change = float(np.linalg.norm(x)), float(np.linalg.norm(step))
        if change <= tolerance * size or (iteration and norm <= rounding):
            return Converged(x, iteration + 1)
    return None
