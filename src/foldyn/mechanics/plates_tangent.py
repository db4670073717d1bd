"""Tangent stiffness of bars, folds and plates: exact, in a sparse matrix of a known pattern.

Dofs are 3 node + axis, then the rotations. A *place* is a node, with three dofs, or a rotation,
with one. Two coupled places have a block, which is contiguous in each of its rows, so that elements
store only the first entries of their blocks. Places of an element are the nodes of its hinges, then
its rotations.

Elements are folds and plates. A fold with the moment M and its slope M' has the angles theta and
beta of its dihedral and of the rotations beside it, with the moments M a, a = (1, -1, -1), and the
matrix M' a a^T. With the rates B of the angles by the dofs, each element has the tangent B^T K B,
plus its moments times second derivatives of dihedrals.
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
    """Pattern of the tangent, and the positions of elements' blocks.

    Entry (a, b) of a block comes a * (indptr[d + 1] - indptr[d]) + b entries after its first one,
    with d the first dof of its row.
    """

    indptr: NDArray  # (size + 1,)
    indices: NDArray  # (nnz,)
    bars: NDArray  # (entries of the bars' tangent,) positions of these entries, if bars act
    angle: NDArray  # (na,) angles of the e elements, as in `BarsPlates`: of folds, then of plates
    first: NDArray  # (e + 1,) first angle of each element
    corner: NDArray  # (na, 4) places in the element of an angle's nodes or rotation
    begin: NDArray  # (e + 1,) first place of each element
    nodes: NDArray  # (e,) how many places of each element are nodes
    dof: NDArray  # (places of all elements,) first dofs
    start: NDArray  # (e + 1,) first block of each element
    block: NDArray  # (blocks of all elements,) first entries


def plates_pattern(model: BarsPlates, bars: tuple[NDArray, NDArray]) -> PlatesPattern:
    """Pattern of the tangent, given the pattern of the bars' blocks: indptr and indices."""
    n, count = model.nodes, model.nodes + model.rotations
    hinges, folds, plates = model.hinges, len(model.fold_rest), len(model.start) - 1
    elements = folds + plates
    beside, side = np.nonzero(model.fold_rotations >= 0)
    plate = np.repeat(np.arange(plates), np.diff(model.start))
    of = np.concatenate([np.arange(folds), beside, folds + plate])  # the element of each angle
    turns = -1 - model.fold_rotations[beside, side]
    angle = np.concatenate([np.arange(folds), turns, model.angle])
    order = np.argsort(of, kind="stable")
    of, angle = of[order], angle[order]
    hinged, turned = np.flatnonzero(angle >= 0), np.flatnonzero(angle < 0)
    corners = of[hinged, None] * count + hinges[angle[hinged]]
    within, inverse = np.unique(corners, return_inverse=True)
    keys = np.concatenate([within, of[turned] * count + n - 1 - angle[turned]])
    order = np.argsort(keys, kind="stable")  # element by element: nodes, then rotations
    place, of_place = keys[order] % count, keys[order] // count
    begin = np.searchsorted(of_place, np.arange(elements + 1))
    number = np.argsort(order) - begin[keys // count]
    corner = np.zeros((len(angle), 4), np.int64)
    corner[hinged] = number[inverse.reshape(-1, 4)]
    corner[turned] = number[len(within) :, None]

    wide = np.diff(begin)
    start = np.concatenate([[0], np.cumsum(wide**2)])
    block = np.repeat(np.arange(elements), wide**2)
    row, column = np.divmod(np.arange(start[-1]) - start[block], wide[block])
    own = place[begin[block] + row] * count + place[begin[block] + column]
    sides = np.repeat(np.arange(n), np.diff(bars[0])) * count + bars[1]
    every = distinct(np.concatenate([np.arange(count) * (count + 1), sides, own]))

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
        return first[np.searchsorted(every, keys)].astype(np.int32)

    of_bars = np.zeros(0, np.int32)
    if len(model.bars.bar_runs):
        axis, stride = np.arange(3, dtype=np.int32), length[dof[sides // count]].astype(np.int32)
        blocks = entries(sides)[:, None, None] + stride[:, None, None] * axis[:, None] + axis
        of_bars = sparse.bsr_array((blocks, bars[1], bars[0]), (3 * n, 3 * n)).tocsr().data
    return PlatesPattern(
        indptr=indptr.astype(np.int32),
        indices=once.astype(np.int32)[copy],
        bars=of_bars,
        angle=angle.astype(np.int32),
        first=np.searchsorted(of, np.arange(elements + 1)).astype(np.int32),
        corner=corner.astype(np.int16),
        begin=begin.astype(np.int32),
        nodes=np.bincount(of_place[place < n], minlength=elements).astype(np.int32),
        dof=dof[place].astype(np.int32),
        start=start,
        block=entries(own),
    )


@inner_scalar
def _scatter(indptr, dof, first, nodes, block, data):
    """Add a block of places, `nodes` nodes and then rotations, to the entries of the matrix."""
    for i in range(dof.size):
        stride = indptr[dof[i] + 1] - indptr[dof[i]]
        p, rows = (3 * i, 3) if i < nodes else (2 * nodes + i, 1)
        for j in range(dof.size):
            q, columns = (3 * j, 3) if j < nodes else (2 * nodes + j, 1)
            for a in range(rows):
                at = first[i * dof.size + j] + a * stride
                for b in range(columns):
                    data[at + b] += block[p + a, q + b]


@inner_scalar
def _put_fold(model, scratch, f, floor, moment, stiffness):
    """Put moments and matrix of the angles of fold f: its dihedral, and rotations beside it."""
    moment[0] = fold_moment(model, f, scratch.fold_angle[f])
    slope = model.fold_stiffness[f] * max(fold_slope(model, f, scratch.fold_angle[f]), floor)
    way, k = np.ones(3), 1
    for side in range(2):
        if model.fold_rotations[f, side] >= 0:
            way[k] = -model.fold_ways[f, side]
            k += 1
    for k in range(3):
        moment[k] = way[k] * moment[0]
        for m in range(3):
            stiffness[k, m] = way[k] * way[m] * slope


@inner_scalar
def _put_plate(model, x, scratch, p, moment, stiffness):
    """Put moments and matrix of the angles of plate p with rotations x."""
    turn_plate(model, scratch.angle, 1.0, x, p, scratch.turn)
    count = model.start[p + 1] - model.start[p]
    for k in range(count):
        moment[k] = 0.0
        for m in range(count):
            stiffness[k, m] = model.stiffness[model.entry[p] + k * count + m]
            moment[k] += stiffness[k, m] * scratch.turn[m]


@inner_scalar
def _put_rates(model, angle, corner, gradient, nodes, rates):
    """Put the rates of the angles of an element by its dofs."""
    for k in range(angle.size):
        rates[k, :] = 0.0
        if angle[k] >= 0:
            for c in range(12):
                rates[k, 3 * corner[k, c // 3] + c % 3] += gradient[angle[k], c]
        else:
            rates[k, 2 * nodes + corner[k, 0]] = model.per_reach


@inner_scalar
def _put_product(stiffness, rates, count, size, resist, block):
    """Put B^T K B of an element with rates B."""
    block[:size, :size] = 0.0
    for k in range(count):
        for q in range(size):
            resist[q] = 0.0
        for m in range(count):
            for q in range(size):
                resist[q] += stiffness[k, m] * rates[m, q]
        for r in range(size):
            along = rates[k, r]
            if along != 0.0:
                for q in range(size):
                    block[r, q] += along * resist[q]


@inner_scalar
def _add_curvature(model, u, h, gradient, moment, corner, points, gradients, turned, block):
    """Add a moment times the second derivative of the dihedral of hinge h to an element's block."""
    put_points(model, u, h, points)
    for c in range(12):
        gradients[c // 3, c % 3] = gradient[h, c]
    if rides(model, h):
        for c in range(3):
            gradients[3, c] *= 2.0  # because `carry` has moved half of it
    turned[:] = 0.0
    add_hessian(points, gradients, moment, turned)
    nodes = 4
    if rides(model, h):
        carry_wing(turned)
        nodes = 3
    for v in range(nodes):
        for w in range(nodes):
            for a in range(3):
                for b in range(3):
                    block[3 * corner[v] + a, 3 * corner[w] + b] += turned[v, a, w, b]


@kernel
def _add_elements(model, pattern, u, x, scratch, floor, most, wide, data):
    """Add the tangents of elements with up to `most` angles and `wide` dofs."""
    moment, stiffness, rates = np.empty(most), np.empty((most, most)), np.empty((most, wide))
    resist, block, gradient = np.empty(wide), np.empty((wide, wide)), scratch.gradient
    points, gradients, turned = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3, 4, 3))
    folds = model.fold_rest.size
    for e in range(pattern.nodes.size):
        own = slice(pattern.first[e], pattern.first[e + 1])
        angle, corner, nodes = pattern.angle[own], pattern.corner[own], pattern.nodes[e]
        if e < folds:
            _put_fold(model, scratch, e, floor, moment, stiffness)
        else:
            _put_plate(model, x, scratch, e - folds, moment, stiffness)
        dof = pattern.dof[pattern.begin[e] : pattern.begin[e + 1]]
        _put_rates(model, angle, corner, gradient, nodes, rates)
        _put_product(stiffness, rates, angle.size, 2 * nodes + dof.size, resist, block)
        for k in range(angle.size):
            if angle[k] >= 0:
                _add_curvature(
                    model, u, angle[k], gradient, moment[k], corner[k], points, gradients, turned,
                    block,
                )  # fmt: skip
        first = pattern.block[pattern.start[e] : pattern.start[e + 1]]
        _scatter(pattern.indptr, dof, first, nodes, block, data)


def add_plates_tangent(
    model: BarsPlates, pattern: PlatesPattern, u: NDArray, z: NDArray, floor: float, data: NDArray
) -> None:
    """Add the tangent, by rotations, of folds and plates at displacements u (n, 3) and dofs z (r,).

    floor : least slope of the folds' law per unit stiffness; smaller slopes are raised to it.
    """
    own, scratch = turned_contexts(model, u, z)
    most = max(3, int(np.diff(pattern.first).max(initial=0)))
    wide = 3 * int(np.diff(pattern.begin).max(initial=0))
    _add_elements(own, pattern, u, scratch.value.x, scratch, floor, most, wide, data)
