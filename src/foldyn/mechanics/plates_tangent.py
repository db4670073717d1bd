"""Tangent stiffness of bars, folds and plates: exact, in a sparse matrix of a known pattern.

Dofs are 3 node + axis, then the rotations. A *place* is a node, with three dofs, or a rotation,
with one. Two coupled places have a block, which is contiguous in each of its rows, so that elements
store only the first entries of their blocks. Places of a plate are the nodes of its hinges,
then its rotations; places of a fold are its four nodes, then its two rotations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.compiled import inner_scalar, kernel
from foldyn.mechanics.dihedral import add_hessian, carry_wing
from foldyn.mechanics.plates import (
    BarsPlates,
    fold_moment,
    fold_slope,
    put_points,
    rides,
    turn_plate,
    turned_contexts,
)
from foldyn.mechanics.tangent import distinct


class PlatesPattern(NamedTuple):
    """Pattern of the tangent, and the positions of elements' blocks; -1 for no place.

    Entry (a, b) of a block comes a * (indptr[d + 1] - indptr[d]) + b entries after its first one,
    with d the first dof of its row.
    """

    indptr: NDArray  # (size + 1,)
    indices: NDArray  # (nnz,)
    bars: NDArray  # (entries of the bars' tangent,) positions of these entries, if bars act
    fold_dof: NDArray  # (nf, 6) first dofs of the places of each fold
    fold: NDArray  # (nf, 36) first entries
    begin: NDArray  # (p + 1,) first place of each plate
    nodes: NDArray  # (p,) how many places of each plate are nodes
    dof: NDArray  # (places of all plates,) first dofs
    start: NDArray  # (p + 1,) first block of each plate
    plate: NDArray  # (blocks of all plates,) first entries
    corner: NDArray  # (nq, 4) places in the plate of an angle's nodes or rotation
    owner: NDArray  # (nh, 2) a plate of each hinge, and the hinge's angle (nq) in it; -1 if none


def plates_pattern(model: BarsPlates, bars: tuple[NDArray, NDArray]) -> PlatesPattern:
    """Pattern of the tangent, given the pattern of the bars' blocks: indptr and indices."""
    n, count = model.nodes, model.nodes + model.rotations
    hinges, plates = model.hinges, len(model.start) - 1
    of = np.repeat(np.arange(plates), np.diff(model.start))  # the plate of each angle
    hinged, turned = np.flatnonzero(model.angle >= 0), np.flatnonzero(model.angle < 0)
    corners = of[hinged, None] * count + hinges[model.angle[hinged]]
    within, inverse = np.unique(corners, return_inverse=True)
    keys = np.concatenate([within, of[turned] * count + n - 1 - model.angle[turned]])
    order = np.argsort(keys, kind="stable")  # plate by plate: nodes, then rotations
    place, of_place = keys[order] % count, keys[order] // count
    begin = np.searchsorted(of_place, np.arange(plates + 1))
    number = np.argsort(order) - begin[keys // count]
    corner = np.zeros((len(model.angle), 4), np.int64)
    corner[hinged] = number[inverse.reshape(-1, 4)]
    corner[turned] = number[len(within) :, None]
    owner = np.full((len(hinges), 2), -1)
    owner[model.angle[hinged]] = np.column_stack([of[hinged], hinged])

    turns = np.where(model.fold_rotations >= 0, n + model.fold_rotations, -1)
    fold = np.concatenate([hinges[: len(model.fold_rest)], turns], axis=1)
    wide = np.diff(begin)
    start = np.concatenate([[0], np.cumsum(wide**2)])
    block = np.repeat(np.arange(plates), wide**2)
    row, column = np.divmod(np.arange(start[-1]) - start[block], wide[block])
    own = place[begin[block] + row] * count + place[begin[block] + column]
    known, sides = fold >= 0, np.repeat(np.arange(n), np.diff(bars[0])) * count + bars[1]
    pairs = np.where(
        known[:, :, None] & known[:, None], fold[:, :, None] * count + fold[:, None], -1
    )
    every = distinct(np.concatenate([np.arange(count) * (count + 1), sides, pairs.ravel(), own]))

    width = np.where(np.arange(count) < n, 3, 1)
    dof = np.concatenate([[0], np.cumsum(width)])  # first dof of each place
    row, column = np.divmod(every, count)
    behind = np.concatenate([[0], np.cumsum(width[column])])  # entries of one row of each place
    ends = behind[np.searchsorted(row, np.arange(count + 1))]
    length = np.repeat(np.diff(ends), width)  # length of the rows of the matrix
    indptr = np.concatenate([[0], np.cumsum(length)])
    first = indptr[dof[row]] + behind[:-1] - ends[row]  # entry of each pair
    once = np.repeat(dof[column] - behind[:-1], width[column]) + np.arange(behind[-1])
    copy = np.arange(indptr[-1]) + np.repeat(np.repeat(ends[:-1], width) - indptr[:-1], length)

    def entries(keys: NDArray) -> NDArray:
        found = first[np.searchsorted(every, np.maximum(keys, 0))]
        return np.where(keys >= 0, found, -1).astype(np.int32)

    of_bars = np.zeros(0, np.int32)
    if len(model.bars.bar_runs):
        axis, stride = np.arange(3, dtype=np.int32), length[dof[sides // count]].astype(np.int32)
        blocks = entries(sides)[:, None, None] + stride[:, None, None] * axis[:, None] + axis
        of_bars = sparse.bsr_array((blocks, bars[1], bars[0]), (3 * n, 3 * n)).tocsr().data
    return PlatesPattern(
        indptr=indptr.astype(np.int32),
        indices=once.astype(np.int32)[copy],
        bars=of_bars,
        fold_dof=np.where(known, dof[fold], -1).astype(np.int32),
        fold=entries(pairs).reshape(-1, 36),
        begin=begin.astype(np.int32),
        nodes=np.bincount(of_place[place < n], minlength=plates).astype(np.int32),
        dof=dof[place].astype(np.int32),
        start=start,
        plate=entries(own),
        corner=corner.astype(np.int16),
        owner=owner.astype(np.int32),
    )


@inner_scalar
def _scatter(indptr, dof, first, nodes, block, data):
    """Add a block of places, `nodes` nodes and then rotations, to the entries of the matrix."""
    for i in range(dof.size):
        if dof[i] < 0:
            continue
        stride = indptr[dof[i] + 1] - indptr[dof[i]]
        p, rows = (3 * i, 3) if i < nodes else (2 * nodes + i, 1)
        for j in range(dof.size):
            if dof[j] < 0:
                continue
            q, columns = (3 * j, 3) if j < nodes else (2 * nodes + j, 1)
            for a in range(rows):
                at = first[i * dof.size + j] + a * stride
                for b in range(columns):
                    data[at + b] += block[p + a, q + b]


@inner_scalar
def _curvature(model, u, scratch, h, points, gradient, out):
    """Put the moment of hinge h times its dihedral's second derivative into out (4, 3, 4, 3)."""
    put_points(model, u, h, points)
    for v in range(4):
        for c in range(3):
            gradient[v, c] = scratch.gradient[h, 3 * v + c]
    if rides(model, h):
        for c in range(3):
            gradient[3, c] *= 2.0  # because `carry` has moved half of it
    out[:] = 0.0
    add_hessian(points, gradient, scratch.moment[h], out)
    if rides(model, h):
        carry_wing(out)


@kernel
def _add_folds(model, pattern, u, scratch, floor, data):
    points, gradient, turned = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3, 4, 3))
    along, bent, block = np.empty(14), turned.reshape(12, 12), np.empty((14, 14))
    for f in range(model.fold_rest.size):
        scratch.moment[f] = fold_moment(model, scratch, f)
        slope = model.fold_stiffness[f] * max(fold_slope(model, scratch, f), floor)
        for c in range(12):
            along[c] = scratch.gradient[f, c]
        along[12] = along[13] = -model.per_reach
        for r in range(14):
            for q in range(14):
                block[r, q] = slope * along[r] * along[q]
        _curvature(model, u, scratch, f, points, gradient, turned)
        for r in range(12):
            for q in range(12):
                block[r, q] += bent[r, q]
        _scatter(pattern.indptr, pattern.fold_dof[f], pattern.fold[f], 4, block, data)


@inner_scalar
def _plate_block(model, pattern, scratch, p, bend, resist, block):
    """Put the matrix of plate p for the plate's dofs into `block`; add its hinges' moments."""
    first, nodes = model.start[p], pattern.nodes[p]
    count, wide = model.start[p + 1] - first, 3 * nodes
    size = wide + pattern.begin[p + 1] - pattern.begin[p] - nodes
    for k in range(count):
        h = model.angle[first + k]
        for r in range(wide):
            bend[k, r] = 0.0
        if h >= 0:
            for v in range(4):
                at = 3 * pattern.corner[first + k, v]
                for c in range(3):
                    bend[k, at + c] += scratch.gradient[h, 3 * v + c]
    for r in range(size):
        for q in range(size):
            block[r, q] = 0.0
    for k in range(count):
        h, own, moment = model.angle[first + k], 2 * nodes + pattern.corner[first + k, 0], 0.0
        for r in range(wide):
            resist[r] = 0.0
        for m in range(count):
            stiff = model.stiffness[model.entry[p] + k * count + m]
            moment += stiff * scratch.turn[m]
            if model.angle[first + m] >= 0:
                for r in range(wide):
                    resist[r] += stiff * bend[m, r]
            elif h < 0:
                other = 2 * nodes + pattern.corner[first + m, 0]
                block[own, other] = model.per_reach**2 * stiff
        if h >= 0:
            scratch.moment[h] += moment
            for r in range(wide):
                along = bend[k, r]
                if along != 0.0:
                    for q in range(wide):
                        block[r, q] += along * resist[q]
        else:
            for r in range(wide):
                block[own, r] = block[r, own] = model.per_reach * resist[r]


@kernel
def _add_plates(model, pattern, x, scratch, bend, resist, block, data):
    for p in range(pattern.nodes.size):
        turn_plate(model, x, scratch, p)
        _plate_block(model, pattern, scratch, p, bend, resist, block)
        dof = pattern.dof[pattern.begin[p] : pattern.begin[p + 1]]
        first = pattern.plate[pattern.start[p] : pattern.start[p + 1]]
        _scatter(pattern.indptr, dof, first, pattern.nodes[p], block, data)


@kernel
def _add_bends(model, pattern, u, scratch, data):
    """Add the moments of the hinges of plates, times the second derivatives of dihedrals."""
    points, gradient, turned = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3, 4, 3))
    dof, first, block = np.empty(4, np.int32), np.empty(16, np.int32), turned.reshape(12, 12)
    for h in range(model.fold_rest.size, model.hinges.shape[0]):
        p, k = pattern.owner[h]
        if p < 0:
            continue
        _curvature(model, u, scratch, h, points, gradient, turned)
        begin, wide = pattern.begin[p], pattern.begin[p + 1] - pattern.begin[p]
        for v in range(4):
            at = pattern.corner[k, v]
            dof[v] = pattern.dof[begin + at]
            for w in range(4):
                first[4 * v + w] = pattern.plate[
                    pattern.start[p] + at * wide + pattern.corner[k, w]
                ]
        if rides(model, h):
            dof[3] = -1
        _scatter(pattern.indptr, dof, first, 4, block, data)


def add_plates_tangent(
    model: BarsPlates, pattern: PlatesPattern, u: NDArray, z: NDArray, floor: float, data: NDArray
) -> None:
    """Add the tangent, by rotations, of folds and plates at displacements u (n, 3) and dofs z (r,).

    floor : least slope of the folds' law per unit stiffness; smaller slopes are raised to it.
    """
    own, scratch = turned_contexts(model, u, z)
    _add_folds(own, pattern, u, scratch, floor, data)
    wide = 3 * int(np.diff(pattern.begin).max(initial=0))
    bend = np.empty((int(np.diff(model.start).max(initial=0)), wide))
    _add_plates(
        own, pattern, scratch.value.x, scratch, bend, np.empty(wide), np.empty((wide, wide)), data
    )
    _add_bends(own, pattern, u, scratch, data)
