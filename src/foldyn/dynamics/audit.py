"""Energy audit: kinetic + strain + air + dissipated - work stays what it was at the start.

Air is what a sheet in air has lost to it. Heat acts by forces whose work a free sheet stores and
gives back (`mechanics.heat`): strain energies and work both leave that out, but it is at play, and
the error is measured by it as well.

The audit says nothing where the energies at play are no larger than rounding errors: those of the
energies themselves, of the bars' forces at displacements of that size, and of the dihedrals, which
are computed from positions. All of these follow from the motion; none is a fixed number.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from foldyn.mechanics.assembly import Assembly

EPS = float(np.finfo(float).eps)
MARGIN = 16.0  # times the rounding errors of single operations: what they add up to
ANGLE = 16.0 * EPS  # rad: rounding of a dihedral
BEGUN = 1e-6  # of the longest bar: a motion with smaller displacements has not become unbounded

AIR = "air"
AUDITED = ("kinetic", "dissipated", "work")


def audited(groups: Iterable[str], air: bool) -> tuple[str, ...]:
    """Columns of the energy table that the compiled loops fill, for groups of strain energy.

    air : whether the sheet is in air.
    """
    return (*groups, *((AIR,) if air else ()), *AUDITED)


def energy_error(energy: NDArray) -> NDArray:
    """Kinetic + strain + air + dissipated - work minus its first value (J), per sample."""
    balance = energy[:, :-1].sum(axis=1) - energy[:, -1]
    return balance - balance[0]


def energy_scale(energy: NDArray, air: bool) -> float:
    """Largest energy at play (J): kinetic, change of strain, air, dissipated or work."""
    others = len(AUDITED) + air
    strain = energy[:, :-others].sum(axis=1)
    moving = np.column_stack([strain - strain[0], energy[:, -others:]])
    return float(np.nanmax(np.abs(moving)))


class Balance:
    """What the samples of a motion, seen piece by piece, say of its energies.

    Parameters
    ----------
    air : bool
        Whether the sheet is in air.

    Attributes
    ----------
    start : ndarray, shape (1, columns)
        Energies (J) of the first sample, as audited; none (0, columns) before it.
    count : int
        Samples seen.
    error, scale, largest, farthest : float
        Largest energy error (J), energy at play (J), energy of all (J), and displacement (m).
    """

    NUMBERS = ("error", "scale", "largest", "farthest")

    def __init__(self, air: bool) -> None:
        self._air = air
        self.start = np.zeros((0, 0))
        self.count = 0
        self.error = self.scale = self.largest = self.farthest = 0.0

    def add(self, energy: NDArray, displacement: NDArray) -> None:
        """See further samples: energies (k, columns), displacements (k, n, 3)."""
        if not len(energy):
            return
        if not self.count:
            self.start = energy[:1].copy()
        self.count += len(energy)
        seen = np.concatenate([self.start, energy])
        self.error = max(self.error, float(np.abs(energy_error(seen)).max()))
        self.scale = max(self.scale, energy_scale(seen, self._air))
        self.largest = max(self.largest, float(np.nanmax(np.abs(energy))))
        self.farthest = max(self.farthest, float(displacement.max()), -float(displacement.min()))

    @property
    def relative(self) -> float:
        """Largest energy error over the energies at play; 0 where nothing is at play."""
        return self.error / self.scale if self.scale > 0.0 else 0.0

    def off(self, energy: NDArray, limit: float) -> NDArray:
        """Which of some samples have an error above a limit times the energies at play."""
        seen = np.concatenate([self.start, energy])
        return np.abs(energy_error(seen))[1:] > limit * self.scale


class Rounding:
    """What rounding hides in the motions of a body."""

    def __init__(self, body: Assembly) -> None:
        self.length = body.sheet.longest()
        self._force, self._moment = float(np.linalg.norm(body.scale())), body.turning_moments()

    def energy(self, energy: NDArray | float, moved: float) -> float:
        """Energy (J) of the rounding errors in a motion with displacements up to `moved` (m).

        energy : (samples, columns), as audited, or the largest of them.
        """
        strain = moved / self.length
        bars = self._force * moved * min(strain, 1.0)
        turns = self._moment * ANGLE * min(strain, math.pi)
        return MARGIN * (EPS * (float(np.nanmax(np.abs(energy))) + bars) + turns)

    def reveals(self, balance: Balance) -> bool:
        """Whether an error as large as the energies at play shows that a motion is unstable.

        In the first steps under a load that begins slowly the little energy that there is may be
        far off: implicit methods measure their errors against no less than `BEGUN`.
        """
        far = balance.farthest > BEGUN * self.length
        return far and balance.scale > self.energy(balance.largest, balance.farthest)

    def least_motion(self, accuracy: float) -> float:
        """Displacement (m) below which dihedrals are less accurate than that; 0 without hinges."""
        return self.length * ANGLE / accuracy if self._moment > 0.0 else 0.0
