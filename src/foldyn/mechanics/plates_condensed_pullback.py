"""The pullback of plates whose rotations are in balance (`mechanics.pullback`).

The rotations x stay where the forces on them are the push s, f(u, x) = s. With y = -f_x^-1 f_u w,
their rates where the nodes move by the weights w, the derivatives are those of the forces on nodes
and rotations (`mechanics.plates_pullback`) with the weights (w, y), and -y by s.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner
from foldyn.jit.context import Context, rows_at
from foldyn.materials.switch import hinge_slope
from foldyn.mechanics.bars_hinges_pullback import pull_bars_hinges
from foldyn.mechanics.plates import turn_folds
from foldyn.mechanics.plates_condensed import (
    CondensedPlates,
    CondensedScratch,
    balance,
    condensed_scratch,
    factorize,
    solve_band,
)
from foldyn.mechanics.plates_pullback import (
    Back,
    back_of,
    gradients,
    pull_turns,
    rate_hinges,
)
from foldyn.mechanics.pullback import Pulled, pullback


@inner
def rate_couples(model, scratch, back, out):
    """Rates of the forces on rotations with those of the dihedrals alone, to out (r,)."""
    out[:], p = 0.0, model.fold_parameters
    for f in range(model.fold_rest.size):
        scratch.slope[f] = model.fold_stiffness[f] * hinge_slope(
            model.code, scratch.fold_angle[f], model.fold_rest[f],
            p[f, 0], p[f, 1], p[f, 2], p[f, 3], model.addresses[2],
        )  # fmt: skip
        for rotation in model.fold_rotations[f]:
            if rotation >= 0:
                out[rotation] -= model.per_reach * scratch.slope[f] * back.rate[f]
    for p in range(model.start.size - 1):
        count = model.start[p + 1] - model.start[p]
        for k in range(count):
            rotation = -1 - model.angle[model.start[p] + k]
            if rotation < 0:
                continue
            for m in range(count):
                h = model.angle[model.start[p] + m]
                if h >= 0:
                    stiff = model.stiffness[model.entry[p] + k * count + m]
                    out[rotation] += model.per_reach * stiff * back.rate[h]


@inner
def rate_rotations(model, scratch, back, y):
    """Rates y (r,) of the rotations in balance."""
    turn_folds(model.plates, scratch.x, scratch.plates)
    rate_couples(model.plates, scratch.plates, back, y)
    if not model.constant:
        factorize(model, scratch)
    for k in range(y.size):
        scratch.step[model.rank[k]] = -y[k]
    solve_band(scratch.factor, scratch.step)
    for k in range(y.size):
        y[k] = scratch.step[model.rank[k]]


class _Context(NamedTuple):
    model: CondensedPlates
    scratch: CondensedScratch
    back: Back
    y: NDArray  # (r,) rates of the rotations, m
    push: NDArray  # (r,) gradient


@pullback
def _pullback(own, u, v, t, weight, product, rate):
    model, scratch, plates = own.model, own.scratch, own.model.plates
    rows = plates.bars.rest.shape[0]
    here, w, out = rows_at(u, rows), rows_at(weight, rows), rows_at(product, rows)
    balance(model, here, scratch)
    rate_hinges(plates, here, w, scratch.plates, own.back)
    rate_rotations(model, scratch, own.back, own.y)
    pull_bars_hinges(plates.bars, here, w, own.back.bars, own.back.out.bars, out)
    pull_turns(plates, scratch.x, own.y, scratch.plates, own.back, out, scratch.couple)
    for k in range(own.y.size):
        own.push[k] -= own.y[k]


def condensed_pulled(model: CondensedPlates) -> Pulled:
    """Bars, folds and plates with their rotations in balance, differentiated."""
    back, (y, push) = back_of(model.plates), np.zeros((2, model.plates.rotations))
    own = Context(_Context(model, condensed_scratch(model), back, y, push))
    return Pulled(own, _pullback, {**gradients(back.out), "push": push})
