"""A periodic motion on the unknowns of an equation: derived quantities, stability, and shooting.

Collocation over a period takes implicit Runge-Kutta steps. The accelerations a_i of the three
stages of a step of length h solve

    M a_i + C (v + h sum_j A_ij a_j) + f(x + c_i h v + h^2 sum_j (A A)_ij a_j, theta_i) = 0.

Gauss's method, of order 6, is symplectic without damping, so that multipliers keep their pairs
(m, 1/m): it integrates the variational equation (Hairer, Lubich and Wanner, Geometric Numerical
Integration, 2nd ed. 2006, section II.1). Radau IIA, of order 5, damps motions that are too fast for
the steps, such as vibrations of a sheet's bars: it is used for shooting (Hairer and Wanner, Solving
Ordinary Differential Equations II, 2nd ed. 1996, section IV.5). Derivatives of a step are exact,
because the equations of the step are differentiated.

Floquet multipliers are the growth factors of small deviations from a periodic motion, per period:
the eigenvalues of the monodromy matrix, which integrates the equation linearized about the motion,
M y'' + C y' + K(t) y = 0, over one period. The motion is unstable if a multiplier exceeds 1 in
modulus (Nayfeh and Balachandran, Applied Nonlinear Dynamics, 1995, chapter 3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lu_factor, lu_solve

from foldyn.attractors.run import Stretch, measured, swing
from foldyn.mechanics.contact.term import ContactTerm
from foldyn.periodic.balance import Balance, Fourier, values_of
from foldyn.periodic.equation import Equation
from foldyn.results import Quantity
from foldyn.results.crossings import crossings_of
from foldyn.threads import one_thread

SHOWN = 128  # samples of a period, in results and to find extremes
BARELY = 1e-3  # share of a gap that remains between two samples if a motion does not cross
STAGES = 3
ROOT15, ROOT6 = np.sqrt(15.0), np.sqrt(6.0)
STEPS = 64  # integration steps in a period of the drive
NEUTRAL = 1e-6  # excess of a modulus over 1 that counts as round-off


class Tableau:
    """Coefficients of a collocation method, for velocities and for displacements.

    Those for velocities are the integrals of the polynomials that are 1 at one of the stages, at
    fractions c (3,) of a step, and 0 at the others: up to each stage (a), and up to the end (b).
    """

    def __init__(self, c: NDArray) -> None:
        power = np.arange(1, STAGES + 1)
        polynomials = np.linalg.inv(c[:, None] ** (power - 1))  # coefficients, by columns
        self.c, self.b = c, 1.0 / power @ polynomials
        self.a = c[:, None] ** power / power @ polynomials
        self.aa, self.ba = self.a @ self.a, self.b @ self.a


GAUSS = Tableau(0.5 + ROOT15 / 10.0 * np.array([-1.0, 0.0, 1.0]))
RADAU = Tableau(np.array([(4.0 - ROOT6) / 10.0, (4.0 + ROOT6) / 10.0, 1.0]))
ITERATIONS = 30
SETTLED = 1e-10  # largest last Newton step within a time step, relative to the acceleration
STUCK = 0.5  # a Newton step above this fraction of the previous one means round-off is reached


def stage_phases(steps: int, tableau: Tableau = GAUSS) -> NDArray:
    """Phases (steps, 3) of the stages in a period of 2 pi."""
    return 2.0 * np.pi / steps * (np.arange(steps)[:, None] + tableau.c)


class Stages:
    """Steps of a fixed length h, for an equation with k unknowns, the first n of which have mass.

    A state is the k unknowns, followed by the velocities of those with mass. Stages a (3, k, ...)
    are accelerations; of unknowns without mass, velocities.
    """

    def __init__(
        self, mass: NDArray, damping: NDArray, h: float, tableau: Tableau, heavy: int
    ) -> None:
        self.mass, self.damping, self.h, self.c, k = mass, damping, h, tableau.c, len(mass)
        light, self._heavy, self._size = np.arange(k) >= heavy, heavy, STAGES * k
        a, aa = tableau.a[:, :, None], tableau.aa[:, :, None]
        b, ba = tableau.b[:, None], tableau.ba[:, None]
        self._moved = np.where(light, h * a, h**2 * aa)  # (3, 3, k) displacements by stages
        self._sped = np.where(light, np.eye(STAGES)[:, :, None], h * a)  # velocities by stages
        self._ends = np.where(light, h * b, h**2 * ba), np.where(light, 0.0, h * b)
        self._fixed = np.einsum("ab,ij->aibj", np.eye(STAGES), mass)
        self._fixed += np.einsum("abj,ij->aibj", self._sped, damping)

    def parts(self, state: NDArray) -> tuple[NDArray, NDArray]:
        """Displacements and velocities (k, ...) in a state; 0 of unknowns without mass."""
        k = len(self.mass)
        v = np.zeros_like(state[:k])
        v[: self._heavy] = state[k:]
        return state[:k], v

    def at(self, state: NDArray, a: NDArray) -> tuple[NDArray, NDArray]:
        """Displacements and velocities (3, k, ...) at the stages of a step from a state."""
        x, v = self.parts(state)
        ahead = x + self.h * np.multiply.outer(self.c, v)
        moved, sped = (np.einsum("abj,bj...->aj...", by, a) for by in (self._moved, self._sped))
        return ahead + moved, v + sped

    def end(self, state: NDArray, a: NDArray) -> NDArray:
        """The state one step later."""
        x, v = self.parts(state)
        moved, sped = (np.einsum("bj,bj...->j...", by, a) for by in self._ends)
        return np.concatenate([x + self.h * v + moved, (v + sped)[: self._heavy]])

    def factors(self, stiffness: NDArray):
        """Factors of the stages' matrix for stiffnesses (3, k, k)."""
        added = np.einsum("abj,aij->aibj", self._moved, stiffness)
        return lu_factor((self._fixed + added).reshape(self._size, self._size))

    def tangent_step(self, factors, stiffness: NDArray, motion: NDArray) -> NDArray:
        """States (k + n, ...) of the linear equation one step later."""
        x, v = self.parts(motion)
        ahead = x + self.h * np.multiply.outer(self.c, v)
        right = -(stiffness @ ahead) - self.damping @ v
        a = lu_solve(factors, right.reshape(self._size, -1)).reshape(STAGES, *x.shape)
        return self.end(motion, a)


def monodromy(equation: Equation, stiffness: NDArray, w: float, drag: float) -> NDArray:
    """Matrix of small motions (x, dx/dtau) over a period, for tangents (steps, 3, k, k).

    Unknowns without mass are condensed; if damping delays them, they are part of the motion, and
    tangents are those at the stages of Radau's method, at which they keep no error of their start.

    w : base frequency, rad/s; drag : 1/s. The factor exp(-drag t / 2) is removed from the motion
    before integration, and restored exactly.
    """
    half, delays, steps = 0.5 * drag, equation.delays, len(stiffness)
    k = equation.size if delays else equation.heavy
    stiffness = stiffness if delays else equation.condensed(stiffness)
    mass, damping = equation.mass[:k, :k], equation.damping[:k, :k]
    stages = Stages(
        w**2 * mass, w * (damping - drag * mass), 2.0 * np.pi / steps,
        RADAU if delays else GAUSS, equation.heavy,
    )  # fmt: skip
    shift = half * damping - half**2 * mass
    motion = np.eye(k + equation.heavy)
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

    def __init__(self, equation: Equation, omega: float, steps: int, multiple: int = 1) -> None:
        self.equation, self.omega, self.w = equation, omega, omega / multiple
        self.steps = steps * multiple
        self._at = [equation.at(multiple * row) for row in stage_phases(self.steps, RADAU)]
        self._stages = Stages(
            self.w**2 * equation.mass, self.w * equation.damping, 2.0 * np.pi / self.steps, RADAU,
            equation.heavy,
        )  # fmt: skip
        self._last: tuple[bytes, NDArray, NDArray] | None = None

    def residual(self, y: NDArray) -> NDArray:
        """End of the period minus its start (2k,)."""
        return self.period(y)[0][-1] - y

    def jacobian(self, y: NDArray) -> NDArray:
        """Derivative of the residual: the monodromy matrix minus the identity."""
        return self.period(y)[1] - np.eye(len(y))

    def period(self, y: NDArray) -> tuple[NDArray, NDArray]:
        """States (steps + 1, 2k) from a start (2k,), and derivative (2k, 2k) of the last state."""
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
        stages, driven = self._stages, at.driving(self.omega)
        last, step = np.inf, np.zeros_like(a)
        stiffness, factors = np.zeros(0), None
        for iteration in range(ITERATIONS):
            stage, speed = stages.at(y, a)
            left = a @ stages.mass + speed @ stages.damping.T + at.forces(stage) + driven
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
        return stages.end(y, a), stages.tangent_step(factors, stiffness, motion), a


def is_stable(found: NDArray) -> bool:
    """Whether no small deviation grows."""
    return bool(np.abs(found).max() <= 1.0 + NEUTRAL)


@dataclass(frozen=True, eq=False)
class Orbit:
    """A periodic motion.

    Attributes
    ----------
    equation : Equation
    amplitudes : ndarray, complex, shape (h + 1, k)
        Amplitudes of exp(i j tau) of the unknowns, m; tau is the phase in the motion's period.
    omega : float
        Frequency of the drive (without a drive, of the motion), rad/s.
    multiple : int
        Periods of the drive in one period of the motion.
    level : float
        Factor on all varying terms.
    """

    equation: Equation
    amplitudes: NDArray
    omega: float
    multiple: int = 1
    level: float = 1.0

    @classmethod
    def of(cls, balance: Balance, x: NDArray, omega: float, level: float = 1.0) -> Orbit:
        """The motion with Fourier coefficients (c k,) or (c, k)."""
        amplitudes = balance.fourier.complex_of(x.reshape(balance.shape))
        return cls(balance.equation, amplitudes, omega, balance.multiple, level)

    @property
    def period(self) -> float:
        """Period of the motion, s."""
        return 2.0 * np.pi * self.multiple / self.omega

    def dofs(self, phase: NDArray) -> NDArray:
        """Displacements (s, m) of all dofs at phases (s,) of the motion."""
        at = self.equation.at(self.multiple * phase, self.level)
        return at.displacements(values_of(self.amplitudes, phase))

    def displacement(self, phase: NDArray) -> NDArray:
        """Displacements (s, n, 3), m, of all nodes at phases (s,) of the motion."""
        return self.equation.nodal(self.dofs(phase))

    def velocity(self, phase: NDArray) -> NDArray:
        """Velocities (s, n, 3), m/s, of all nodes at phases (s,) of the motion."""
        drive, size = self.equation.drive, self.equation.body.size
        level = self.level * self.equation.level
        moved = drive.sums(drive.moves, self.multiple * phase, level, size)[1]
        own = values_of(self.amplitudes, phase, 1) @ self.equation.basis.T / self.multiple
        return self.omega * self.equation.nodal(own + moved)

    def node_amplitudes(self) -> NDArray:
        """Complex amplitudes (h + 1, n, 3), m, of all nodes, including the motion of supports."""
        most = max(len(self.amplitudes) - 1, self.multiple * self.equation.drive.highest)
        count = 2 * most + 2
        values = self.displacement(2.0 * np.pi * np.arange(count) / count)
        found = np.fft.rfft(values, axis=0)[: most + 1] / count
        found[1:] *= 2.0
        return found

    def crosses(self) -> bool:
        """Whether the motion passes through a contact."""
        case, body = self.equation.case, self.equation.body
        if case.contact is None:
            return False
        phase = 2.0 * np.pi * np.arange(SHOWN + 1) / SHOWN
        at = self.equation.at(self.multiple * phase, self.level)
        u = at.displacements(values_of(self.amplitudes, phase))
        if len(crossings_of(case, self.equation.nodal(u[:1])).crossed):
            return True
        parts = zip(u[:-1], np.diff(u, axis=0), at.planes, np.diff(at.planes, axis=0), strict=False)
        return any(
            body.displaced(moved).term(ContactTerm).clear(here, step, moves, BARELY) < 1.0
            for here, step, moved, moves in parts
        )

    def multipliers(self, steps: int) -> NDArray:
        """Floquet multipliers, the largest first; steps : steps in a period of the drive."""
        equation = self.equation
        phase = stage_phases(self.multiple * steps, RADAU if equation.delays else GAUSS)
        at = equation.at(self.multiple * phase.ravel(), self.level)
        tangents = at.tangents(values_of(self.amplitudes, phase.ravel()))
        stiffness = tangents.reshape(*phase.shape, equation.size, equation.size)
        w = self.omega / self.multiple
        with one_thread(STAGES * equation.size):
            found = np.linalg.eigvals(monodromy(equation, stiffness, w, equation.alpha))
        return found[np.argsort(-np.abs(found), kind="stable")]

    def truncation(self) -> float:
        """Estimated effect of twice as many harmonics, as a fraction of the motion.

        It is the residual at the additional harmonics divided by the mean dynamic stiffness at
        these harmonics.
        """
        kept, equation = len(self.amplitudes) - 1, self.equation
        fourier = Fourier(2 * kept + 1)  # 2 kept + 1 is odd: even ones may vanish by symmetry
        balance = Balance(equation, fourier, self.multiple)
        x, at = fourier.real_of(self.amplitudes), balance.instants(self.level)
        left = balance.residual(x, self.omega, at)
        if not np.isfinite(left).all():  # passes through a contact between its samples
            return np.inf
        missing = fourier.complex_of(left)[kept + 1 :]
        few = equation.at(self.multiple * fourier.phase[::4], self.level)
        mean = few.tangents(fourier.values[::4] @ x).mean(axis=0)
        added = equation.responses(mean, self.omega / self.multiple, missing, kept + 1)
        size = float(np.linalg.norm(self.amplitudes[1:]))
        return float(np.linalg.norm(added)) / size if size else 0.0

    def reduction(self) -> float:
        """Estimated effect of the omitted unknowns, as a fraction of the motion; see `truncation`.

        0 for an equation that is not reduced.
        """
        whole = self.equation.whole
        if whole is self.equation:
            return 0.0
        fourier = Fourier(len(self.amplitudes) - 1)
        balance, phase = Balance(whole, fourier, self.multiple), fourier.phase
        at = balance.instants(self.level)
        states = whole.coordinates(self.dofs(phase), at)
        x = fourier.fit @ states
        left = fourier.complex_of(balance.residual(x, self.omega, at))
        few = whole.at(self.multiple * phase[::4], self.level)
        mean = few.tangents(states[::4]).mean(axis=0)
        added = whole.responses(mean, self.omega / self.multiple, left, 0)
        return float(np.linalg.norm(added) / np.linalg.norm(fourier.complex_of(x)[1:]))


def along(orbits: list[Orbit]) -> dict[str, NDArray]:
    """Variables of the points of a curve or backbone: amplitudes of all nodes, and errors."""
    nodes = [orbit.node_amplitudes() for orbit in orbits]
    coefficient = np.zeros((len(nodes), max(map(len, nodes)), *nodes[0].shape[1:]), complex)
    for row, own in zip(coefficient, nodes, strict=True):
        row[: len(own)] = own
    truncation = np.array([orbit.truncation() for orbit in orbits])
    found = {"coefficient": coefficient, "truncation": truncation}
    if orbits[0].equation.whole is not orbits[0].equation:
        found["reduction"] = np.array([orbit.reduction() for orbit in orbits])
    return found


def amplitude(orbit: Orbit, measure: Quantity | None) -> float:
    """Amplitude of a measure or, without a measure, of the node that swings most."""
    phase = _phases()
    u = orbit.displacement(phase)
    if measure is None:
        return float(swing(u).max())
    time = phase / (2.0 * np.pi) * orbit.period
    return float(swing(measured(measure, Stretch(time, u, orbit.velocity(phase)))))


def amplitudes_of(coefficient: NDArray) -> NDArray[np.float64]:
    """Largest nodal amplitudes (p,), m, of motions with coefficients (p, h + 1, n, 3)."""
    return np.array([swing(values_of(one, _phases())).max() for one in coefficient])


def _phases() -> NDArray[np.float64]:
    """Phases of the samples of a period, and one phase beyond its end."""
    return 2.0 * np.pi * np.arange(SHOWN + 2) / SHOWN
