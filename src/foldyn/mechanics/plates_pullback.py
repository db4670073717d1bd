"""The pullback of bars, folds and plates (`mechanics.pullback`), with rotations x as dofs.

A prime denotes a rate, for nodes and rotations whose velocities are their weights. With the
dihedrals theta, the angles phi of folds, which have the moments M, and the angles phi of plates,

    w . F = sum of M phi' + sum of phi'^T K phi.

Each dihedral has a moment, which is the factor of theta', and a second moment, `back`, which is the
factor of changes of theta: M_phi phi' from folds, K^T phi' from plates. The nodes of the hinge get
moment g' + back g, with g the gradient of the dihedral.

If dofs are turns of folds (`mechanics.plates`), rotations and their rates depend on dihedrals:
forces on rotations add to moments, and derivatives by rotations to second moments.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner
from foldyn.jit.context import Context, rows_at
from foldyn.materials.series import series_derivatives
from foldyn.mechanics.bars_hinges import (
    PullbackScratch,
    gradient_of,
    pull_bars_hinges,
    pullback_scratch,
)
from foldyn.mechanics.dihedral import rates_at
from foldyn.mechanics.plates import (
    BarsPlates,
    PlatesScratch,
    hand_over,
    plates_scratch,
    put_points,
    put_rotations,
    ride,
    rides,
    turn_folds,
    turn_plate,
    turned_fold,
)
from foldyn.mechanics.pullback import Pulled, arrays_of, pullback, zeros_for
from foldyn.mechanics.term import parted_rows


class Back(NamedTuple):
    """Work arrays of the pullback, and the gradients that it adds to; nh = nf + nb."""

    out: BarsPlates  # gradients; of `bars` a `bars_hinges.Gradient`, of `per_reach` (1,)
    bars: PullbackScratch
    points: NDArray  # (4, 3) of a hinge, m
    moves: NDArray  # (4, 3) weights of these points
    by: NDArray  # (4, 3)
    rate: NDArray  # (nh,) of the dihedrals
    gradient_rate: NDArray  # (nh, 12) rates of the dihedrals' gradients
    moment: NDArray  # (nh,) `back` above
    turned: NDArray  # (the most angles of a plate,) rates of its angles
    resisted: NDArray  # (the most angles of a plate,) K^T times `turned`
    rotating: NDArray  # (r,) rates of the rotations, m
    couple: NDArray  # (r,) forces on the rotations, N
    by_x: NDArray  # (r,) derivatives by the rotations


def back_of(model: BarsPlates) -> Back:
    """Work arrays for a model, and gradients of zero."""
    nh, most = len(model.hinges), int(np.diff(model.start).max(initial=0))
    out = zeros_for(model, "bars", "per_reach")
    out = out._replace(bars=gradient_of(model.bars), per_reach=np.zeros(1))
    points, moves, by = np.zeros((3, 4, 3))
    return Back(
        out, pullback_scratch(model.nodes), points, moves, by, np.zeros(nh), np.zeros((nh, 12)),
        np.zeros(nh), np.zeros(most), np.zeros(most), *np.zeros((3, model.rotations)),
    )  # fmt: skip


def gradients(out: BarsPlates) -> Mapping[str, NDArray]:
    """Gradients by name, as `pullback.arrays_of` names the arrays of a model."""
    return arrays_of(out._replace(per_reach=np.reshape(out.per_reach, ()))).numbers


@inner
def rate_hinges(model, u, w, scratch, back):
    """Dihedrals and their gradients at u, and their rates for nodal velocities w."""
    for h in range(model.hinges.shape[0]):
        put_points(model, u, h, back.points)
        for v in range(4):
            for c in range(3):
                back.moves[v, c] = w[model.hinges[h, v], c]
        ride(model, h, 0.0, back.moves)
        found = rates_at(back.points, back.moves)
        scratch.angle[h], back.rate[h] = found[0], found[13]
        for c in range(12):
            scratch.gradient[h, c], back.gradient_rate[h, c] = found[1 + c], found[14 + c]


@inner
def pull_folds(model, x, y, scratch, back, by_x):
    """Compute the moments of folds; add to gradients, back moments and by_x (r,)."""
    turn_folds(model, x, scratch)
    out, p = back.out, model.fold_parameters
    for f in range(model.fold_rest.size):
        stiffness, rate = model.fold_stiffness[f], turned_fold(model, f, y, back.rate)
        moment, slope, by_rest, by_a, by_b, by_c, _ = series_derivatives(
            model.code[f], scratch.fold_angle[f], model.fold_rest[f],
            p[f, 0], p[f, 1], p[f, 2], p[f, 3], 1.0, model.addresses[f],
        )  # fmt: skip
        scratch.moment[f] = stiffness * moment
        back.moment[f] = stiffness * slope * rate
        for side in range(2):
            rotation, way = model.fold_rotations[f, side], model.fold_ways[f, side]
            if rotation >= 0:
                by_x[rotation] -= way * model.per_reach * back.moment[f]
                back.couple[rotation] -= way * model.per_reach * scratch.moment[f]
                turned = back.moment[f] * x[rotation] + scratch.moment[f] * y[rotation]
                out.per_reach[0] -= way * turned
        out.fold_stiffness[f] += moment * rate
        rate *= stiffness
        out.fold_rest[f] += by_rest * rate
        out.fold_parameters[f, 0] += by_a * rate
        out.fold_parameters[f, 1] += by_b * rate
        out.fold_parameters[f, 2] += by_c * rate


@inner
def pull_plate(model, x, y, scratch, back, by_x, p):
    """Compute the moments of plate p; add to gradients, back moments and by_x (r,)."""
    count, folds, out = model.start[p + 1] - model.start[p], model.fold_rest.size, back.out
    turn_plate(model, scratch.angle, 1.0, x, p, scratch.turn)
    turn_plate(model, back.rate, 0.0, y, p, back.turned)
    for k in range(count):
        back.resisted[k] = 0.0
    for k in range(count):
        row, moment, rate = model.entry[p] + k * count, 0.0, back.turned[k]
        for m in range(count):
            moment += model.stiffness[row + m] * scratch.turn[m]
            back.resisted[m] += model.stiffness[row + m] * rate
            out.stiffness[row + m] += rate * scratch.turn[m]
        h = model.angle[model.start[p] + k]
        if h >= 0:
            scratch.moment[h] += moment
        else:
            back.couple[-1 - h] += model.per_reach * moment
            out.per_reach[0] += moment * y[-1 - h]
    for k in range(count):
        h = model.angle[model.start[p] + k]
        if h >= 0:
            back.moment[h] += back.resisted[k]
            out.bend_rest[h - folds] -= back.resisted[k]
        else:
            by_x[-1 - h] += model.per_reach * back.resisted[k]
            out.per_reach[0] += back.resisted[k] * x[-1 - h]


@inner
def pull_hinges(model, scratch, back, product):
    """Add the contributions of all hinges to their nodes, in `product` and the gradients."""
    by, rest = back.by, back.out.bars.rest
    for h in range(model.hinges.shape[0]):
        moment, other = scratch.moment[h], back.moment[h]
        for v in range(4):
            for c in range(3):
                by[v, c] = moment * back.gradient_rate[h, 3 * v + c]
                by[v, c] += other * scratch.gradient[h, 3 * v + c]
        if rides(model, h):
            e = h - model.hinges.shape[0] + model.wings.shape[0]
            for c in range(3):  # as `plates.carry` does
                back.out.wings[e, c] += by[3, c]
                by[3, c] *= 0.5
                by[1, c] += by[3, c]
        for v in range(4):
            node = model.hinges[h, v]
            for c in range(3):
                product[node, c] += by[v, c]
                rest[node, c] += by[v, c]


@inner
def pull_turns(model, x, y, scratch, back, product, by_x):
    """Add the derivatives for folds and plates, after `rate_hinges`."""
    for h in range(model.hinges.shape[0]):
        scratch.moment[h], back.moment[h] = 0.0, 0.0
    pull_folds(model, x, y, scratch, back, by_x)
    for p in range(model.start.size - 1):
        pull_plate(model, x, y, scratch, back, by_x, p)
    for f in range(model.unmoved.size):
        for rotation in model.fold_rotations[f]:
            if rotation >= 0:
                share = 0.5 if model.fold_rotations[f].min() >= 0 else 1.0
                by, turn = share * by_x[rotation] / model.per_reach, scratch.angle[f]
                back.out.unmoved[f] -= by
                turned = by * (turn - model.unmoved[f])
                turned += share * back.couple[rotation] / model.per_reach * back.rate[f]
                back.out.per_reach[0] -= turned / model.per_reach
    hand_over(model, back.couple, scratch.moment)
    hand_over(model, by_x, back.moment)
    pull_hinges(model, scratch, back, product)


class _Context(NamedTuple):
    model: BarsPlates
    scratch: PlatesScratch
    back: Back
    rows: int


@pullback
def _pullback(own, u, v, t, weight, product, rate):
    model, moved, weights = own.model, rows_at(u, own.rows), rows_at(weight, own.rows)
    n, r = model.bars.rest.shape[0], model.rotations
    (here, z), (w, h) = parted_rows(moved, n, r), parted_rows(weights, n, r)
    out, by_z = parted_rows(rows_at(product, own.rows), n, r)
    x, y, by_x, couple = own.scratch.x, own.back.rotating, own.back.by_x, own.back.couple
    pull_bars_hinges(model.bars, here, w, own.back.bars, own.back.out.bars, out)
    rate_hinges(model, here, w, own.scratch, own.back)
    put_rotations(model, z, 1.0, own.scratch.angle, x)
    put_rotations(model, h, 0.0, own.back.rate, y)
    for k in range(r):
        by_x[k], couple[k] = 0.0, 0.0
    pull_turns(model, x, y, own.scratch, own.back, out, by_x)
    for k in range(r):
        by_z[k] += by_x[k]


def plates_pulled(model: BarsPlates) -> Pulled:
    """Pullback of bars, folds and plates."""
    back = back_of(model)
    own = Context(_Context(model, plates_scratch(model), back, model.rows))
    return Pulled(own, _pullback, gradients(back.out))
