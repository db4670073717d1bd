"""Energy audit: kinetic + strain + air + dissipated - work must keep its initial value.

"Air" is the energy that the sheet has lost to the air. Heat acts by forces whose work a free sheet
stores and returns (`mechanics.heat`). Strain energies and work both exclude this work, but the
energy at play, to which the error is relative, includes it.

If the energies at play do not exceed rounding errors, the audit makes no statement. Rounding errors
come from the energies themselves, from the bar forces at such displacements, and from the
dihedrals, which are computed from positions. All bounds follow from the motion; none is fixed.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from foldyn.dynamics.motion_state import StepPlan
from foldyn.mechanics.assembly import Assembly

EPS = float(np.finfo(float).eps)
MARGIN = 16.0  # bound for the sum of rounding errors, relative to the error of one operation
ANGLE = 16.0 * EPS  # rounding error of a dihedral, rad
INACCURATE = 1e-2  # relative energy error above which to warn
BEGUN = 1e-6  # motions below this share of the longest bar are not judged unbounded

AIR = "air"
AUDITED = ("kinetic", "dissipated", "work")
KINETIC = -3  # its column in a table of energies


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


class EnergyBalance:
    """Energy statistics of a motion, updated sample by sample.

    Parameters
    ----------
    air : bool
        Whether the sheet is in air.

    Attributes
    ----------
    start : ndarray, shape (1, columns)
        Energies (J) of the first sample, as audited; shape (0, columns) before the first sample.
    count : int
        Number of samples added.
    error, scale, largest, farthest : float
        Largest energy error, energy at play and single energy (J), largest displacement (m).
    """

    NUMBERS = ("error", "scale", "largest", "farthest")

    def __init__(self, air: bool) -> None:
        self._air = air
        self.start = np.zeros((0, 0))
        self.count = 0
        self.error = self.scale = self.largest = self.farthest = 0.0

    def add(self, energy: NDArray, displacement: NDArray) -> None:
        """Update with further samples: energies (k, columns), displacements (k, n, 3)."""
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
        """Largest energy error relative to the energies at play; 0 if nothing is at play."""
        return self.error / self.scale if self.scale > 0.0 else 0.0

    def off(self, energy: NDArray, limit: float) -> NDArray:
        """Whether the error of each sample exceeds `limit` times the energies at play."""
        seen = np.concatenate([self.start, energy])
        return np.abs(energy_error(seen))[1:] > limit * self.scale


class Rounding:
    """Bounds for the rounding errors of energies in motions of a body."""

    def __init__(self, body: Assembly) -> None:
        self.length = body.sheet.longest()
        self._force, self._moment = float(np.linalg.norm(body.scale())), body.turning_moments()

    def energy(self, energy: NDArray | float, moved: float) -> float:
        """Bound (J) for rounding errors of the energies, with displacements up to `moved` (m).

        energy : (samples, columns), as audited, or the largest energy.
        """
        strain = moved / self.length
        bars = self._force * moved * min(strain, 1.0)
        turns = self._moment * ANGLE * min(strain, math.pi)
        return MARGIN * (EPS * (float(np.nanmax(np.abs(energy))) + bars) + turns)

    def reveals(self, balance: EnergyBalance) -> bool:
        """Whether an error as large as the energies at play proves a motion unstable.

        In the first steps under a load that begins slowly, the relative energy error may be large:
        implicit methods measure their errors against displacements of at least `BEGUN`.
        """
        far = balance.farthest > BEGUN * self.length
        return far and balance.scale > self.energy(balance.largest, balance.farthest)

    def least_motion(self, accuracy: float) -> float:
        """Displacement (m) below which dihedrals miss `accuracy`; 0 without hinges."""
        return self.length * ANGLE / accuracy if self._moment > 0.0 else 0.0


def is_off(balance: EnergyBalance, rounding: Rounding) -> bool:
    """Whether the energy balance of a motion is off by more than rounding errors."""
    hidden = rounding.energy(balance.largest, balance.farthest)
    return balance.relative > INACCURATE and balance.scale > hidden


def doubts(
    balance: EnergyBalance, rounding: Rounding, plan: StepPlan, size: float, remedy: str
) -> str:
    """Warning about the accuracy of a motion; empty if there is none.

    Parameters
    ----------
    balance : EnergyBalance
    rounding : Rounding
    plan : StepPlan
    size : float
        Largest displacement (m), the scale of the step errors; 0 with fixed steps.
    remedy : str
        How to make the motion more accurate.
    """
    farthest, least = balance.farthest, rounding.least_motion(INACCURATE)
    if 0.0 < farthest < least:
        return (
            f"nothing moves farther than {farthest:.2g} m, and below {least:.2g} m rounding "
            "errors hide the turns of hinges, so that hinges do not resist: use larger loads, "
            "lighter or softer panels, or a longer motion"
        )
    if 0.0 < size < plan.floor:
        return (
            f"the motion is small: {size:.2g} m at most, but errors of steps are relative "
            f"to {plan.floor:.2g} m, a share of the longest bar; use a tolerance of "
            f"{plan.tolerance * size / plan.floor:.1g}, or a method with a fixed step"
        )
    if balance.relative <= INACCURATE:
        return ""
    share = f"{balance.relative:.1%}"
    off = f"the energy balance of the motion is off by {share} of the energies at play"
    hidden = rounding.energy(balance.largest, farthest)
    if balance.scale <= hidden:
        return (
            f"{off}, {balance.scale:.2g} J: they are below the rounding errors of forces and "
            f"displacements of this size ({hidden:.2g} J), so the motion may be mere rounding"
        )
    return f"{off}: {remedy}"
