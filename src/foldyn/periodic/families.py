"""Families of periodic motions that continuation follows; see `continuation.Family`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.periodic.balance import Balance
from foldyn.periodic.equation import Instants
from foldyn.periodic.orbit import Orbit

TURN = 2.0 * np.pi
PROBE = 1e-4  # of the level, or of the frequency: for derivatives that have no formula
LEAST = 1e-12  # of the sheet's length: a motion is never taken as smaller


class _OfBalance:
    """What families of a balance have in common."""

    def __init__(self, balance: Balance, span: float, tolerance: float) -> None:
        self.balance, self.span, self.tolerance = balance, span, tolerance
        self.rounding = balance.rounding()
        self._kept: tuple[float, Instants] | None = None

    def coefficients(self, z: NDArray) -> NDArray:
        """Of the motion (c, k)."""
        return z[: self.balance.shape[0] * self.balance.shape[1]].reshape(self.balance.shape)

    def instants(self, level: float) -> Instants:
        """The equation at the samples; that of the last level is kept."""
        if self._kept is None or self._kept[0] != level:
            self._kept = level, self.balance.instants(level)
        return self._kept[1]

    def size(self, z: NDArray) -> float:
        """Norm of what moves."""
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
        """See `Family`."""
        x, at = self.coefficients(z), self.instants(self.level)
        return self.balance.residual(x, TURN * p, at).ravel()

    def jacobian(self, z: NDArray, p: float) -> NDArray:
        """See `Family`."""
        x, at = self.coefficients(z), self.instants(self.level)
        return self.balance.jacobian(x, TURN * p, at)

    def slope(self, z: NDArray, p: float) -> NDArray:
        """See `Family`."""
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
        """See `Family`."""
        return self.balance.residual(self.coefficients(z), self.omega, self.instants(p)).ravel()

    def jacobian(self, z: NDArray, p: float) -> NDArray:
        """See `Family`."""
        return self.balance.jacobian(self.coefficients(z), self.omega, self.instants(p))

    def slope(self, z: NDArray, p: float) -> NDArray:
        """See `Family`; by differences, exact where loads are proportional to the level."""
        x, (up, down) = self.coefficients(z), (self.balance.instants(p + d) for d in (PROBE, -PROBE))
        change = self.balance.residual(x, self.omega, up) - self.balance.residual(
            x, self.omega, down
        )
        return change.ravel() / (2.0 * PROBE)

    def orbit(self, z: NDArray, p: float) -> Orbit:
        """The motion."""
        return self.orbit_at(z, self.omega, p)


class Free(ByFrequency):
    """Motions of an undamped sheet that nothing drives, along their frequency (Hz).

    An even series leaves their phase no freedom: they begin at rest, and come back to it.
    """

    level = 0.0


class InResonance(_OfBalance):
    """Forced motions along the level of the drive at the frequency of their phase resonance.

    There the drive does no reactive work: the mean of its force times the displacement vanishes
    (Peeters, Kerschen and Golinval, Mech. Syst. Signal Process. 25, 2011). The last unknown is the
    frequency over `scale` (Hz), so that it counts as much as displacements of the sheet's size.
    """

    def __init__(self, balance: Balance, span: float, tolerance: float, scale: float) -> None:
        super().__init__(balance, span, tolerance)
        self.scale = scale / balance.equation.length
        count, k = balance.shape
        still = np.zeros((len(balance.fourier.phase), k))
        self._still = still
        self._weights = np.zeros((count, k))

    def frequency(self, z: NDArray) -> float:
        """Of a motion, Hz."""
        return float(z[-1]) * self.scale

    def begin(self, place: NDArray) -> None:
        """Take the force of the drive, at level 1, on the sheet at unknowns (k,)."""
        fourier = self.balance.fourier
        at, still = self.instants(1.0), np.tile(place, (len(fourier.phase), 1))
        self._force = at, still

    def _quadrature(self, z: NDArray) -> tuple[float, NDArray]:
        """Reactive work at level 1 over that possible, and its derivative (c, k)."""
        fourier, (at, still) = self.balance.fourier, self._force
        force = fourier.fit @ (at.forces(still) + at.driving(TURN * self.frequency(z)))
        force[0] = 0.0
        force /= np.linalg.norm(force)
        return float((force * self.coefficients(z)).sum()), force

    def residual(self, z: NDArray, p: float) -> NDArray:
        """See `Family`."""
        own = self.balance.residual(
            self.coefficients(z), TURN * self.frequency(z), self.instants(p)
        ).ravel()
        return np.append(own, self._heavy * self._quadrature(z)[0])

    @property
    def _heavy(self) -> float:
        """Force per displacement, N/m, that gives the last equation the unit of the others."""
        return float(np.abs(np.diag(self.balance.equation.mass)).max()) * (TURN * self.scale) ** 2

    def jacobian(self, z: NDArray, p: float) -> NDArray:
        """See `Family`."""
        x, omega, at = self.coefficients(z), TURN * self.frequency(z), self.instants(p)
        n = x.size
        out = np.empty((n + 1, n + 1))
        out[:n, :n] = self.balance.jacobian(x, omega, at)
        out[:n, n] = TURN * self.scale * self.balance.frequency_slope(x, omega, at).ravel()
        out[n, :n] = self._heavy * self._quadrature(z)[1].ravel()
        step = np.zeros(n + 1)
        step[n] = PROBE * z[-1]
        change = self._quadrature(z + step)[0] - self._quadrature(z - step)[0]
        out[n, n] = self._heavy * change / (2.0 * step[n])
        return out

    def slope(self, z: NDArray, p: float) -> NDArray:
        """See `Family`."""
        x, omega = self.coefficients(z), TURN * self.frequency(z)
        up, down = (
            self.balance.residual(x, omega, self.balance.instants(p + d)) for d in (PROBE, -PROBE)
        )
        return np.append((up - down).ravel() / (2.0 * PROBE), 0.0)

    def orbit(self, z: NDArray, p: float) -> Orbit:
        """The motion."""
        return self.orbit_at(z, TURN * self.frequency(z), p)
