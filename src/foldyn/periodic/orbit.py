"""A periodic motion on the unknowns of an equation, and quantities derived from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foldyn.attractors.run import Stretch, measured, swing
from foldyn.mechanics.contact.term import ContactTerm
from foldyn.periodic.balance import Balance, Fourier, values_of
from foldyn.periodic.collocation import multipliers
from foldyn.periodic.equation import Equation
from foldyn.results import Quantity
from foldyn.results.crossings import crossings_of

SHOWN = 128  # samples of a period in results and for extremes
BARELY = 1e-3  # of a gap: share that remains between two samples of motions that do not cross


@dataclass(frozen=True, eq=False)
class Orbit:
    """A periodic motion.

    Attributes
    ----------
    equation : Equation
    amplitudes : ndarray, complex, shape (h + 1, k)
        Amplitudes of exp(i j tau) of the unknowns, m; tau is the phase in the motion's period.
    omega : float
        Frequency of the drive, rad/s; of the motion itself without a drive.
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

    @property
    def period(self) -> float:
        """Period of the motion, s."""
        return 2.0 * np.pi * self.multiple / self.omega

    def displacement(self, phase: NDArray) -> NDArray:
        """Displacements (s, n, 3), m, of all nodes at phases (s,) of the motion."""
        at = self.equation.at(self.multiple * phase, self.level)
        return at.displacements(values_of(self.amplitudes, phase)).reshape(len(phase), -1, 3)

    def velocity(self, phase: NDArray) -> NDArray:
        """Velocities (s, n, 3), m/s, of all nodes at phases (s,) of the motion."""
        drive, size = self.equation.drive, self.equation.body.size
        level = self.level * self.equation.level
        moved = drive.sums(drive.moves, self.multiple * phase, level, size)[1]
        own = values_of(self.amplitudes, phase, 1) @ self.equation.basis.T / self.multiple
        return self.omega * (own + moved).reshape(len(phase), -1, 3)

    def node_amplitudes(self) -> NDArray:
        """Amplitudes (h + 1, n, 3), m, of all nodes, including the motion of supports."""
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
        if len(crossings_of(case, self.displacement(phase[:1])).crossed):
            return True
        parts = zip(u[:-1], np.diff(u, axis=0), at.planes, np.diff(at.planes, axis=0), strict=False)
        return any(
            body.displaced(moved).term(ContactTerm).clear(here, step, moves, BARELY) < 1.0
            for here, step, moved, moves in parts
        )

    def multipliers(self, steps: int) -> NDArray:
        """Floquet multipliers (2k,), the largest first, from steps in a period of the drive."""
        return multipliers(
            self.equation, self.amplitudes, self.omega, self.multiple, self.level, steps
        )

    def truncation(self) -> float:
        """Estimated effect of twice as many harmonics, as a fraction of the motion.

        The residual at the additional harmonics over the mean dynamic stiffness there.
        """
        kept, equation = len(self.amplitudes) - 1, self.equation
        fourier = Fourier(2 * kept + 1)  # even ones alone may vanish by symmetry
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
        states = whole.unknowns(self.displacement(phase), at)
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
    found = {
        "coefficient": coefficient,
        "truncation": np.array([orbit.truncation() for orbit in orbits]),
    }
    if orbits[0].equation.whole is not orbits[0].equation:
        found["reduction"] = np.array([orbit.reduction() for orbit in orbits])
    return found


def amplitude(orbit: Orbit, measure: Quantity | None) -> float:
    """Amplitude of a measure with a function, or of the node that swings most."""
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
    """Phases of a period, and one beyond its end."""
    return 2.0 * np.pi * np.arange(SHOWN + 2) / SHOWN
