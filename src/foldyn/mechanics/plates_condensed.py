"""Plates whose rotations are in balance at every displacement: for methods that need mass.

The rotations x (r,) of `mechanics.plates` balance the forces on them, which curling panels and
moments of creases exert. Newton's method finds them at every evaluation, starting from the
rotations of the last evaluation. The stiffness of the rotations is the constant stiffness of the
plates plus the stiffness of the folds; each fold couples the rotations on both sides. It is
factorized as a band (Cholesky), only once if the law of the folds is linear.

The pullback (`mechanics.pullback`) holds the forces on the rotations at the push s, f(u, x) = s.
Let y = -f_x^-1 f_u w be the rates of the rotations if the nodes have the velocities w. Then the
pullback for w is the pullback of the forces on nodes and rotations (`mechanics.plates_pullback`)
for the weights (w, y); the derivative with respect to s is -y.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee

from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.jit.context import Context, numbers_at, rows_at, run_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.bars_hinges import pull_bars_hinges
from foldyn.mechanics.model import ranks
from foldyn.mechanics.plates import (
    Bars,
    BarsPlates,
    PlatesScratch,
    bars_of,
    fold_slope,
    plates_energy,
    plates_force,
    plates_scratch,
    turn_folds,
    turn_hinges,
    turn_moments,
)
from foldyn.mechanics.plates_pullback import (
    Back,
    back_of,
    gradients,
    pull_turns,
    rate_hinges,
)
from foldyn.mechanics.pullback import Pulled, pullback
from foldyn.mechanics.term import ENERGIES, FORCES, CompiledTerm, energies, forces
from foldyn.mechanics.threads import Team

STEPS = 100  # largest number of steps of Newton's method
BEYOND = 0.5  # a step is too long if forces resist its end by more than this, relative to its start
BALANCED = 1e-12  # rad, largest change in the last step
ROUNDED = 1e-9  # the same with larger rounding errors, if creases are much stiffer than panels


class CondensedPlates(NamedTuple):
    """Arrays of a model whose rotations are in balance.

    Attributes
    ----------
    plates : BarsPlates
    constant : bool
        Whether the folds have the slope one at every angle.
    rank : (r,)
        Place of each rotation in the band.
    band, factor : (r, w + 1)
        Lower triangle of the plates' stiffness for the dofs of rotations, N/m, entry (i, j) at
        [i, w + j - i]; and its factor with folds of slope one.
    """

    plates: BarsPlates
    constant: bool
    rank: NDArray
    band: NDArray
    factor: NDArray
    offset: NDArray  # (nf + r, 4) see `SheetTerm.series`
    memory: NDArray  # (2,) addresses of the kernel for branches of folds, and of its context; or 0


class CondensedScratch(NamedTuple):
    """Scratch of one evaluation."""

    plates: PlatesScratch
    x: NDArray  # (r,) rotations of the last evaluation, m
    couple: NDArray  # (r,) N
    step: NDArray  # (r,) in the order of the band
    factor: NDArray  # (r, w + 1)
    branches: NDArray  # (nf, 2) moments (N m) and slopes (N m/rad) of branches of folds
    angle: NDArray  # arrays of `plates`
    fold_angle: NDArray
    own: NDArray  # (2,) first and last + 1 of the rows
    team: Team


def condensed_plates(model: BarsPlates, constant: bool) -> CondensedPlates:
    """Arrays of a model whose rotations are in balance; see `CondensedPlates`."""
    r, rows, columns, values = model.rotations, [], [], []
    for p in range(len(model.start) - 1):
        turned = model.angle[model.start[p] : model.start[p + 1]]
        own = np.flatnonzero(turned < 0)
        matrix = model.stiffness[model.entry[p] : model.entry[p + 1]]
        part = matrix.reshape(len(turned), len(turned))[np.ix_(own, own)]
        number = -1 - turned[own]
        rows.append(np.repeat(number, len(own)))
        columns.append(np.tile(number, len(own)))
        values.append(part.ravel() * model.per_reach**2)
    one, other = model.fold_rotations[(model.fold_rotations >= 0).all(axis=1)].T
    flat = [np.concatenate([np.zeros(0), *part]) for part in (rows, columns, values)]
    entries = (flat[2], (flat[0].astype(int), flat[1].astype(int)))
    stiffness = sparse.csr_array(sparse.coo_array(entries, shape=(r, r)))
    joined = sparse.csr_array(
        abs(stiffness) + sparse.coo_array((np.ones(len(one)), (one, other)), shape=(r, r))
    )
    order = np.zeros(0)  # if all panels are rigid
    if r:
        order = reverse_cuthill_mckee(sparse.csr_array(joined + joined.T), symmetric_mode=True)
    rank = ranks(order.astype(np.int64))
    found = sparse.coo_array(joined)
    width = int(np.abs(rank[found.coords[0]] - rank[found.coords[1]]).max(initial=0))
    band = np.zeros((r, width + 1))
    at = sparse.coo_array(stiffness)
    i, j = rank[at.coords[0]], rank[at.coords[1]]
    lower = i >= j
    np.add.at(band, (i[lower], width + j[lower] - i[lower]), at.data[lower])
    factor = band.copy()
    add_folds(model, rank, model.fold_stiffness, factor)
    factorize_band(factor)
    offset = np.zeros((len(model.fold_rest) + r, 4))
    memory = np.zeros(2, np.int64)
    return CondensedPlates(model, constant, rank, band, factor, offset, memory)


def condensed_scratch(model: CondensedPlates) -> CondensedScratch:
    """Scratch for `model`."""
    r, plates = model.plates.rotations, plates_scratch(model.plates)
    return CondensedScratch(
        plates, np.zeros(r), np.zeros(r), np.zeros(r), model.factor.copy(),
        np.zeros((len(plates.fold_angle), 2)), plates.angle, plates.fold_angle,
        np.array([0, model.plates.nodes]), plates.team,
    )  # fmt: skip


@kernel
def add_folds(plates, rank, slope, band):
    """Add folds with these slopes (nf,), N m/rad, to the stiffness of the rotations."""
    width = band.shape[1] - 1
    for f in range(plates.fold_rest.size):
        stiff = slope[f] * plates.per_reach * plates.per_reach
        one, other = plates.fold_rotations[f]
        if one >= 0:
            band[rank[one], width] += stiff
        if other >= 0:
            band[rank[other], width] += stiff
        if one >= 0 and other >= 0:
            high, low = max(rank[one], rank[other]), min(rank[one], rank[other])
            band[high, width + low - high] += stiff


@kernel
def factorize_band(band):
    """Replace the lower triangle of a positive definite matrix by its Cholesky factor."""
    size, width = band.shape[0], band.shape[1] - 1
    for i in range(size):
        for j in range(max(0, i - width), i + 1):
            total = band[i, width + j - i]
            for k in range(max(0, i - width, j - width), j):
                total -= band[i, width + k - i] * band[j, width + k - j]
            if i == j:
                band[i, width] = math.sqrt(total)
            else:
                band[i, width + j - i] = total / band[j, width]


@inner
def factorize(model, scratch):
    """Factorize the stiffness of rotations at the slopes of folds in memory, to scratch.factor."""
    factor, band = flat(scratch.factor), flat(model.band)
    for k in range(band.size):  # an assignment of slices takes seconds to compile
        factor[k] = band[k]
    add_folds(model.plates, model.rank, scratch.plates.slope, scratch.factor)
    factorize_band(scratch.factor)


@inner
def solve_band(factor, x):
    """Solve with a factor of `factorize_band`, in place."""
    size, width = factor.shape[0], factor.shape[1] - 1
    for i in range(size):
        for k in range(max(0, i - width), i):
            x[i] -= factor[i, width + k - i] * x[k]
        x[i] /= factor[i, width]
    for i in range(size - 1, -1, -1):
        x[i] /= factor[i, width]
        for k in range(max(0, i - width), i):
            x[k] -= factor[i, width + k - i] * x[i]


@inner
def add_branches(model, scratch):
    """Evaluate the branches of folds, whose moments also act on rotations."""
    if model.memory[0] == 0:
        return
    run_at(model.memory[0], (model.memory[1], scratch.plates.fold_angle, scratch.branches))
    for f in range(scratch.branches.shape[0]):
        for rotation in model.plates.fold_rotations[f]:
            if rotation >= 0:
                scratch.couple[rotation] -= model.plates.per_reach * scratch.branches[f, 0]


@inner_scalar
def along_step(model, push, scratch):
    """Work of the forces on rotations along a step."""
    total = 0.0
    for k in range(scratch.x.size):
        total += scratch.step[model.rank[k]] * (push[k, 0] - scratch.couple[k])
    return total


@inner
def balance(model, u, scratch):
    """Put the rotations in balance at displacements u into scratch.x; nan if none are found."""
    plates, push = model.plates, model.offset[model.plates.fold_rest.size :]
    turn_hinges(plates, u, scratch.plates)
    slope = scratch.plates.slope
    again = model.memory[0] != 0  # rates of creases follow from differences of turns
    begun = 0.0  # work of the forces at the start of the last step
    for k in range(scratch.x.size):
        if np.isnan(scratch.x[k]):  # no balance was found at the last displacements
            scratch.x[k] = 0.0
    for i in range(STEPS):
        turn_moments(plates, scratch.x, scratch.couple, scratch.plates)
        add_branches(model, scratch)
        along = along_step(model, push, scratch)
        if 0.0 < begun < -along / BEYOND:  # a crease began or ceased to yield: go back
            share = begun / (begun - along)
            for k in range(scratch.x.size):
                scratch.x[k] -= (1.0 - share) * scratch.step[model.rank[k]]
            for k in range(scratch.x.size):
                scratch.step[k] *= share
            begun *= share
            continue
        if not model.constant or model.memory[0] != 0:
            for f in range(plates.fold_rest.size):
                stiff = plates.fold_stiffness[f] * fold_slope(plates, scratch.plates, f)
                slope[f] = max(stiff + scratch.branches[f, 1], 0.0)
            factorize(model, scratch)
        largest = 0.0
        for k in range(scratch.x.size):
            scratch.step[model.rank[k]] = push[k, 0] - scratch.couple[k]
        solve_band(scratch.factor, scratch.step)
        begun = along_step(model, push, scratch)
        for k in range(scratch.x.size):
            scratch.x[k] += scratch.step[model.rank[k]]
            largest = max(largest, abs(scratch.step[model.rank[k]]))
        small = plates.per_reach * largest <= (BALANCED if i < STEPS // 2 else ROUNDED)
        if small:
            begun = 0.0
        close, again = small and not again, False
        if close or not largest < np.inf:
            for k in range(scratch.x.size):
                push[k, 1] = scratch.x[k]
                if np.isnan(push[k, 3]):  # at the start of a motion
                    push[k, 3] = scratch.x[k]
            return
    scratch.x[:] = np.nan


class _Context(NamedTuple):
    model: CondensedPlates
    bars: Bars
    scratch: CondensedScratch


@forces
def _forces(own, u, v, t, force, powers):
    model, scratch, rows = own.model, own.scratch, own.model.plates.bars.rest.shape[0]
    moved, out = rows_at(u, rows), rows_at(force, rows)
    balance(model, moved, scratch)
    plates_force(model.plates, own.bars, moved, scratch.x, out, scratch.couple, scratch.plates)


@energies
def _energies(own, u, out):
    model, scratch = own.model, own.scratch
    moved = rows_at(u, model.plates.bars.rest.shape[0])
    balance(model, moved, scratch)
    plates_energy(model.plates, own.bars, moved, scratch.x, scratch.plates, numbers_at(out, 3))


def condensed_kernels(model: CondensedPlates, scratch: CondensedScratch) -> CompiledTerm:
    """Kernels of bars, folds and plates with rotations in balance."""
    own = Context(_Context(model, bars_of(model.plates, scratch.plates), scratch))
    return CompiledTerm(own, {FORCES: _forces, ENERGIES: _energies})


@inner
def rate_couples(model, scratch, back, out):
    """Put the rates of the forces on rotations, due to dihedrals alone, into out (r,)."""
    out[:] = 0.0
    for f in range(model.fold_rest.size):
        scratch.slope[f] = model.fold_stiffness[f] * fold_slope(model, scratch, f)
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


class _Backward(NamedTuple):
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
    """Pullback of bars, folds and plates with rotations in balance."""
    back, (y, push) = back_of(model.plates), np.zeros((2, model.plates.rotations))
    own = Context(_Backward(model, condensed_scratch(model), back, y, push))
    return Pulled(own, _pullback, {**gradients(back.out), "push": push})
