"""Harmonic balance: the equation of motion projected on a Fourier series.

With X (c, k) the coefficients, w the base frequency and F the forces at the samples of a period,

    R(X) = w^2 D^2 X M + w D X C + P F(G X) = 0,

G the values of the series at the samples and P the projection back (alternating frequency-time:
Cameron and Griffin, J. Appl. Mech. 56, 1989). The tangents at the samples give the exact
derivative, P K G (Krack and Gross, Harmonic Balance for Nonlinear Vibration Problems, 2019). The
base frequency is the drive frequency over `multiple`, so that longer periods are included.
"""

from __future__ import annotations

import math
from contextlib import AbstractContextManager
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.periodic.equation import Equation, Instants
from foldyn.periodic.fourier import Fourier
from foldyn.threads import one_thread


class Balance:
    """The projected equation.

    Parameters
    ----------
    equation : Equation
    fourier : Fourier
    multiple : int
        Periods of the drive in one of the motion.
    """

    def __init__(self, equation: Equation, fourier: Fourier, multiple: int = 1) -> None:
        self.equation, self.fourier, self.multiple = equation, fourier, multiple
        self.shape = len(fourier.order), equation.size
        self._bends = fourier.curvature[:, None]

    @property
    def threads(self) -> AbstractContextManager:
        """Limits LAPACK to one thread for small matrices of all unknowns."""
        return one_thread(math.prod(self.shape))

    @cached_property
    def _pairs(self) -> NDArray:
        """P times G at each sample (c c, s)."""
        pairs = self.fourier.fit[:, None, :] * self.fourier.values.T[None, :, :]
        return np.ascontiguousarray(pairs.reshape(-1, len(self.fourier.phase)))

    def instants(self, level: float = 1.0) -> Instants:
        """The equation at the samples, with all varying terms times a level."""
        return self.equation.at(self.multiple * self.fourier.phase, level)

    def residual(self, x: NDArray, omega: float, at: Instants) -> NDArray:
        """R (c, k), N, of coefficients (c, k) under a drive of omega rad/s."""
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


def newton(system, x: NDArray, tolerance: float, most: int = 25) -> Converged | None:
    """Solve `system.residual(x) = 0`; None if it does not converge.

    Steps are halved if they pass through a contact, where forces are not finite.

    Parameters
    ----------
    system
        Has `residual(x)` and `jacobian(x)` of vectors (n,), and `rounding` of the residual's norm.
    tolerance : float
        Largest size of the last step, as a fraction of the solution.
    """
    x, step, first = x.copy(), np.zeros_like(x), np.inf
    for iteration in range(most):
        residual = system.residual(x)
        norm = float(np.linalg.norm(residual))
        if not np.isfinite(norm):
            step *= 0.5
            x -= step
            continue
        first = min(first, norm)
        if norm > 1e8 * max(first, system.rounding):
            return None
        if norm == 0.0:
            return Converged(x, iteration)
        try:
            step = np.linalg.solve(system.jacobian(x), -residual)
        except np.linalg.LinAlgError:
            return None
        if not np.isfinite(step).all():
            return None
        x += step
        size, change = float(np.linalg.norm(x)), float(np.linalg.norm(step))
        if change <= tolerance * size or (iteration and norm <= system.rounding):
            return Converged(x, iteration + 1)
    return None


class AtFrequency:
    """A balance at one frequency and level, in the form that Newton's method takes."""

    def __init__(self, balance: Balance, omega: float, level: float = 1.0) -> None:
        self.balance, self.omega, self.level = balance, omega, level
        self.at, self.rounding = balance.instants(level), balance.rounding()

    def residual(self, x: NDArray) -> NDArray:
        """R (c k,)."""
        return self.balance.residual(x.reshape(self.balance.shape), self.omega, self.at).ravel()

    def jacobian(self, x: NDArray) -> NDArray:
        """Derivative (c k, c k) of R."""
        return self.balance.jacobian(x.reshape(self.balance.shape), self.omega, self.at)
