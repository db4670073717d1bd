"""The generalized-alpha method of Chung and Hulbert, J. Appl. Mech. 60, 1993, and Newmark's.

Both are of order 2 and unconditionally stable for linear systems. The spectral radius r, the factor
by which a step multiplies the free vibrations of infinite frequency, is a parameter: am =
(2r - 1)/(r + 1), af = r/(r + 1), gamma = 1/2 - am + af, beta = (1 - am + af)^2 / 4. Of all methods
that damp the highest frequencies so, it damps the low ones least.
"""

from __future__ import annotations

from collections.abc import Callable

from foldyn.dynamics.implicit.alpha import Alpha, Parameters
from foldyn.dynamics.implicit.scheme import Bench

ORDER = 2
SPECTRAL_RADIUS = 0.8


def parameters(spectral_radius: float) -> Parameters:
    """Parameters of the method for a spectral radius from 0 to 1."""
    am = (2.0 * spectral_radius - 1.0) / (spectral_radius + 1.0)
    af = spectral_radius / (spectral_radius + 1.0)
    return Parameters(am, af, 0.25 * (1.0 - am + af) ** 2, 0.5 - am + af)


def newmark(bench: Bench) -> Alpha:
    """Steps of Newmark's method with constant average acceleration, the trapezoidal rule.

    N. M. Newmark, A method of computation for structural dynamics, J. Eng. Mech. Div. 85, 1959.
    Without numerical damping: a linear system keeps its energy; another one may gain some with
    large steps.
    """
    return Alpha(bench, Parameters(am=0.0, af=0.0, beta=0.25, gamma=0.5))


def scheme(spectral_radius: float = SPECTRAL_RADIUS) -> Callable[[Bench], Alpha]:
    """Make the steps of the method for a spectral radius."""

    def make(bench: Bench) -> Alpha:
        return Alpha(bench, parameters(spectral_radius), {"spectral_radius": spectral_radius})

    return make
