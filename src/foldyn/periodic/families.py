"""Families of periodic motions that continuation follows; see `continuation.Family`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.periodic.about_rest import AboutRest
from foldyn.periodic.balance import Balance
from foldyn.periodic.equation import Instants
from foldyn.periodic.orbit import Orbit

TURN = 2.0 * np.pi
PROBE = 1e-4  # of the level, or of the frequency: step of central differences
LITTLE = 1e-4  # level at which forces of a drive are proportional to it
LEAST = 1e-12  # of the sheet's length: least size of a motion


class _OfBalance:
    """Common base of the families of a balance."""

    def __init__(self, balance: Balance, span: float, tolerance: float) -> None:
        self.balance, self.span, self.tolerance = balance, span, tolerance
        self.rounding = balance.rounding()
        self._kept: tuple[float, Instants] | None = None

    def coefficients(self, z: NDArray) -> NDArray:
        """Coefficients (c, k) of the motion."""
        return z[: self.balance.shape[0] * self.balance.shape[1]].reshape(self.balance.shape)

    def instants(self, level: float) -> Instants:
        """The equation at the samples; the one of the last level is kept."""
        if self._kept is None or self._kept[0] != level:
            self._kept = level, self.balance.instants(level)
        return self._kept[1]

    def size(self, z: NDArray) -> float:
        """Norm of the varying part of the motion."""
        moving = float(np.linalg.norm(self.coefficients(z)[1:]))
        return max(moving, LEAST * self.balance.equation.length)

    def orbit_at(self, z: NDArray, omega: float, level: float) -> Orbit:
        """The motion."""
        amplitudes = self.balance.fourier.complex_of(self.coefficients(z))
        return Orbit(self.balance.equation, amplitudes, omega, self.balance.multiple, level)


class ByFrequency(_OfBalance):
    """Forced motions along the frequency (Hz) of the drive."""

    level = 1.0

    def residual(self, z: NDArray, p: float) -> NDArray:
        """Residual R (n,); see `Family`."""
        x, at = self.coefficients(z), self.instants(self.level)
        return self.balance.residual(x, TURN * p, at).ravel()

    def jacobian(self, z: NDArray, p: float) -> NDArray:
        """Derivative (n, n) of R by z; see `Family`."""
        x, at = self.coefficients(z), self.instants(self.level)
        return self.balance.jacobian(x, TURN * p, at)

    def slope(self, z: NDArray, p: float) -> NDArray:
        """Derivative (n,) of R by p; see `Family`."""
        x, at = self.coefficients(z), self.instants(self.level)
        return TURN * self.balance.frequency_slope(x, TURN * p, at).ravel()

    def orbit(self, z: NDArray, p: float) -> Orbit:
        """The motion."""
        return self.orbit_at(z, TURN * p, self.level)


class ByLevel(_OfBalance):
    """Forced motions of one frequency along the level of the drive."""

    def __init__(self, balance: Balance, span: float, tolerance: float, frequency: float) -> None:
        super().__init__(balance, span, tolerance)
        self.omega = TURN * frequency

    def residual(self, z: NDArray, p: float) -> NDArray:
        """Residual R (n,); see `Family`."""
        return self.balance.residual(self.coefficients(z), self.omega, self.instants(p)).ravel()

    def jacobian(self, z: NDArray, p: float) -> NDArray:
        """Derivative (n, n) of R by z; see `Family`."""
        return self.balance.jacobian(self.coefficients(z), self.omega, self.instants(p))

    def slope(self, z: NDArray, p: float) -> NDArray:
        """Derivative (n,) of R by p; from differences, exact for loads proportional to it."""
        x, (up, down) = (
            self.coefficients(z),
            (self.balance.instants(p + d) for d in (PROBE, -PROBE)),
        )
        change = self.balance.residual(x, self.omega, up) - self.balance.residual(
            x, self.omega, down
        )
        return change.ravel() / (2.0 * PROBE)

    def orbit(self, z: NDArray, p: float) -> Orbit:
        """The motion."""
        return self.orbit_at(z, self.omega, p)


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

    def _own(self, z: NDArray, level: float) -> tuple[NDArray, float, Instants]:
        return self.coefficients(z), TURN * self.frequency(z), self.instants(level)

    def residual(self, z: NDArray, p: float) -> NDArray:
        """Residual R (n,); see `Family`."""
        left = self.balance.residual(*self._own(z, np.exp(p)))
        return np.append(left.ravel(), self._heavy * self._reactive(z)[0])

    def jacobian(self, z: NDArray, p: float) -> NDArray:
        """Derivative (n, n) of R by z; see `Family`."""
        own, n = self._own(z, np.exp(p)), len(z) - 1
        out = np.empty((n + 1, n + 1))
        out[:n, :n] = self.balance.jacobian(*own)
        out[:n, n] = TURN * self.unit * self.balance.frequency_slope(*own).ravel()
        out[n, :n] = self._heavy * self._reactive(z)[1].ravel()
        step = np.zeros(n + 1)
        step[n] = PROBE * z[-1]
        change = self._reactive(z + step)[0] - self._reactive(z - step)[0]
        out[n, n] = self._heavy * change / (2.0 * step[n])
        return out

    def slope(self, z: NDArray, p: float) -> NDArray:
        """Derivative (n,) of R by p; see `Family`."""
        x, omega, _ = self._own(z, np.exp(p))
        up, down = (
            self.balance.residual(x, omega, self.balance.instants(np.exp(p + d)))
            for d in (PROBE, -PROBE)
        )
        return np.append((up - down).ravel() / (2.0 * PROBE), 0.0)

    def orbit(self, z: NDArray, p: float) -> Orbit:
        """The motion."""
        return self.orbit_at(z, TURN * self.frequency(z), float(np.exp(p)))
