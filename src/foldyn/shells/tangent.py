"""Tangent stiffness of a shell: exact, assembled into a sparse matrix of a known pattern."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.compiled import kernel, scalar
from foldyn.materials.switch import hinge_moment, hinge_slope
from foldyn.mechanics.dihedral import add_hessian
from foldyn.shells.kernels import ShellModel, ShellWork, fold, side_rotations, side_strains
from foldyn.shells.sparsity import ShellPattern


@scalar
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


@scalar
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


@scalar
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
            if model.rotation[t, k] >= 0:
                bend[k, 18 + k] = model.sign[t, k] * model.per_reach
        _membrane(model, t, e, gap, block)
        _bending(model, t, bend, resist, block)
        _scatter(pattern.indptr, pattern.triangle_dof[t], pattern.triangle[t], 6, block, data)


@kernel
def _curvature(model, u, work, h, points, gradient, out):
    """Moment of hinge h times the second derivative of its dihedral, to out (4, 3, 4, 3)."""
    for v in range(4):
        node = model.hinges[h, v]
        for c in range(3):
            points[v, c] = model.rest[node, c] + (u[node, c] if node < u.shape[0] else 0.0)
            gradient[v, c] = work.gradient[h, 3 * v + c]
    out[:] = 0.0
    add_hessian(points, gradient, work.moment[h], out)


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
        slope = hinge_slope(model.code, turn, rest, p[k, 0], p[k, 1], model.addresses[2])
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
    model: ShellModel, pattern: ShellPattern, u: NDArray, x: NDArray, work: ShellWork,
    floor: float = -np.inf,
) -> sparse.csr_array:  # fmt: skip
    """Tangent stiffness at displacements u (n, 3) and rotations x (r,).

    floor : slopes of the creases' law per unit stiffness below it are raised to it.
    """
    data = np.zeros(len(pattern.indices))
    fold(model, u, x, work)
    work.moment[:] = 0.0
    _add_triangles(model, pattern, u, x, work, data)
    _add_hinges(model, pattern, u, work, data)
    _add_creases(model, pattern, u, work, floor, data)
    return sparse.csr_array(
        (data, pattern.indices, pattern.indptr), shape=(pattern.size, pattern.size)
    )
