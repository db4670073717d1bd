"""Folds whose rest angle moves in time: they do work as they turn, though no force acts.

The power of an actuated fold is k (dW/d rest) d rest/dt, W the energy of its law per unit
stiffness: what the energy audit needs.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.dynamics.numbering import Numbering
from foldyn.materials import EnhancedLinear
from foldyn.materials.compiled import kernel
from foldyn.materials.enhanced_linear import TWO_PI, energy, moment
from foldyn.materials.switch import hinge_rest_slope
from foldyn.mechanics import BarsHinges


class Actuators(NamedTuple):
    """Rest angle of hinge[k]: start[k] + span[k] times the factor of history row[k], rad."""

    hinge: NDArray  # (a,) row of model.hinges
    start: NDArray  # (a,)
    span: NDArray  # (a,)
    row: NDArray  # (a,) of the waveforms
    code: int  # of the fold law, the same for all
    address: int  # of its energy, if it is the user's own
    stress_free: bool  # whether its moment at rest is subtracted and moves along


def actuators(
    structure: Any, model: BarsHinges, by: Numbering, terms: Any, histories: list
) -> tuple[BarsHinges, Actuators]:
    """Model with rest angles of its own, and the folds that turn."""
    law = structure.fold_law
    numbers, spans, rows = [np.zeros(0, np.int64)], [np.zeros(0)], [np.zeros(0, np.int64)]
    for span, history in terms:
        turned = np.flatnonzero(span)
        numbers.append(turned)
        spans.append(np.asarray(span)[turned])
        rows.append(np.full(len(turned), histories.index(history)))
    folds = np.concatenate(numbers)
    if len(folds):
        model = model._replace(
            hinge_rest=model.hinge_rest.copy(), hinge_parameters=model.hinge_parameters.copy()
        )
    found = Actuators(
        hinge=by.hinge[structure.hinge_of_fold[folds]],
        start=np.asarray(structure.fold_rest, float)[folds],
        span=np.concatenate(spans),
        row=np.concatenate(rows).astype(np.int64),
        code=int(law.code),
        address=int(law.addresses[0]) if law.addresses else 0,
        stress_free=isinstance(law, EnhancedLinear) and law.rest == "stress_free",
    )
    return model, found


@kernel
def turn(model, actuators, factor):
    """Set the rest angles for the factors (h, 3); one that leaves 0..2 pi becomes nan."""
    p = model.hinge_parameters
    for k in range(actuators.hinge.size):
        e = actuators.hinge[k]
        rest = actuators.start[k] + actuators.span[k] * factor[actuators.row[k], 0]
        if not 0.0 <= rest <= TWO_PI:
            rest = np.nan
        model.hinge_rest[e] = rest
        if actuators.stress_free:
            p[e, 2] = moment(rest, rest, p[e, 0], p[e, 1])
            p[e, 3] = energy(rest, rest, p[e, 0], p[e, 1])


@kernel
def actuator_power(model, actuators, factor, angle):
    """Power (W) that turning folds with dihedrals `angle` (nh,) put into the structure."""
    p, power = model.hinge_parameters, 0.0
    for k in range(actuators.hinge.size):
        e = actuators.hinge[k]
        slope = hinge_rest_slope(
            actuators.code, angle[e], model.hinge_rest[e], p[e, 0], p[e, 1],
            actuators.stress_free, actuators.address,
        )  # fmt: skip
        rate = actuators.span[k] * factor[actuators.row[k], 1]
        power += model.hinge_stiffness[e] * slope * rate
    return power
