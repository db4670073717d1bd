"""Tangent stiffness of a shell: exact, assembled into a sparse matrix of a known pattern.

Dofs are 3 node + axis, then the rotations. A *place* is a node, with three dofs, or a rotation,
with one; what couples two places is a block of adjacent entries in each of its rows, so that a
triangle with its three neighbors, 21 dofs, needs the first entries of 9 x 9 blocks only.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.materials.switch import hinge_moment, hinge_slope
from foldyn.mechanics.dihedral import add_hessian, carry_wing
from foldyn.shells.kernels import (
    ShellModel,
    fold,
    ride,
    shell_work,
    side_rotations,
    side_strains,
    wing_points,
)


class ShellPattern(NamedTuple):
    """Pattern of the tangent, and where the elements' blocks go; -1 where there is no place.

    Entry (a, b) of block (i, j) comes a * (indptr[d + 1] - indptr[d]) + b entries after the
    block's first one, d the first dof of place i.
    """

    size: int  # of the matrix
    indptr: NDArray  # (size + 1,)
    indices: NDArray  # (nnz,)
    corner: NDArray  # (nt, 3, 4) which of a triangle's six nodes the nodes of its hinges are
    triangle_dof: NDArray  # (nt, 9) first dofs of its six nodes and three rotations
    triangle: NDArray  # (nt, 9, 9) first entries
    owner: NDArray  # (nh,) 3 t + k of a triangle with the hinge on its side k; -1 on creases
    piece_dof: NDArray  # (c, 6) first dofs of a crease's four nodes and two rotations
    piece: NDArray  # (c, 6, 6) first entries


def shell_pattern(model: ShellModel) -> ShellPattern:
    """Pattern of the tangent."""
    n, count = model.nodes, model.nodes + model.rotations
    nodes, corner = _neighborhoods(model)
    triangle = np.concatenate([nodes, np.where(model.rotation >= 0, n + model.rotation, -1)], 1)
    turns = np.where(model.piece_rotations >= 0, n + model.piece_rotations, -1)
    piece = np.concatenate([model.hinges[model.piece_hinge], turns], axis=1)
    owner = np.full(len(model.hinges), -1, np.int64)
    side = np.flatnonzero(model.hinge.ravel() >= 0)
    owner[model.hinge.ravel()[side]] = side

    coupled = _coupled((triangle, piece), count)
    row, column = np.repeat(np.arange(count), np.diff(coupled.indptr)), coupled.indices
    pairs = row * count + column
    width = np.where(np.arange(count) < n, 3, 1)
    dof = np.concatenate([[0], np.cumsum(width)])  # first of each place
    behind = np.concatenate([[0], np.cumsum(width[column])])  # entries of one row of each place
    start = behind[coupled.indptr]
    length = np.repeat(np.diff(start), width)  # of the rows of the matrix
    indptr = np.concatenate([[0], np.cumsum(length)])
    first = indptr[dof[row]] + behind[:-1] - start[row]  # entry of each pair

    once = np.repeat(dof[column] - behind[:-1], width[column]) + np.arange(behind[-1])
    copy = np.arange(indptr[-1]) + np.repeat(np.repeat(start[:-1], width) - indptr[:-1], length)
    return ShellPattern(
        size=int(dof[-1]),
        indptr=indptr.astype(np.int32),
        indices=once.astype(np.int32)[copy],
        corner=corner,
        triangle_dof=_first_dofs(triangle, dof),
        triangle=_first_entries(triangle, pairs, first, count),
        owner=owner,
        piece_dof=_first_dofs(piece, dof),
        piece=_first_entries(piece, pairs, first, count),
    )


def _coupled(elements: tuple[NDArray, ...], count: int) -> sparse.csr_array:
    """Which places occur in one element (e, k) together, sorted; each with itself."""
    places = np.concatenate([np.arange(count), *(element.ravel() for element in elements)])
    sizes = [np.ones(count, np.int64), *(np.full(len(e), e.shape[1]) for e in elements)]
    number = np.repeat(np.arange(sum(map(len, sizes))), np.concatenate(sizes))
    known = places >= 0
    within = sparse.csr_array((np.ones(known.sum(), np.int32), (number[known], places[known])))
    together = sparse.csr_array(within.T @ within)
    together.sort_indices()
    return together


def _first_dofs(places: NDArray, dof: NDArray) -> NDArray:
    return np.where(places >= 0, dof[places], -1).astype(np.int32)


def _first_entries(places: NDArray, pairs: NDArray, first: NDArray, count: int) -> NDArray:
    """First entries (e, k, k) of the blocks of places (e, k); -1 without one of them."""
    row, column = places[:, :, None], places[:, None, :]
    key = np.where((row >= 0) & (column >= 0), row * count + column, -1)
    entry = np.where(key >= 0, first[np.searchsorted(pairs, key)], -1)
    return entry.astype(np.int32)


def _neighborhoods(model: ShellModel) -> tuple[NDArray, NDArray]:
    """Nodes (nt, 6): corners, then the far wing of each side's hinge (-1: none); and `corner`."""
    tri = model.triangles
    nodes = np.concatenate([tri, np.full_like(tri, -1)], axis=1)
    corner = np.zeros((len(tri), 3, 4), np.int8)
    for k in range(3):
        has = np.flatnonzero(model.hinge[:, k] >= 0)
        row = model.hinges[model.hinge[has, k]]
        own = row[:, :, None] == tri[has][:, None, :]
        nodes[has, 3 + k] = row[~own.any(axis=2)]
        corner[has, k] = np.where(own.any(axis=2), own.argmax(axis=2), 3 + k)
    return np.where(nodes < model.nodes, nodes, -1), corner


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
                at = first[i, j] + a * stride
                for b in range(columns):
                    data[at + b] += block[p + a, q + b]


@inner_scalar
def _membrane(model, t, e, gap, block):
    """Add the second derivative of a triangle's membrane energy, gap (3, 3) its sides now."""
    for k in range(3):
        i = (k + 1) % 3
        stress = 0.0
        for m in range(3):
            stress += model.membrane[t, k, m] * e[m]
        stress *= model.per_length2[t, k]
        for m in range(3):
            j = (m + 1) % 3
            stiff = model.membrane[t, k, m] * model.per_length2[t, k] * model.per_length2[t, m]
            for a in range(3):
                for b in range(3):
                    term = stiff * gap[k, a] * gap[m, b]
                    if k == m and a == b:
                        term += stress
                    block[3 * i + a, 3 * j + b] += term
                    block[3 * k + a, 3 * m + b] += term
                    block[3 * i + a, 3 * m + b] -= term
                    block[3 * k + a, 3 * j + b] -= term


@inner_scalar
def _bending(model, t, bend, resist, block):
    """Add bend^T bending bend, bend (3, 21) the derivatives of the rotations beta."""
    for k in range(3):
        for p in range(21):
            resist[k, p] = 0.0
        for m in range(3):
            for p in range(21):
                resist[k, p] += model.bending[t, k, m] * bend[m, p]
    for p in range(21):
        x, y, z = bend[0, p], bend[1, p], bend[2, p]
        for q in range(21):
            block[p, q] += x * resist[0, q] + y * resist[1, q] + z * resist[2, q]


@kernel
def _add_triangles(model, pattern, u, x, work, data):
    e, beta, gap = np.empty(3), np.empty(3), np.empty((3, 3))
    bend, resist, block = np.empty((3, 21)), np.empty((3, 21)), np.empty((21, 21))
    for t in range(model.triangles.shape[0]):
        side_strains(model, u, t, e)
        side_rotations(model, x, work.turn, t, beta)
        bend[:] = 0.0
        block[:] = 0.0
        for k in range(3):
            a, b = model.triangles[t, k], model.triangles[t, (k + 1) % 3]
            for c in range(3):
                gap[k, c] = model.side[t, k, c] + u[b, c] - u[a, c]
            h = model.hinge[t, k]
            if h >= 0:
                weight = model.weight[t, k]
                for m in range(3):
                    work.moment[h] += weight * model.bending[t, k, m] * beta[m]
                for v in range(4):
                    at = 3 * pattern.corner[t, k, v]
                    for c in range(3):
                        bend[k, at + c] = weight * work.gradient[h, 3 * v + c]
                if model.hinges[h, 3] >= model.nodes:  # a wing rides on the ends of its side
                    for v in range(2):
                        at = 3 * pattern.corner[t, k, v]
                        for c in range(3):
                            bend[k, at + c] += 0.5 * weight * work.gradient[h, 9 + c]
            if model.rotation[t, k] >= 0:
                bend[k, 18 + k] = model.sign[t, k] * model.per_reach
        _membrane(model, t, e, gap, block)
        _bending(model, t, bend, resist, block)
        _scatter(pattern.indptr, pattern.triangle_dof[t], pattern.triangle[t], 6, block, data)


@inner
def _curvature(model, u, work, h, points, gradient, out):
    """Moment of hinge h times the second derivative of its dihedral, to out (4, 3, 4, 3)."""
    for v in range(4):
        node = model.hinges[h, v]
        for c in range(3):
            points[v, c] = model.rest[node, c] + (u[node, c] if node < u.shape[0] else 0.0)
            gradient[v, c] = work.gradient[h, 3 * v + c]
    if model.hinges[h, 3] >= model.nodes:
        wing_points(model, u, h, points)
    out[:] = 0.0
    add_hessian(points, gradient, work.moment[h], out)
    if model.hinges[h, 3] >= model.nodes:
        carry_wing(out)


@kernel
def _add_hinges(model, pattern, u, work, data):
    points, gradient, block = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3, 4, 3))
    dof, first = np.empty(4, np.int32), np.empty((4, 4), np.int32)
    flat = block.reshape(12, 12)
    for h in range(model.hinges.shape[0]):
        if pattern.owner[h] < 0:
            continue
        _curvature(model, u, work, h, points, gradient, block)
        t, k = pattern.owner[h] // 3, pattern.owner[h] % 3
        for v in range(4):
            dof[v] = pattern.triangle_dof[t, pattern.corner[t, k, v]]
            for w in range(4):
                first[v, w] = pattern.triangle[t, pattern.corner[t, k, v], pattern.corner[t, k, w]]
        _scatter(pattern.indptr, dof, first, 4, flat, data)


@kernel
def _add_creases(model, pattern, u, work, floor, data):
    points, gradient, turned = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3, 4, 3))
    along, block = np.empty(14), np.empty((14, 14))
    flat = turned.reshape(12, 12)
    p = model.piece_parameters
    for k in range(model.piece_hinge.size):
        h, turn, rest = model.piece_hinge[k], work.fold_angle[k], model.piece_rest[k]
        work.moment[h] = model.piece_stiffness[k] * hinge_moment(
            model.code, turn, rest, p[k, 0], p[k, 1], p[k, 2], p[k, 3], model.addresses[1]
        )
        slope = hinge_slope(
            model.code, turn, rest, p[k, 0], p[k, 1], p[k, 2], p[k, 3], model.addresses[2]
        )
        slope = model.piece_stiffness[k] * max(slope, floor)
        for c in range(12):
            along[c] = work.gradient[h, c]
        along[12] = along[13] = -model.per_reach
        for r in range(14):
            for q in range(14):
                block[r, q] = slope * along[r] * along[q]
        _curvature(model, u, work, h, points, gradient, turned)
        for r in range(12):
            for q in range(12):
                block[r, q] += flat[r, q]
        _scatter(pattern.indptr, pattern.piece_dof[k], pattern.piece[k], 4, block, data)


def shell_tangent(
    model: ShellModel, pattern: ShellPattern, u: NDArray, x: NDArray, floor: float = -np.inf
) -> sparse.csr_array:
    """Tangent stiffness at displacements u (n, 3) and rotations x (r,).

    floor : slopes of the creases' law per unit stiffness below it are raised to it.
    """
    data, work = np.zeros(len(pattern.indices)), shell_work(model)
    fold(model, u, x, work)
    ride(model, u, work)
    work.moment[:] = 0.0
    _add_triangles(model, pattern, u, x, work, data)
    _add_hinges(model, pattern, u, work, data)
    _add_creases(model, pattern, u, work, floor, data)
    return sparse.csr_array(
        (data, pattern.indices, pattern.indptr), shape=(pattern.size, pattern.size)
    )


def add_extrapolated_strain(
    model: ShellModel, pattern: ShellPattern, u: NDArray, before: NDArray, data: NDArray
) -> None:
    """Replace the stresses in a tangent's entries `data` at u by those extrapolated to it.

    The strains that panels get from being moved along straight lines, of second order in their
    turn, are kept out of the geometric stiffness of the next step of Newton's method, as
    `mechanics.step_tangent` does for bars; the residual sees the true ones.

    u, before : (n, 3) states after and before the last step.
    """
    # e(u) - e(u0) - (D0 . d) / L^2 = |d|^2 / (2 L^2)
    step = _apart(model, u) - _apart(model, before)
    _add_strain(model, pattern, -0.5 * _dot(step, step) * model.per_length2, data)


def add_mean_strain(
    model: ShellModel, pattern: ShellPattern, u0: NDArray, u1: NDArray, before: NDArray,
    again: bool, data: NDArray,
) -> None:  # fmt: skip
    """Replace those in a tangent halfway by the mean ones of a step from u0 to u1.

    before, again : from where those at u1 are extrapolated; those at u0 unless `again`.
    """
    step = _apart(model, u1 - u0)
    if again:  # halfway between two states a strain is less than the mean by |d|^2 / (8 L^2)
        last = _apart(model, u1 - before)
        more = 0.125 * _dot(step, step) - 0.25 * _dot(last, last)
    else:
        more = -0.5 * _dot(model.side + _apart(model, u0), step) - 0.125 * _dot(step, step)
    _add_strain(model, pattern, more * model.per_length2, data)


def _add_strain(model: ShellModel, pattern: ShellPattern, strain: NDArray, data: NDArray) -> None:
    """Add the geometric stiffness of strains (nt, 3) of the sides to a tangent's entries."""
    stress = np.einsum("tkl,tl->tk", model.membrane, strain) * model.per_length2
    dof = pattern.triangle_dof[:, :3]
    diagonal = pattern.indptr[dof + 1] - pattern.indptr[dof] + 1  # from (0, 0) to (1, 1) of a block
    slots, values = [], []
    for k in range(3):
        ends = (k, (k + 1) % 3)
        for one in ends:
            for other in ends:
                for axis in range(3):
                    slots.append(pattern.triangle[:, one, other] + axis * diagonal[:, one])
                    values.append(stress[:, k] if one == other else -stress[:, k])
    data += np.bincount(np.concatenate(slots), np.concatenate(values), len(data))


def _apart(model: ShellModel, u: NDArray) -> NDArray:
    """Relative displacements (nt, 3, 3) of the ends of the sides."""
    return u[np.roll(model.triangles, -1, axis=1)] - u[model.triangles]


def _dot(one: NDArray, other: NDArray) -> NDArray:
    return np.einsum("tki,tki->tk", one, other)
