"""Families of periodic motions that continuation follows; see `continuation.Family`.

Free motions about an equilibrium are accurate for arbitrarily small amplitudes. Dihedrals are
computed from node positions, and lose the digits by which these exceed the motion. So near the
equilibrium x0 forces f and energies V are integrated from tangents K,

    f(x) = int_0^1 K d ds,    V(x) = V(x0) + int_0^1 (1 - s) d' K d ds,

with d = x - x0 and K at x0 + s d. The integrals count only if they agree with the plain values to
within the accuracy lost, which fails where laws bend in between. About the rest position only the
hinges are integrated: bars are accurate there for small displacements.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from foldyn.mechanics.assembly import Assembly
from foldyn.periodic.balance import Balance
from foldyn.periodic.equation import EPS, Equation, Instants
from foldyn.periodic.orbit import Orbit

TURN = 2.0 * np.pi
PROBE = 1e-4  # of the level, or of the frequency: step of central differences
LITTLE = 1e-4  # level at which forces of a drive are proportional to it
LEAST = 1e-12  # of the sheet's length: least size of a motion
SMALL = 1e-3  # of the sheet: largest motion that counts as small
LOST = 100.0  # times the rounding of positions over the motion: largest loss of accuracy of forces
SHARES = np.array([0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15)])  # Gauss's
WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0


class AboutRest(Instants):
    """The equation without its drive, about an equilibrium; see the module docstring.

    Parameters
    ----------
    place : ndarray, shape (k,)
        x0.
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
        """Correction (s, k) of the forces, and integrated energies (s,) above x0.

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


class _OfBalance:
    """Common base of the families of a balance."""

    def __init__(self, balance: Balance, span: float, tolerance: float) -> None:
        self.balance, self.span, self.tolerance = balance, span, tolerance
        self.rounding = balance.rounding()
        self._kept: tuple[float, Instants] | None = None

    def coefficients(self, z: NDArray) -> NDArray:
        """Coefficients (c, k) of the motion."""
        return z[: math.prod(self.balance.shape)].reshape(self.balance.shape)

    def instants(self, level: float) -> Instants:
        """The equation at the samples; the one of the last level is kept."""
        if self._kept is None or self._kept[0] != level:
            self._kept = level, self.balance.instants(level)
        return self._kept[1]

    def size(self, z: NDArray) -> float:
        """Norm of the varying part of the motion."""
        moving = float(np.linalg.norm(self.coefficients(z)[1:]))
        return max(moving, LEAST * self.balance.equation.length)

    def own(self, z: NDArray, p: float) -> tuple[NDArray, float, float]:
        """Coefficients (c, k), frequency of the drive (rad/s) and its level."""
        raise NotImplementedError

    def at(self, z: NDArray, p: float) -> tuple[NDArray, float, Instants]:
        """Coefficients (c, k), frequency of the drive (rad/s) and the equation at its level."""
        x, omega, level = self.own(z, p)
        return x, omega, self.instants(level)

    def residual(self, z: NDArray, p: float) -> NDArray:
        """Residual R (n,); see `Family`."""
        return self.balance.residual(*self.at(z, p)).ravel()

    def jacobian(self, z: NDArray, p: float) -> NDArray:
        """Derivative (n, n) of R by z; see `Family`."""
        return self.balance.jacobian(*self.at(z, p))

    def by_level(self, z: NDArray, p: float) -> NDArray:
        """Derivative (c k,) of the balance by p, which sets the level, from differences."""
        up, down = (
            self.balance.residual(x, omega, self.balance.instants(level))
            for x, omega, level in (self.own(z, p + PROBE), self.own(z, p - PROBE))
        )
        return (up - down).ravel() / (2.0 * PROBE)

    def orbit(self, z: NDArray, p: float) -> Orbit:
        """The motion."""
        return Orbit.of(self.balance, *self.own(z, p))


class ByFrequency(_OfBalance):
    """Forced motions along the frequency (Hz) of the drive."""

    level = 1.0

    def own(self, z: NDArray, p: float) -> tuple[NDArray, float, float]:
        """Coefficients, frequency and level; see `_OfBalance`."""
        return self.coefficients(z), TURN * p, self.level

    def slope(self, z: NDArray, p: float) -> NDArray:
        """Derivative (n,) of R by p; see `Family`."""
        return TURN * self.balance.frequency_slope(*self.at(z, p)).ravel()


class ByLevel(_OfBalance):
    """Forced motions of one frequency along the level of the drive."""

    def __init__(self, balance: Balance, span: float, tolerance: float, frequency: float) -> None:
        super().__init__(balance, span, tolerance)
        self.omega = TURN * frequency

    def own(self, z: NDArray, p: float) -> tuple[NDArray, float, float]:
        """Coefficients, frequency and level; see `_OfBalance`."""
        return self.coefficients(z), self.omega, p

    def slope(self, z: NDArray, p: float) -> NDArray:
        """Derivative (n,) of R by p, from differences: exact for loads proportional to p."""
        return self.by_level(z, p)


class Free(ByFrequency):
    """Free motions of an undamped sheet, along their frequency (Hz).

    An even series fixes their phase: they begin at rest, and return to it.

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


class InResonance(_OfBalance):
    """Forced motions in phase resonance, along the logarithm of the level of the drive.

    At their frequency the drive does no reactive work: the mean over a period of its force times
    the displacement vanishes, with the force of a small drive on the sheet in its state (Peeters,
    Kerschen and Golinval, Mech. Syst. Signal Process. 25, 2011). The last unknown is the frequency
    over `unit`, so that it counts as much as displacements of the sheet's size.

    Parameters
    ----------
    place : ndarray, shape (k,)
        Unknowns of the state.
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
        """Reactive work over the size of the force, m, and its derivative (c, k)."""
        omega = TURN * self.frequency(z)
        still, drag, inertia = self._force
        force = still + omega * drag + omega**2 * inertia
        force[0] = 0.0
        force /= np.linalg.norm(force)
        return float((force * self.coefficients(z)).sum()), force

    def own(self, z: NDArray, p: float) -> tuple[NDArray, float, float]:
        """Coefficients, frequency and level; see `_OfBalance`."""
        return self.coefficients(z), TURN * self.frequency(z), float(np.exp(p))

    def residual(self, z: NDArray, p: float) -> NDArray:
        """Residual R (n,); see `Family`."""
        return np.append(super().residual(z, p), self._heavy * self._reactive(z)[0])

    def jacobian(self, z: NDArray, p: float) -> NDArray:
        """Derivative (n, n) of R by z; see `Family`."""
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
        """Derivative (n,) of R by p; see `Family`."""
        return np.append(self.by_level(z, p), 0.0)
