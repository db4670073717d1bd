"""Collocation over a period: implicit Runge-Kutta steps, their derivatives, and shooting.

The accelerations a_i of the three stages of a step of length h solve

    M a_i + C (v + h sum_j A_ij a_j) + f(x + c_i h v + h^2 sum_j (A A)_ij a_j, theta_i) = 0.

Gauss's method, of order 6, is symplectic without damping, so that multipliers keep their pairs
(m, 1/m): it integrates the variational equation (Hairer, Lubich and Wanner, Geometric Numerical
Integration, 2nd ed. 2006, section II.1). Radau's IIA, of order 5, damps motions faster than the
steps, such as vibrations of a sheet's bars: it is used for shooting (Hairer and Wanner, Solving
Ordinary Differential Equations II, 2nd ed. 1996, section IV.5). Derivatives of a step are exact:
they are derivatives of its own equations.

Floquet multipliers are the growth factors of small deviations from a periodic motion, per period:
the eigenvalues of the monodromy matrix, which integrates the equation linearized about the motion,
M y'' + C y' + K(t) y = 0, over one period. The motion is unstable if one of them exceeds 1 in
modulus (Nayfeh and Balachandran, Applied Nonlinear Dynamics, 1995, chapter 3).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lu_factor, lu_solve

from foldyn.periodic.balance import values_of
from foldyn.periodic.equation import Equation
from foldyn.threads import one_thread

STAGES = 3
ROOT15, ROOT6 = np.sqrt(15.0), np.sqrt(6.0)
STEPS = 64  # in a period of the drive
NEUTRAL = 1e-6  # above 1: round-off in an undamped motion


class Tableau:
    """Coefficients of a collocation method, including those for displacements."""

    def __init__(self, c: NDArray, b: NDArray, a: NDArray) -> None:
        self.c, self.b, self.a, self.aa, self.ba = c, b, a, a @ a, b @ a


GAUSS = Tableau(
    np.array([0.5 - ROOT15 / 10.0, 0.5, 0.5 + ROOT15 / 10.0]),
    np.array([5.0, 8.0, 5.0]) / 18.0,
    np.array(
        [
            [5 / 36, 2 / 9 - ROOT15 / 15, 5 / 36 - ROOT15 / 30],
            [5 / 36 + ROOT15 / 24, 2 / 9, 5 / 36 - ROOT15 / 24],
            [5 / 36 + ROOT15 / 30, 2 / 9 + ROOT15 / 15, 5 / 36],
        ]
    ),
)
RADAU = Tableau(
    np.array([(4 - ROOT6) / 10, (4 + ROOT6) / 10, 1.0]),
    np.array([(16 - ROOT6) / 36, (16 + ROOT6) / 36, 1 / 9]),
    np.array(
        [
            [(88 - 7 * ROOT6) / 360, (296 - 169 * ROOT6) / 1800, (-2 + 3 * ROOT6) / 225],
            [(296 + 169 * ROOT6) / 1800, (88 + 7 * ROOT6) / 360, (-2 - 3 * ROOT6) / 225],
            [(16 - ROOT6) / 36, (16 + ROOT6) / 36, 1 / 9],
        ]
    ),
)
ITERATIONS = 30
SETTLED = 1e-10  # of the acceleration: last Newton step within a time step
STUCK = 0.5  # of the previous step: a larger one means that round-off is reached


def stage_phases(steps: int, tableau: Tableau = GAUSS) -> NDArray:
    """Phases (steps, 3) of the stages in a period of 2 pi."""
    return 2.0 * np.pi / steps * (np.arange(steps)[:, None] + tableau.c)


class Stages:
    """Matrices of steps of one length for a linear equation of k unknowns."""

    def __init__(self, mass: NDArray, damping: NDArray, h: float, tableau: Tableau) -> None:
        self.mass, self.damping, self.h, self.tableau, k = mass, damping, h, tableau, len(mass)
        fixed = np.einsum("ab,ij->aibj", np.eye(STAGES), mass)
        fixed += h * np.einsum("ab,ij->aibj", tableau.a, damping)
        self._fixed, self._size = fixed, STAGES * k

    def factors(self, stiffness: NDArray):
        """Factors of the stages' matrix for stiffnesses (3, k, k)."""
        added = self.h**2 * np.einsum("ab,aij->aibj", self.tableau.aa, stiffness)
        return lu_factor((self._fixed + added).reshape(self._size, self._size))

    def tangent_step(self, factors, stiffness: NDArray, motion: NDArray) -> NDArray:
        """Motions (2k, n), displacements over velocities, one step later."""
        h, k, tableau = self.h, len(self.mass), self.tableau
        x, v = motion[:k], motion[k:]
        ahead = x + h * tableau.c[:, None, None] * v
        right = -(stiffness @ ahead) - self.damping @ v
        a = lu_solve(factors, right.reshape(self._size, -1)).reshape(STAGES, k, -1)
        after = x + h * v + h**2 * np.tensordot(tableau.ba, a, 1)
        return np.concatenate([after, v + h * np.tensordot(tableau.b, a, 1)])


def monodromy(equation: Equation, stiffness: NDArray, w: float, drag: float) -> NDArray:
    """Matrix (2k, 2k) of small motions (x, dx/dtau) over a period, for tangents (steps, 3, k, k).

    w : base frequency, rad/s; drag : 1/s. The factor exp(-drag t / 2) is removed from the motion
    before integration, and restored exactly.
    """
    half = 0.5 * drag
    mass, damping = equation.mass, equation.damping
    steps, k = len(stiffness), equation.size
    stages = Stages(w**2 * mass, w * (damping - drag * mass), 2.0 * np.pi / steps, GAUSS)
    shift = half * damping - half**2 * mass
    motion = np.eye(2 * k)
    for tangent in stiffness:
        left = tangent - shift
        motion = stages.tangent_step(stages.factors(left), left, motion)
    return np.exp(-half * 2.0 * np.pi / w) * motion


class Shooting:
    """A period of the motion as a function of its start (x, dx/dtau), for Newton's method.

    Parameters
    ----------
    equation : Equation
    omega : float
        Frequency of the drive, rad/s.
    steps : int
        Steps in a period of the drive.
    multiple : int
        Periods of the drive in one period of the motion.
    """

    rounding = 0.0

    def __init__(
        self, equation: Equation, omega: float, steps: int, multiple: int = 1, level: float = 1.0
    ) -> None:
        self.equation, self.omega, self.w = equation, omega, omega / multiple
        self.steps = steps * multiple
        self._at = [equation.at(multiple * row, level) for row in stage_phases(self.steps, RADAU)]
        self._stages = Stages(
            self.w**2 * equation.mass, self.w * equation.damping, 2.0 * np.pi / self.steps, RADAU
        )
        self._last: tuple[bytes, NDArray, NDArray] | None = None

    def residual(self, y: NDArray) -> NDArray:
        """End of the period minus its start (2k,)."""
        return self.period(y)[0][-1] - y

    def jacobian(self, y: NDArray) -> NDArray:
        """Derivative of the residual: the monodromy matrix minus the identity."""
        return self.period(y)[1] - np.eye(len(y))

    def period(self, y: NDArray) -> tuple[NDArray, NDArray]:
        """States (steps + 1, 2k) from a start (2k,), and the derivative (2k, 2k) of the last."""
        key = y.tobytes()
        if self._last is None or self._last[0] != key:
            states, motion, a = [y], np.eye(len(y)), np.zeros((STAGES, self.equation.size))
            for at in self._at:
                end, motion, a = self._step(states[-1], motion, a, at)
                states.append(end)
            self._last = key, np.array(states), motion
        return self._last[1], self._last[2]

    def _step(self, y: NDArray, motion: NDArray, a: NDArray, at) -> tuple:
        """State, derivative and stage accelerations after one step of Radau's method."""
        stages, h, k = self._stages, self._stages.h, self.equation.size
        x, v, driven = y[:k], y[k:], at.driving(self.omega)
        ahead, last, step = x + h * RADAU.c[:, None] * v, np.inf, np.zeros_like(a)
        stiffness, factors = np.zeros(0), None
        for iteration in range(ITERATIONS):
            stage = ahead + h**2 * RADAU.aa @ a
            left = (
                a @ stages.mass
                + (v + h * RADAU.a @ a) @ stages.damping.T
                + at.forces(stage)
                + driven
            )
            if iteration and not np.isfinite(left).all():  # passes through a contact
                step *= 0.5
                a = a + step
                continue
            stiffness = at.tangents(stage)
            factors = stages.factors(stiffness)
            step = lu_solve(factors, left.ravel()).reshape(a.shape)
            a = a - step
            change = np.abs(step).max()
            if not change > SETTLED * np.abs(a).max() or (iteration > 2 and change > STUCK * last):
                break
            last = change
        motion = stages.tangent_step(factors, stiffness, motion)
        end = np.concatenate([x + h * v + h**2 * RADAU.ba @ a, v + h * RADAU.b @ a])
        return end, motion, a


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
