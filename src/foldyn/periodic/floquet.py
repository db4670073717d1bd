"""Floquet multipliers: growth factors of small deviations from a periodic motion, per period.

They are the eigenvalues of the monodromy matrix, which integrates the equation linearized about the
motion, M y'' + C y' + K(t) y = 0, over one period. The motion is unstable if one of them exceeds 1
in modulus (Nayfeh and Balachandran, Applied Nonlinear Dynamics, 1995, chapter 3).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.periodic.collocation import STAGES, monodromy, stage_phases
from foldyn.periodic.equation import Equation
from foldyn.periodic.fourier import values_of
from foldyn.threads import one_thread

STEPS = 64  # in a period of the drive
NEUTRAL = 1e-6  # above 1: round-off in an undamped motion


def multipliers(
    equation: Equation, amplitudes: NDArray, omega: float, multiple: int = 1, level: float = 1.0,
    steps: int = STEPS,
) -> NDArray:  # fmt: skip
    """Multipliers (2k,) of a motion, the largest first.

    Parameters
    ----------
    equation : Equation
    amplitudes : ndarray, shape (h + 1, k)
        Complex amplitudes of the unknowns.
    omega : float
        Frequency of the drive, rad/s.
    multiple : int
        Periods of the drive in one period of the motion.
    level : float
        Factor on all varying terms.
    steps : int
        Integration steps in a period of the drive.
    """
    phase = stage_phases(multiple * steps)
    at = equation.at(multiple * phase.ravel(), level)
    tangents = at.tangents(values_of(amplitudes, phase.ravel()))
    stiffness = tangents.reshape(*phase.shape, equation.size, equation.size)
    with one_thread(STAGES * equation.size):
        found = np.linalg.eigvals(monodromy(equation, stiffness, omega / multiple, equation.alpha))
    return found[np.argsort(-np.abs(found), kind="stable")]


def is_stable(found: NDArray) -> bool:
    """Whether no small deviation grows."""
    return bool(np.abs(found).max() <= 1.0 + NEUTRAL)
