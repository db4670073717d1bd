"""Families of periodic motions that continuation follows; see `continuation.Family`.

Free motions about an equilibrium are accurate for arbitrarily small amplitudes. Dihedral angles are
computed from node positions, so small motions lose as many digits as the positions are larger than
the motion. Near the equilibrium x0, forces f and energies V are therefore integrated from tangents
K,

    f(x) = int_0^1 K d ds,    V(x) = V(x0) + int_0^1 (1 - s) d' K d ds,

with d = x - x0 and K at x0 + s d. The integrals are used only if they agree with the plain values
to within the accuracy lost; they do not agree if a law has a kink in between. About the rest
position only the hinges are integrated: bar forces are accurate there for small displacements.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray

from foldyn.mechanics.assembly import Assembly
from foldyn.periodic.balance import Balance, Converged, newton
from foldyn.periodic.equation import EPS, Equation, Instants
from foldyn.periodic.orbit import Orbit

TURN = 2.0 * np.pi
PROBE = 1e-4  # step of central differences, relative to the level or the frequency
LITTLE = 1e-4  # level of the drive that is small enough for forces to be proportional to it
LEAST = 1e-12  # least size of a motion, relative to the sheet's length
SMALL = 1e-3  # largest motion that counts as small, relative to the sheet's length
# largest loss of accuracy of forces, in units of the rounding of positions divided by the motion
LOST = 100.0
SHARES = np.array([0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15)])  # Gauss points, of a step
WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0


class AboutRest(Instants):
    """The equation without its drive, about an equilibrium; see the module docstring.

    Parameters
    ----------
    place : ndarray, shape (k,)
        Unknowns x0 of the equilibrium.
    """

    def __init__(self, equation: Equation, phase: NDArray, place: NDArray) -> None:
        super().__init__(equation, phase, 0.0)
        self._place = place
        self._still = self.displacements(np.tile(place, (len(phase), 1)))[0]
        body = self.bodies[0]
        self._part: Assembly = body if self._still.any() else body.hinges_alone or body
        self._tangents = equation.tangents.of(self._part)

    def forces(self, x: NDArray) -> NDArray:
        """Forces f (s, k), N; see `Instants`."""
        plain, found = super().forces(x), self._summed(x)
        return plain if found is None else plain + found[0]

    def energies(self, x: NDArray) -> NDArray:
        """Energies (s,), J, above the equilibrium."""
        found = self._summed(x)
        if found is None:
            return super().energies(x) - super().energies(np.tile(self._place, (len(x), 1)))
        others = np.array([self._others(u) for u in (self._still, *self.displacements(x))])
        return found[1] + others[1:] - others[0]

    def _summed(self, x: NDArray) -> tuple[NDArray, NDArray] | None:
        """Correction (s, k) of the plain forces, and integrated energies (s,) above x0.

        None if motions are not small, or the integrals do not agree with the forces.
        """
        d, equation, part = x - self._place, self.equation, self._part
        size = float(np.abs(d @ equation.basis.T).max())
        if not 0.0 < size < SMALL * equation.length:
            return None
        force, energy, stiffness = np.zeros_like(d), np.zeros(len(d)), np.zeros((d.shape[1],) * 2)
        for share, weight in zip(SHARES, WEIGHTS, strict=True):
            for j, u in enumerate(self.displacements(self._place + share * d)):
                self._tangents.put(part, u, stiffness)
                pull = weight * (stiffness @ d[j])
                force[j] += pull
                energy[j] += (1.0 - share) * (d[j] @ pull)
        most = LOST * EPS * equation.length / size * np.linalg.norm(force)
        if part is self.bodies[0]:
            lost = force - super().forces(x)
            most += LOST * equation.rounding
        else:
            plain = np.array([part.internal(u) for u in self.displacements(x)])
            lost = force - plain @ equation.basis
        return (lost, energy) if np.linalg.norm(lost) <= most else None

    def _others(self, u: NDArray) -> float:
        """Energy (J) of the parts not integrated, at displacements (m,)."""
        body, part = self.bodies[0], self._part
        summed = dict(zip(part.energy_groups, part.energies(u), strict=True))
        every = zip(body.energy_groups, body.energies(u), strict=True)
        return float(sum(value - summed.get(name, 0.0) for name, value in every))


class Family:
    """Motions of a balance along a parameter p, with n unknowns z: R(z, p) = 0.

    Attributes
    ----------
    span : float
        Range of the parameter.
    rounding : float
        Norm of the residual's rounding errors.
    tolerance : float
        Largest last step of Newton's method, as a fraction of the motion.
    """

    def __init__(self, balance: Balance, span: float, tolerance: float) -> None:
        self.balance, self.span, self.tolerance = balance, span, tolerance
        self.rounding = balance.rounding()
        self._kept: tuple[float, Instants] | None = None

    def coefficients(self, z: NDArray) -> NDArray:
        """Coefficients (c, k) of the motion."""
        return z[: math.prod(self.balance.shape)].reshape(self.balance.shape)

    def instants(self, level: float) -> Instants:
        """The equation at the samples for a level; it is kept until the level changes."""
        if self._kept is None or self._kept[0] != level:
            self._kept = level, self.balance.instants(level)
        return self._kept[1]

    def size(self, z: NDArray) -> float:
        """Norm of the varying part of the motion."""
        moving = float(np.linalg.norm(self.coefficients(z)[1:]))
        return max(moving, LEAST * self.balance.equation.length)

    def own(self, z: NDArray, p: float) -> tuple[NDArray, float, float]:
        """Coefficients (c, k), and frequency (rad/s) and level of the drive."""
        raise NotImplementedError

    def at(self, z: NDArray, p: float) -> tuple[NDArray, float, Instants]:
        """Coefficients (c, k), frequency (rad/s) of the drive, and the equation at its level."""
        x, omega, level = self.own(z, p)
        return x, omega, self.instants(level)

    def residual(self, z: NDArray, p: float) -> NDArray:
        """Residual R (n,)."""
        return self.balance.residual(*self.at(z, p)).ravel()

    def jacobian(self, z: NDArray, p: float) -> NDArray:
        """Derivative (n, n) of R with respect to z."""
        return self.balance.jacobian(*self.at(z, p))

    def slope(self, z: NDArray, p: float) -> NDArray:
        """Derivative (n,) of R with respect to p: differences, exact for loads linear in p.

        It is the derivative of the balance through the level.
        """
        ends = self.own(z, p + PROBE), self.own(z, p - PROBE)
        at = self.balance.instants
        up, down = (self.balance.residual(x, omega, at(level)) for x, omega, level in ends)
        return (up - down).ravel() / (2.0 * PROBE)

    def solved(self, z: NDArray, p: float) -> Converged | None:
        """Unknowns of the motion at a parameter p near unknowns z; see `newton`."""
        residual, jacobian = partial(self.residual, p=p), partial(self.jacobian, p=p)
        return newton(residual, jacobian, z, self.tolerance, self.rounding)

    def orbit(self, z: NDArray, p: float) -> Orbit:
        """The periodic motion at unknowns z and parameter p."""
        return Orbit.of(self.balance, *self.own(z, p))


class ByFrequency(Family):
    """Forced motions along the frequency (Hz) of the drive."""

    level = 1.0

    def own(self, z: NDArray, p: float) -> tuple[NDArray, float, float]:
        """Coefficients, frequency and level; see `Family`."""
        return self.coefficients(z), TURN * p, self.level

    def slope(self, z: NDArray, p: float) -> NDArray:
        """Derivative (n,) of R with respect to p."""
        return TURN * self.balance.frequency_slope(*self.at(z, p)).ravel()


class ByLevel(Family):
    """Forced motions of one frequency along the level of the drive."""

    def __init__(self, balance: Balance, span: float, tolerance: float, frequency: float) -> None:
        super().__init__(balance, span, tolerance)
        self.omega = TURN * frequency

    def own(self, z: NDArray, p: float) -> tuple[NDArray, float, float]:
        """Coefficients, frequency and level; see `Family`."""
        return self.coefficients(z), self.omega, p


class Free(ByFrequency):
    """Free motions of an undamped sheet, along their frequency (Hz).

    An even series fixes the phase of the motions: they start at zero velocity and retrace their
    path.

    Parameters
    ----------
    place : ndarray, shape (k,)
        The equilibrium about which they vibrate.
    """

    level = 0.0

    def __init__(self, balance: Balance, span: float, tolerance: float, place: NDArray) -> None:
        super().__init__(balance, span, tolerance)
        self.place = place
        self._about = AboutRest(balance.equation, balance.fourier.phase, place)

    def instants(self, level: float) -> Instants:
        """The equation about the equilibrium, without drive."""
        return self._about


class InResonance(Family):
    """Forced motions in phase resonance, along the logarithm of the level of the drive.

    At the frequency of these motions the drive does no reactive work: the mean of force times
    displacement over a period vanishes. The force is that of a small drive on the sheet in a given
    state (Peeters, Kerschen and Golinval, Mech. Syst. Signal Process. 25, 2011). The last unknown
    is the frequency divided by `unit`, so that it counts as much as displacements of the sheet's
    size.

    Parameters
    ----------
    place : ndarray, shape (k,)
        Unknowns of the given state.
    frequency : float
        Approximate frequency of the resonance, Hz.
    """

    def __init__(
        self, balance: Balance, tolerance: float, place: NDArray, frequency: float
    ) -> None:
        super().__init__(balance, 1.0, tolerance)
        equation, fourier = balance.equation, balance.fourier
        self.unit = frequency / equation.length
        self._heavy = float(np.diag(equation.mass).max()) * (TURN * frequency) ** 2  # N/m
        at, there = balance.instants(LITTLE), np.tile(place, (len(fourier.phase), 1))
        still = at.forces(there) - balance.instants(0.0).forces(there)
        self._force = [fourier.fit @ part / LITTLE for part in (still, at.drag, at.inertia)]

    def frequency(self, z: NDArray) -> float:
        """Frequency of a motion, Hz."""
        return float(z[-1]) * self.unit

    def _reactive(self, z: NDArray) -> tuple[float, NDArray]:
        """Reactive work divided by the norm of the force, m, and its derivative (c, k)."""
        omega = TURN * self.frequency(z)
        still, drag, inertia = self._force
        force = still + omega * drag + omega**2 * inertia
        force[0] = 0.0
        force /= np.linalg.norm(force)
        return float((force * self.coefficients(z)).sum()), force

    def own(self, z: NDArray, p: float) -> tuple[NDArray, float, float]:
        """Coefficients, frequency and level; see `Family`."""
        return self.coefficients(z), TURN * self.frequency(z), float(np.exp(p))

    def residual(self, z: NDArray, p: float) -> NDArray:
        """Residual R (n,)."""
        return np.append(super().residual(z, p), self._heavy * self._reactive(z)[0])

    def jacobian(self, z: NDArray, p: float) -> NDArray:
        """Derivative (n, n) of R with respect to z."""
        at, n = self.at(z, p), len(z) - 1
        out = np.empty((n + 1, n + 1))
        out[:n, :n] = self.balance.jacobian(*at)
        out[:n, n] = TURN * self.unit * self.balance.frequency_slope(*at).ravel()
        out[n, :n] = self._heavy * self._reactive(z)[1].ravel()
        step = np.zeros(n + 1)
        step[n] = PROBE * z[-1]
        change = self._reactive(z + step)[0] - self._reactive(z - step)[0]
        out[n, n] = self._heavy * change / (2.0 * step[n])
        return out

    def slope(self, z: NDArray, p: float) -> NDArray:
        """Derivative (n,) of R with respect to p."""
        return np.append(super().slope(z, p), 0.0)
