"""Hinges whose rest angle moves in time: they do work as they turn, though no force acts.

The power of one is k (dW/d rest) d rest/dt, W the energy of its law per unit
stiffness: what the energy audit needs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner, kernel
from foldyn.materials.switch import hinge_rest_slope, move_rest
from foldyn.mechanics.body import Body
from foldyn.mechanics.kernels import folds_of


class Actuators(NamedTuple):
    """Rest angle of hinge[k]: start[k] + span[k] times the factor of history row[k], rad."""

    hinge: NDArray  # (a,) row of what `folds_of` gives
    start: NDArray  # (a,)
    span: NDArray  # (a,)
    row: NDArray  # (a,) of the waveforms
    code: NDArray  # (a,) of its law
    address: NDArray  # (a,) of the law's energy, if it is the user's own
    lowest: NDArray  # (a,) lowest node of the hinge, in increasing order


def actuators(body: Body, numbers: NDArray, span: NDArray, row: NDArray) -> tuple[Body, Actuators]:
    """A body whose rest angles can be changed, and what turns.

    numbers, span, row : (f,) of its rest angles, how far each turns (rad), and its waveform.
    """
    hinge, place = np.zeros(0, np.int64), np.zeros(0, np.int64)
    laws = [body.rest_law(number) for number in numbers.tolist()]
    if len(numbers):
        body, hinge, place = body.actuated(numbers)
    lowest = body.lowest_nodes(hinge).astype(np.int64)
    along = np.argsort(lowest, kind="stable")
    hinge, place = hinge[along], place[along]
    code = np.array([law.code for law in laws], np.int64)
    address = np.array([law.addresses[0] if law.addresses else 0 for law in laws], np.int64)
    start = body.turned()[0][hinge]
    where = code[place], address[place], lowest[along]
    return body, Actuators(hinge, start, span[place], row[place], *where)


@kernel
def turn(model, actuators, factor):
    """Set the rest angles for the factors (h, 3); one that leaves 0..2 pi becomes nan."""
    turn_part(model, actuators, factor, 0, actuators.hinge.size)


@inner
def turn_part(model, actuators, factor, first, last):
    """The same for a part of what turns."""
    rest_angle, p, _ = folds_of(model)
    for k in range(first, last):
        e = actuators.hinge[k]
        rest = actuators.start[k] + actuators.span[k] * factor[actuators.row[k], 0]
        if not 0.0 <= rest <= 2.0 * np.pi:
            rest = np.nan
        rest_angle[e] = rest
        move_rest(actuators.code[k], rest, p[e])


@inner
def actuator_power(model, actuators, factor, angle):
    """Power (W) that turning folds with dihedrals `angle` (nh,) put into the structure."""
    return power_of_part(model, actuators, factor, angle, 0, actuators.hinge.size)


@inner
def power_of_part(model, actuators, factor, angle, first, last):
    """The same of a part of what turns; `angle` (nh,) are those of all."""
    (rest_angle, p, stiffness), power = folds_of(model), 0.0
    for k in range(first, last):
        e = actuators.hinge[k]
        slope = hinge_rest_slope(
            actuators.code[k], angle[e], rest_angle[e], p[e, 0], p[e, 1], actuators.address[k]
        )  # fmt: skip
        rate = actuators.span[k] * factor[actuators.row[k], 1]
        power += stiffness[e] * slope * rate
    return power
