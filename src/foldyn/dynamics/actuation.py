"""Hinges whose rest angles change in time, and so do work without a force on any node.

The rest angle of a hinge is its start value plus the contributions of all actuators on it, each
with a history of its own. For the energy audit an actuated hinge has the power k (dW/d rest)
d rest/dt, with k the stiffness and W the energy of the law per unit stiffness. Crease moments turn
the adjacent panels by offsets (`materials.series`), which may jump with the moments: the work of an
offset is its mean moment over a step times its change.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.materials.series import series_moment, series_rest_slope
from foldyn.materials.switch import move_rest
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.term import Folds


class Actuators(NamedTuple):
    """Actuators: what changes the rest angle of a hinge, or its offset.

    The value of actuator k, rad, is start[k] plus a sum over the parts i from part[k, 0] to
    part[k, 1] - 1: span[i] times the factor of the history in row[i].
    """

    folds: Folds  # all hinges that can be actuated
    hinge: NDArray  # (a,) row in `folds`
    lowest: NDArray  # (a,) lowest node of each hinge; actuators are sorted by it
    is_offset: NDArray  # (a,) bool
    start: NDArray  # (a,) value without contributions, rad
    part: NDArray  # (a, 2) first and last + 1 of the parts
    code: NDArray  # (a,) code of the hinge's law
    address: NDArray  # (a, 3) addresses of a user law's functions, otherwise 0
    span: NDArray  # (p,) amplitude of each part, rad
    row: NDArray  # (p,) row of each part's waveform
    share: NDArray  # see `SheetTerm.series`
    offset: NDArray


def actuators(
    body: Assembly, numbers: NDArray, span: NDArray, row: NDArray
) -> tuple[Assembly, Actuators]:
    """Return a body with rest angles that can change, and its actuators.

    numbers, span, row : (p,) index of each rest angle, its amplitude (rad), and its waveform's row.
    """
    order = np.argsort(numbers, kind="stable")
    turned, first, count = np.unique(numbers[order], return_index=True, return_counts=True)
    hinge, which = np.zeros(0, np.int64), np.zeros(0, np.int64)
    if len(turned):
        sheet, hinge, which = body.sheet.actuated(turned)
        body = body.on(sheet)
    lowest = body.sheet.lowest_nodes(hinge).astype(np.int64)
    along = np.argsort(lowest, kind="stable")
    hinge, which, lowest = hinge[along], which[along], lowest[along]
    laws = [body.sheet.rest_law(number) for number in turned.tolist()]
    code = np.array([law.code for law in laws], np.int64)
    address = np.array([law.addresses or (0, 0, 0) for law in laws], np.int64).reshape(-1, 3)
    share, offset = body.sheet.series()
    is_offset = (turned >= len(body.sheet.rest_angles) - body.sheet.offsets)[which]
    start = offset[hinge, 0]
    start[~is_offset] = body.sheet.turned()[0][hinge[~is_offset]]
    return body, Actuators(
        folds=body.sheet.folds,
        hinge=hinge,
        lowest=lowest,
        is_offset=is_offset,
        start=start,
        part=np.stack([first, first + count], axis=1)[which].astype(np.int64),
        code=code[which],
        address=address[which],
        span=span[order],
        row=row[order],
        share=share,
        offset=offset,
    )


@inner_scalar
def turned_by(actuators, factor, k, derivative):
    """Sum of the contributions to actuator k without its start value, or the time derivative."""
    total = 0.0
    for i in range(actuators.part[k, 0], actuators.part[k, 1]):
        total += actuators.span[i] * factor[actuators.row[i], derivative]
    return total


@kernel
def turn(actuators, factor):
    """Set the rest angles for the factors (h, 3); a rest angle outside 0..2 pi becomes nan."""
    turn_part(actuators, factor, 0, actuators.hinge.size)


@inner
def turn_part(actuators, factor, first, last):
    """Set the rest angles of the actuators first to last - 1; see `turn`."""
    rest_angle, p = actuators.folds.rest, actuators.folds.parameters
    for k in range(first, last):
        e, value = actuators.hinge[k], actuators.start[k] + turned_by(actuators, factor, k, 0)
        if actuators.is_offset[k]:
            actuators.offset[e, 0] = value
            continue
        rest_angle[e] = value if 0.0 <= value <= 2.0 * np.pi else np.nan
        move_rest(actuators.code[k], rest_angle[e], p[e])


@inner
def power_of_part(actuators, factor, angle, first, last):
    """Power (W) of actuators first to last - 1, without offsets; `angle` (nh,) has all hinges."""
    folds = actuators.folds
    rest_angle, p, stiffness = folds.rest, folds.parameters, folds.stiffness
    power = 0.0
    for k in range(first, last):
        if actuators.is_offset[k]:
            continue
        e = actuators.hinge[k]
        slope = series_rest_slope(
            actuators.code[k], angle[e] + actuators.offset[e, 0], rest_angle[e],
            p[e, 0], p[e, 1], p[e, 2], p[e, 3], actuators.share[e], actuators.address[k],
        )  # fmt: skip
        power += stiffness[e] * slope * turned_by(actuators, factor, k, 1)
    return power


@kernel
def note_offsets(actuators, angle):
    """Store the offsets after a jump, at the dihedrals `angle` (nh,)."""
    offset_work(actuators, angle, 0, actuators.hinge.size, True)


@inner
def offset_work(actuators, angle, first, last, accepted):
    """Work (J) that the offsets of actuators first to last - 1 did since the last accepted step.

    accepted : whether the step that ends in the present state is accepted.
    """
    folds = actuators.folds
    rest_angle, p, stiffness = folds.rest, folds.parameters, folds.stiffness
    work, offset = 0.0, actuators.offset
    for k in range(first, last):
        if not actuators.is_offset[k]:
            continue
        e = actuators.hinge[k]
        moment = offset[e, 1] + stiffness[e] * series_moment(
            actuators.code[k], angle[e] + offset[e, 0], rest_angle[e],
            p[e, 0], p[e, 1], p[e, 2], p[e, 3], actuators.share[e], actuators.address[k],
        )  # fmt: skip
        before = moment if np.isnan(offset[e, 3]) else offset[e, 3]
        work += 0.5 * (before + moment) * (offset[e, 0] - offset[e, 2])
        if accepted:
            offset[e, 2], offset[e, 3] = offset[e, 0], moment
    return work
