"""Free motions about an equilibrium, accurate for arbitrarily small amplitudes.

Dihedrals are computed from node positions, and lose the digits by which these exceed the motion. So
near the equilibrium x0 forces f and energies V are integrated from tangents K,

    f(x) = int_0^1 K d ds,    V(x) = V(x0) + int_0^1 (1 - s) d' K d ds,

with d = x - x0 and K at x0 + s d, if the result agrees with them to within their loss of accuracy,
as it does unless laws bend in between. About the rest position only the hinges are integrated, as
bars there are accurate for small displacements.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.mechanics.assembly import Assembly
from foldyn.periodic.equation import EPS, Equation, Instants

SMALL = 1e-3  # of the sheet: largest motion that counts as small
LOST = 100.0  # times the rounding of positions over the motion: largest loss of accuracy of forces
SHARES = np.array([0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15)])  # Gauss's
WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0


class AboutRest(Instants):
    """The equation without its drive; see the module docstring.

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
