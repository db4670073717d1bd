"""Folds whose rest angle moves in time: they do work as they turn, though no force acts.

The power of an actuated fold is k (dW/d rest) d rest/dt, W the energy of its law per unit
stiffness: what the energy audit needs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import kernel
from foldyn.materials import HingeLaw
from foldyn.materials.switch import hinge_rest_slope, move_rest
from foldyn.mechanics.body import Body
from foldyn.mechanics.kernels import folds_of


class Actuators(NamedTuple):
    """Rest angle of hinge[k]: start[k] + span[k] times the factor of history row[k], rad."""

    hinge: NDArray  # (a,) row of what `folds_of` gives
    start: NDArray  # (a,)
    span: NDArray  # (a,)
    row: NDArray  # (a,) of the waveforms
    code: int  # of the fold law, the same for all
    address: int  # of its energy, if it is the user's own


def actuators(
    body: Body, law: HingeLaw, folds: NDArray, span: NDArray, row: NDArray
) -> tuple[Body, Actuators]:
    """A body whose rest angles can be changed, and its actuated folds, all of one law.

    folds, span, row : (f,) numbers of folds, how far each turns (rad), and its waveform.
    """
    hinge, place = np.zeros(0, np.int64), np.zeros(0, np.int64)
    if len(folds):
        body, hinge, place = body.actuated(folds)
    address = int(law.addresses[0]) if law.addresses else 0
    start = body.turned()[0][hinge]
    return body, Actuators(hinge, start, span[place], row[place], int(law.code), address)


@kernel
def turn(model, actuators, factor):
    """Set the rest angles for the factors (h, 3); one that leaves 0..2 pi becomes nan."""
    rest_angle, p, _ = folds_of(model)
    for k in range(actuators.hinge.size):
        e = actuators.hinge[k]
        rest = actuators.start[k] + actuators.span[k] * factor[actuators.row[k], 0]
        if not 0.0 <= rest <= 2.0 * np.pi:
            rest = np.nan
        rest_angle[e] = rest
        move_rest(actuators.code, rest, p[e])


@kernel
def actuator_power(model, actuators, factor, angle):
    """Power (W) that turning folds with dihedrals `angle` (nh,) put into the structure."""
    (rest_angle, p, stiffness), power = folds_of(model), 0.0
    for k in range(actuators.hinge.size):
        e = actuators.hinge[k]
        slope = hinge_rest_slope(
            actuators.code, angle[e], rest_angle[e], p[e, 0], p[e, 1], actuators.address
        )  # fmt: skip
        rate = actuators.span[k] * factor[actuators.row[k], 1]
        power += stiffness[e] * slope * rate
    return power
