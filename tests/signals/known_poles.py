"""Systems of known poles: their frequency response, free vibration and response to any force."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter


class Mode(NamedTuple):
    """receptance = constant / (w0^2 - w^2 + 2 i z w0 w)."""

    frequency: float  # w0 / (2 pi), Hz
    damping: float  # z
    constant: float = 1.0  # 1/kg

    @property
    def pole(self) -> complex:
        w0 = 2 * np.pi * self.frequency
        return w0 * complex(-self.damping, np.sqrt(1 - self.damping**2))

    @property
    def residue(self) -> complex:
        """Impulse response = 2 Re(residue exp(pole t)) = constant / w_d exp(-z w0 t) sin(w_d t)."""
        return self.constant / (2j * self.pole.imag)


# the three peaks of the paper's specimen, with damping as large as there
SPECIMEN = (Mode(3.8, 0.05, 1.0), Mode(9.3, 0.135, 2.0), Mode(16.7, 0.09, -1.5))


def receptance(f: NDArray, *modes: Mode) -> NDArray[np.complex128]:
    w = 2j * np.pi * np.asarray(f)
    return sum(
        mode.residue / (w - mode.pole) + np.conj(mode.residue) / (w - np.conj(mode.pole))
        for mode in modes
    )


def free_vibration(t: NDArray, *parts: tuple[float, float, float, float]) -> NDArray:
    """Sum of decaying cosines from (frequency, damping ratio, amplitude, phase)."""
    return sum(
        amplitude * np.real(np.exp(Mode(frequency, damping).pole * t + 1j * phase))
        for frequency, damping, amplitude, phase in parts
    )


def _recursion(pole: complex, dt: float) -> tuple[complex, complex, complex]:
    """q' = pole q + f with f straight between samples: q[k+1] = E q[k] + a f[k] + b f[k+1]."""
    E = np.exp(pole * dt)
    b = (E - 1 - pole * dt) / (pole**2 * dt)
    return E, (E - 1) / pole - b, b


def response(force: NDArray, dt: float, *modes: Mode) -> NDArray:
    """Displacement from rest under a force that is straight between its samples: exact."""
    x = np.zeros_like(force)
    for mode in modes:
        E, a, b = _recursion(mode.pole, dt)
        q = lfilter([b, a], [1, -E], force)
        q -= b * force[..., :1] * E ** np.arange(force.shape[-1])  # at rest at the first sample
        x = x + 2 * np.real(mode.residue * q)
    return x


def sampled_receptance(f: NDArray, dt: float, *modes: Mode) -> NDArray[np.complex128]:
    """What the samples of `response` are to those of its force: receptance as dt goes to 0."""
    late = np.exp(-2j * np.pi * np.asarray(f) * dt)
    total = 0
    for mode in modes:
        for half in (np.positive, np.conj):
            E, a, b = _recursion(half(mode.pole), dt)
            total = total + half(mode.residue) * (b + a * late) / (1 - E * late)
    return total


def burst_random(rng: np.random.Generator, records: int, n: int, burst: float = 0.5) -> NDArray:
    """White noise in the first part of each record, then silence, shape (records, n)."""
    force = rng.normal(size=(records, n))
    force[:, int(burst * n) :] = 0.0
    force[:, 0] = 0.0
    return force


def cramer_rao(model: Callable[[NDArray], NDArray], p: NDArray, noise: float) -> NDArray:
    """Least standard deviations of the parameters p that white noise in model(p) leaves."""
    steps = 1e-6 * np.maximum(np.abs(p), 1e-3)
    slopes = []
    for k, step in enumerate(steps):
        shift = step * (np.arange(p.size) == k)
        slopes.append((model(p + shift) - model(p - shift)) / (2 * step))
    J = np.stack(slopes, axis=1)
    return noise * np.sqrt(np.diag(np.linalg.inv(J.T @ J)))
