"""Tangent stiffness of bars, folds and plates: exact, in a sparse matrix of a known pattern.

Dofs are 3 node + axis, then the rotations. A plate's element has the dofs of the nodes of its
hinges, then its rotations; a fold's those of its four nodes, then its two rotations.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner, kernel
from foldyn.materials.switch import hinge_slope
from foldyn.mechanics.dihedral import add_hessian, carry_wing
from foldyn.mechanics.plates import (
    BarsPlates,
    fold_moment,
    ride,
    rides,
    turn_folds,
    turn_hinges,
    turn_plate,
)


class PlatesPattern(NamedTuple):
    """Pattern of the tangent, and where its parts go; -1 where there is no dof.

    Attributes
    ----------
    indptr, indices : (size + 1,), (nnz,)
    bars : (entries of the bars' tangent,)
        Place of each entry of the matrix (3n, 3n) of the bars.
    folds : (nf, 14, 14)
    width : (p,)
        Dofs of each plate.
    corner : (nq, 4)
        Place of the nodes of each hinge among those of its plate.
    rotation : (nq,)
        Place of each rotation among the dofs of its plate.
    start : (p + 1,)
        First of the entries of each plate in `plates`.
    plates : (sum of width^2,)
    """

    indptr: NDArray
    indices: NDArray
    bars: NDArray
    folds: NDArray
    width: NDArray
    corner: NDArray
    rotation: NDArray
    start: NDArray
    plates: NDArray


def plates_pattern(model: BarsPlates, bars_indptr: NDArray, bars_indices: NDArray) -> PlatesPattern:
    """Pattern of the tangent, given that (3n,) of the bars."""
    n = model.nodes
    size = 3 * n + model.rotations
    folds = _dofs(model.hinges[: len(model.fold_rest)], model.fold_rotations, n)
    elements, corner, rotation = (
        [],
        np.full((len(model.angle), 4), -1),
        np.full(len(model.angle), -1),
    )
    for p in range(len(model.start) - 1):
        own = np.arange(model.start[p], model.start[p + 1])
        hinges, turned = own[model.angle[own] >= 0], own[model.angle[own] < 0]
        rows = model.hinges[model.angle[hinges]]
        nodes, place = np.unique(rows, return_inverse=True)
        corner[hinges] = place.reshape(-1, 4)
        rotation[turned] = 3 * len(nodes) + np.arange(len(turned))
        elements.append(_dofs(nodes[None], (-1 - model.angle[turned])[None], n)[0])
    bars = np.repeat(np.arange(3 * n), np.diff(bars_indptr)) * size + bars_indices.astype(np.int64)
    diagonal = np.arange(size) * (size + 1)
    parts = [diagonal, bars, _keys(folds, size).ravel()]
    parts += [_keys(element, size).ravel() for element in elements]
    known = np.unique(np.concatenate(parts))
    known = known[known >= 0]
    width = np.array([len(element) for element in elements], np.int64)

    def places(keys: NDArray) -> NDArray:
        return np.where(keys >= 0, np.searchsorted(known, keys), -1)

    return PlatesPattern(
        indptr=np.searchsorted(known // size, np.arange(size + 1)).astype(np.int32),
        indices=(known % size).astype(np.int32),
        bars=places(bars),
        folds=places(_keys(folds, size)),
        width=width,
        corner=corner,
        rotation=rotation,
        start=np.concatenate([[0], np.cumsum(width**2)]),
        plates=_joined([places(_keys(element, size)).ravel() for element in elements]),
    )


def _dofs(nodes: NDArray, rotations: NDArray, n: int) -> NDArray:
    """Dofs (e, 3 k + r) of elements with nodes (e, k) and rotations (e, r), -1 without one."""
    displaced = (3 * nodes[:, :, None] + np.arange(3)).reshape(len(nodes), 3 * nodes.shape[1])
    turned = np.where(rotations >= 0, 3 * n + rotations, -1)
    return np.concatenate([displaced, turned], axis=1)


def _keys(dofs: NDArray, size: int) -> NDArray:
    """Number row * size + column of all pairs (..., d, d) of dofs (..., d); -1 without one."""
    row, column = dofs[..., :, None], dofs[..., None, :]
    return np.where((row >= 0) & (column >= 0), row * size + column, -1)


def _joined(parts: Sequence[NDArray]) -> NDArray:
    return np.concatenate([np.zeros(0, np.int64), *parts])


@inner
def _curvature(model, u, work, h, points, gradient, out):
    """Moment of hinge h times the second derivative of its dihedral, to out (4, 3, 4, 3)."""
    for v in range(4):
        node = model.hinges[h, v]
        for c in range(3):
            points[v, c] = model.bars.rest[node, c] + u[node, c]
            gradient[v, c] = work.gradient[h, 3 * v + c]
    ride(model, h, 1.0, points)
    if rides(model, h):
        for c in range(3):
            gradient[3, c] *= 2.0  # `carry` has given half of it away
    out[:] = 0.0
    add_hessian(points, gradient, work.moment[h], out)
    if rides(model, h):
        carry_wing(out)


@kernel
def _add_folds(model, pattern, u, work, floor, data):
    points, gradient, turned = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3, 4, 3))
    along, bent = np.empty(14), turned.reshape(12, 12)
    p = model.fold_parameters
    for f in range(model.fold_rest.size):
        work.moment[f] = fold_moment(model, work, f)
        slope = hinge_slope(
            model.code, work.fold_angle[f], model.fold_rest[f],
            p[f, 0], p[f, 1], p[f, 2], p[f, 3], model.addresses[2],
        )  # fmt: skip
        slope = model.fold_stiffness[f] * max(slope, floor)
        for c in range(12):
            along[c] = work.gradient[f, c]
        along[12] = along[13] = -model.per_reach
        _curvature(model, u, work, f, points, gradient, turned)
        for r in range(14):
            for q in range(14):
                at = pattern.folds[f, r, q]
                if at >= 0:
                    data[at] += slope * along[r] * along[q]
                    if r < 12 and q < 12:
                        data[at] += bent[r, q]


@kernel
def _add_plates(model, pattern, u, x, work, bend, resist, block, data):
    points, gradient, turned = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3, 4, 3))
    for p in range(pattern.width.size):
        first, wide = model.start[p], pattern.width[p]
        count = model.start[p + 1] - first
        turn_plate(model, x, work, p)
        bend[:] = 0.0
        block[:] = 0.0
        for k in range(count):
            h = model.angle[first + k]
            if h >= 0:
                for v in range(4):
                    for c in range(3):
                        bend[k, 3 * pattern.corner[first + k, v] + c] += work.gradient[h, 3 * v + c]
            else:
                bend[k, pattern.rotation[first + k]] = model.per_reach
        for k in range(count):
            moment = 0.0
            resist[k] = 0.0
            for m in range(count):
                stiff = model.stiffness[model.entry[p] + k * count + m]
                moment += stiff * work.turn[m]
                for r in range(wide):
                    resist[k, r] += stiff * bend[m, r]
            h = model.angle[first + k]
            if h < 0:
                continue
            work.moment[h] = moment
            _curvature(model, u, work, h, points, gradient, turned)
            moved = 3 if rides(model, h) else 4
            for v in range(moved):
                for w in range(moved):
                    row, column = pattern.corner[first + k, v], pattern.corner[first + k, w]
                    for a in range(3):
                        for b in range(3):
                            block[3 * row + a, 3 * column + b] += turned[v, a, w, b]
        for k in range(count):
            for r in range(wide):
                for q in range(wide):
                    block[r, q] += bend[k, r] * resist[k, q]
        for r in range(wide):
            for q in range(wide):
                data[pattern.plates[pattern.start[p] + r * wide + q]] += block[r, q]


def add_plates_tangent(
    model: BarsPlates, pattern: PlatesPattern, u: NDArray, x: NDArray, work: object, floor: float,
    data: NDArray,
) -> None:  # fmt: skip
    """Add the tangent of folds and plates at displacements u (n, 3) and rotations x (r,).

    floor : slopes of the folds' law per unit stiffness below it are raised to it.
    """
    turn_hinges(model, u, work)
    turn_folds(model, x, work)
    _add_folds(model, pattern, u, work, floor, data)
    wide, count = int(pattern.width.max(initial=0)), int(np.diff(model.start).max(initial=0))
    bend, resist = np.empty((2, count, wide))
    _add_plates(model, pattern, u, x, work, bend, resist, np.empty((wide, wide)), data)
