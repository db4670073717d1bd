"""Tangent stiffness of bars and hinges, assembled into 3x3 blocks of a precomputed pattern."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.compiled import inner_scalar, kernel
from foldyn.materials.series import series_moment, series_slope
from foldyn.materials.switch import bar_slope, bar_stress
from foldyn.mechanics.dihedral import add_hessian
from foldyn.mechanics.energy import bar_extension, hinge_dihedral
from foldyn.mechanics.model import BarsHinges


class Sparsity(NamedTuple):
    """Positions of each element's 3x3 blocks in the block sparse matrix (rows of node pairs)."""

    indptr: NDArray  # (n + 1,)
    indices: NDArray  # (nnz,)
    bar_slots: NDArray  # (nb, 2, 2)
    hinge_slots: NDArray  # (nh, 4, 4)


def block_keys(indptr: NDArray, indices: NDArray) -> NDArray:
    """Number row * n + column of each block of a pattern, in increasing order."""
    rows = len(indptr) - 1
    return np.repeat(np.arange(rows), np.diff(indptr)) * rows + indices.astype(np.int64)


def distinct(keys: NDArray) -> NDArray:
    """Each key once, in increasing order; faster than np.unique."""
    ordered = np.sort(keys)
    return ordered[np.diff(ordered, prepend=-1) > 0]


def entry_slots(pattern: Sparsity, row: NDArray, column: NDArray) -> NDArray:
    """Flat positions of entries (k,) at dofs among the block entries of a pattern."""
    keys, rows = block_keys(pattern.indptr, pattern.indices), len(pattern.indptr) - 1
    block = np.searchsorted(keys, row // 3 * rows + column // 3)
    return (9 * block + 3 * (row % 3) + column % 3).astype(np.int32)


def sparsity(model: BarsHinges) -> Sparsity:
    """Block pattern of the tangent; every node has a diagonal block."""
    n = len(model.rest)
    keys = [np.arange(n) * (n + 1)]  # row * n + column
    for nodes in (model.bars, model.hinges):
        wide = nodes.astype(np.int64)
        keys.append((wide[:, :, None] * n + wide[:, None, :]).ravel())
    blocks, inverse = np.unique(np.concatenate(keys), return_inverse=True)
    nb = len(model.bars)
    slots = inverse[n:]
    indptr = np.searchsorted(blocks // n, np.arange(n + 1)).astype(np.int32)
    bars, hinges = slots[: 4 * nb].reshape(-1, 2, 2), slots[4 * nb :].reshape(-1, 4, 4)
    indices = (blocks % n).astype(np.int32)
    return Sparsity(indptr, indices, np.ascontiguousarray(bars), np.ascontiguousarray(hinges))


def joined(pattern: Sparsity, more: NDArray) -> Sparsity:
    """Pattern with additional blocks, numbered as in `block_keys`."""
    rows, own = len(pattern.indptr) - 1, block_keys(pattern.indptr, pattern.indices)
    both = distinct(np.concatenate([own, more]))
    moved = np.searchsorted(both, own)
    indptr = np.searchsorted(both // rows, np.arange(rows + 1)).astype(np.int32)
    indices = (both % rows).astype(np.int32)
    return Sparsity(indptr, indices, moved[pattern.bar_slots], moved[pattern.hinge_slots])


@inner_scalar
def add_to_bar(data, slots, e, p, q, value):
    """Add a value to entry (p, q) of both end blocks of a bar; subtract it from the others."""
    data[slots[e, 0, 0], p, q] += value
    data[slots[e, 1, 1], p, q] += value
    data[slots[e, 0, 1], p, q] -= value
    data[slots[e, 1, 0], p, q] -= value


@inner_scalar
def add_to_hinge(data, slots, e, block, slope, turning, turned):
    """Add `block` (4, 3, 4, 3) plus slope times two gradients (4, 3) to a hinge's blocks."""
    for v in range(4):
        for w in range(4):
            slot = slots[e, v, w]
            for a in range(3):
                for b in range(3):
                    data[slot, a, b] += block[v, a, w, b] + slope * turning[v, a] * turned[w, b]


@kernel
def _add_bars(model, u, slots, data):
    d = np.empty(3)
    for run in range(model.bar_runs.shape[0]):
        code = model.bar_runs[run, 2]
        stress_at = model.addresses[model.bar_runs[run, 3], 1]
        slope_at = model.addresses[model.bar_runs[run, 3], 2]
        for e in range(model.bar_runs[run, 0], model.bar_runs[run, 1]):
            a, b = model.bars[e, 0], model.bars[e, 1]
            for c in range(3):
                d[c] = model.bar_vector[e, c] + u[b, c] - u[a, c]
            x = bar_extension(model, u, e)
            axial = model.bar_stiffness[e] * bar_stress(code, x, stress_at)
            along = model.bar_stiffness[e] * bar_slope(code, x, slope_at)
            along *= model.bar_per_length2[e]
            for p in range(3):
                for q in range(3):
                    value = along * d[p] * d[q]
                    if p == q:
                        value += axial
                    add_to_bar(data, slots, e, p, q, value)


@kernel
def _add_hinges(model, u, slots, data, floor):
    points, gradient, block = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3, 4, 3))
    flat = gradient.reshape(12)
    p = model.hinge_parameters
    for run in range(model.hinge_runs.shape[0]):
        code = model.hinge_runs[run, 2]
        address = model.addresses[model.hinge_runs[run, 3]]
        for e in range(model.hinge_runs[run, 0], model.hinge_runs[run, 1]):
            for v in range(4):
                for c in range(3):
                    points[v, c] = model.rest[model.hinges[e, v], c] + u[model.hinges[e, v], c]
            dihedral = hinge_dihedral(model, u, e)
            for c in range(12):
                flat[c] = dihedral[1 + c]
            theta, rest = dihedral[0] + model.hinge_offset[e, 0], model.hinge_rest[e]
            a, b, c, d, share = p[e, 0], p[e, 1], p[e, 2], p[e, 3], model.hinge_share[e]
            k = model.hinge_stiffness[e]
            moment = k * series_moment(code, theta, rest, a, b, c, d, share, address)
            slope = series_slope(code, theta, rest, a, b, c, d, share, address)
            slope = k * max(slope, floor)
            block[:] = 0.0
            add_hessian(points, gradient, moment, block)
            add_to_hinge(data, slots, e, block, slope, gradient, gradient)


def tangent(
    model: BarsHinges, pattern: Sparsity, u: NDArray, floor: float = -np.inf
) -> sparse.bsr_array:
    """Tangent stiffness (3n, 3n), N/m, at displacement u (n, 3), as 3x3 blocks.

    floor : least slope of hinges per unit stiffness; smaller slopes are raised to it. The default
    changes nothing; 1.0 gives an upper bound for the stiffness of laws that are soft at rest.
    """
    n = len(model.rest)
    data = np.zeros((len(pattern.indices), 3, 3))
    add_tangent(model, pattern, u, floor, data)
    return sparse.bsr_array((data, pattern.indices, pattern.indptr), shape=(3 * n, 3 * n))


def add_tangent(
    model: BarsHinges, pattern: Sparsity, u: NDArray, floor: float, data: NDArray
) -> None:
    """Add the blocks of `tangent` to `data` (nnz, 3, 3)."""
    _add_bars(model, u, pattern.bar_slots, data)
    _add_hinges(model, u, pattern.hinge_slots, data, floor)
