"""Moment law of panels: linear for small turns like a plate, with exponent 4/3 for large turns.

M = k d (1 + (d/d0)^2)^(1/6), d = theta - theta0. Well below the onset d0 this is the linear law.
Well above it, this is k d0^(-1/3) |d|^(4/3), the law of superlinear bends: of a panel that has
buckled into the shape of large turns. M = (M_1^6 + M_4/3^6)^(1/6) is a blend of the two that is
smooth everywhere; with the sixth power, the energy has a closed form.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.arguments import Check
from foldyn.errors import InputError
from foldyn.jit.compiled import scalar
from foldyn.materials.formulas import HingeFormulas
from foldyn.materials.law import HingeLaw, columns
from foldyn.values import number

CODE = 4
FEW = 1e-4  # a series gives the energy if (d/d0)^2 is below this


@scalar
def energy(turn, per_onset2):
    """Energy / k = 3/7 d0^2 ((1 + (d/d0)^2)^(7/6) - 1)."""
    z = turn * turn * per_onset2
    if z < FEW:
        series = 1.0 + z / 12.0 * (1.0 - 5.0 / 18.0 * z * (1.0 - 11.0 / 24.0 * z))
        return 0.5 * turn * turn * series
    return 3.0 / 7.0 * math.expm1(7.0 / 6.0 * math.log1p(z)) / per_onset2


@scalar
def moment(turn, per_onset2):
    """Moment / k."""
    return turn * (1.0 + turn * turn * per_onset2) ** (1.0 / 6.0)


@scalar
def slope(turn, per_onset2):
    """Slope / k = (1 + 4/3 z)/(1 + z)^(5/6), z = (d/d0)^2."""
    z = turn * turn * per_onset2
    return (1.0 + 4.0 / 3.0 * z) / (1.0 + z) ** (5.0 / 6.0)


@scalar
def by_onset(turn, per_onset2):
    """Derivative of moment / k with respect to per_onset2."""
    return (turn**3 / 6.0 * (1.0 + turn * turn * per_onset2) ** (-5.0 / 6.0),)


def onset_parameters(onset: ArrayLike) -> NDArray:
    """Parameters (n, 4) of hinges with onsets (n,), rad."""
    onset = np.asarray(onset, float)
    return columns(len(onset), onset**-2.0)


@dataclass(frozen=True)
class PlateSuperlinear(HingeLaw):
    """Bend law that is linear for small turns and has the exponent 4/3 for large turns.

    Parameters
    ----------
    onset : float, optional
        Turn d0 (degrees) at which the linear and the superlinear part are equal. By default each
        bend has its own onset, at which bends of the standard calibration and bends of a plate have
        equal moments; this needs `calibration="plate"`. (Outside a structure the default is the
        onset of a square panel with t/L = 0.01 and nu = 0.25: 1.37 degrees.)

    Examples
    --------
    >>> law = PlateSuperlinear(onset=2.0)
    >>> float(law.slope(3.0, rest=3.0))
    1.0
    """

    onset: Annotated[float | None, Check(number, above=0.0, most=360.0, unit="degrees")] = None
    name: str = "plate_superlinear"

    formulas = (HingeFormulas(CODE, energy, moment, slope, by_onset),)
    follows_rest = False

    def check(self, field: str) -> None:
        """Refuse the law for creases without a given onset, as only bends have a default onset."""
        super().check(field)
        if field == "fold_law" and self.onset is None:
            raise InputError(
                ' = "plate_superlinear": creases have no onset of their own; give '
                "PlateSuperlinear(onset=...) in degrees, or use it as bend_law",
                field,
            )

    def parameters(self, rest: NDArray) -> NDArray:
        """Parameter 1/d0^2 (1/rad^2) of each hinge."""
        onset = SQUARE if self.onset is None else math.radians(self.onset)
        return onset_parameters(np.full(len(rest), onset))

    def reach(self, theta: NDArray, rest: NDArray, parameters: NDArray) -> NDArray:
        """Distance to the branch points, which are complex, rest +- i onset; see `HingeLaw`."""
        return np.sqrt((theta - rest) ** 2 + 1.0 / parameters[:, 0])


def plate_onset(plate: ArrayLike, superlinear: ArrayLike) -> NDArray:
    """Turns (rad) at which k d of a plate equals k' d^(4/3), for the stiffnesses k and k'."""
    return (np.asarray(plate) / np.asarray(superlinear)) ** 3.0


SQUARE = float(plate_onset(1.0 - 0.25, 0.5 * (100.0 * math.sqrt(2.0)) ** (1.0 / 3.0)))
