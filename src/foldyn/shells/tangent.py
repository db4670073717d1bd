"""Tangent stiffness of a shell: exact, assembled into a sparse matrix of a known pattern.

Dofs are 3 node + axis, then the rotations. A triangle with its three neighbors has 18 + 3 of them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.materials.compiled import kernel
from foldyn.materials.switch import hinge_moment, hinge_slope
from foldyn.mechanics.dihedral import add_hessian
from foldyn.shells.kernels import ShellModel, ShellWork, fold, side_rotations, side_strains


class ShellPattern(NamedTuple):
    """Where the entries of elements stand in the matrix; fixed dofs at the place behind its end."""

    size: int  # of the matrix
    indptr: NDArray  # (size + 1,)
    indices: NDArray  # (nnz,)
    corner: NDArray  # (nt, 3, 4) which of a triangle's six nodes the nodes of its hinges are
    triangle: NDArray  # (nt, 21, 21)
    hinge: NDArray  # (nh, 12, 12)
    piece: NDArray  # (c, 14, 14)


def shell_pattern(model: ShellModel) -> ShellPattern:
    """Pattern of the tangent."""
    n = int(model.rest.shape[0] - _wings(model))
    size = 3 * n + _rotations(model)
    nodes, corner = _neighborhoods(model)
    rotation = np.where(model.rotation >= 0, 3 * n + model.rotation, -1)
    stencils = [
        np.concatenate([_dofs(nodes, n), rotation], axis=1),
        _dofs(model.hinges, n),
        np.concatenate(
            [_dofs(model.hinges[model.piece_hinge], n), 3 * n + model.piece_rotations], axis=1
        ),
    ]
    keys = []
    for dofs in stencils:
        row, column = dofs[:, :, None], dofs[:, None, :]
        keys.append(np.where((row >= 0) & (column >= 0), row * size + column, -1))
    diagonal = np.arange(size, dtype=np.int64) * (size + 1)
    found = np.unique(np.concatenate([diagonal, *(key.ravel() for key in keys)]))
    found = found[found >= 0]
    slots = [
        np.where(key >= 0, np.searchsorted(found, key), len(found)).astype(np.int32) for key in keys
    ]
    return ShellPattern(
        size,
        np.searchsorted(found // size, np.arange(size + 1)).astype(np.int32),
        (found % size).astype(np.int32),
        corner,
        *slots,
    )


def _wings(model: ShellModel) -> int:
    return int(model.rest.shape[0] - 1 - model.triangles.max())


def _rotations(model: ShellModel) -> int:
    return int(max(model.rotation.max(initial=-1), model.piece_rotations.max(initial=-1)) + 1)


def _dofs(nodes: NDArray, n: int) -> NDArray:
    """Dofs (e, 3 k) of nodes (e, k), -1 where there is none or it is fixed."""
    dofs = 3 * nodes[:, :, None] + np.arange(3)
    known = ((nodes >= 0) & (nodes < n))[:, :, None]
    return np.where(known, dofs, -1).reshape(len(nodes), -1)


def _neighborhoods(model: ShellModel) -> tuple[NDArray, NDArray]:
    """Nodes (nt, 6): corners, then the far wing of each side's hinge; and `corner`."""
    tri = model.triangles
    nodes = np.concatenate([tri, np.full_like(tri, -1)], axis=1)
    corner = np.zeros((len(tri), 3, 4), np.int64)
    for k in range(3):
        has = np.flatnonzero(model.hinge[:, k] >= 0)
        row = model.hinges[model.hinge[has, k]]
        own = row[:, :, None] == tri[has][:, None, :]
        place = np.where(own.any(axis=2), own.argmax(axis=2), 3 + k)
        nodes[has, 3 + k] = row[~own.any(axis=2)]
        corner[has, k] = place
    return nodes, corner


@kernel
def _add_triangles(model, pattern, u, x, work, data):
    e, beta, stress, moment = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    strain, bend = np.zeros((3, 21)), np.zeros((3, 21))
    pull = np.empty((3, 3))
    block = np.empty((21, 21))
    for t in range(model.triangles.shape[0]):
        side_strains(model, u, t, e)
        side_rotations(model, x, work.turn, t, beta)
        strain[:] = 0.0
        bend[:] = 0.0
        for k in range(3):
            stress[k], moment[k] = 0.0, 0.0
            for m in range(3):
                stress[k] += model.membrane[t, k, m] * e[m]
                moment[k] += model.bending[t, k, m] * beta[m]
            stress[k] *= model.per_length2[t, k]
            a, b, j = model.triangles[t, k], model.triangles[t, (k + 1) % 3], (k + 1) % 3
            for c in range(3):
                pull[k, c] = model.side[t, k, c] + u[b, c] - u[a, c]
                along = pull[k, c] * model.per_length2[t, k]
                strain[k, 3 * j + c] += along
                strain[k, 3 * k + c] -= along
            h = model.hinge[t, k]
            if h >= 0:
                work.moment[h] += model.weight[t, k] * moment[k]
                for v in range(4):
                    at = 3 * pattern.corner[t, k, v]
                    for c in range(3):
                        turning = work.gradient[h, 3 * v + c]
                        bend[k, at + c] += model.weight[t, k] * turning
            if model.rotation[t, k] >= 0:
                bend[k, 18 + k] += model.sign[t, k]
        block[:] = 0.0
        for k in range(3):
            for m in range(3):
                stiff, resist = model.membrane[t, k, m], model.bending[t, k, m]
                for p in range(9):
                    for q in range(9):
                        block[p, q] += stiff * strain[k, p] * strain[m, q]
                if resist != 0.0:
                    for p in range(21):
                        first = resist * bend[k, p]
                        if first != 0.0:
                            for q in range(21):
                                block[p, q] += first * bend[m, q]
            j = (k + 1) % 3
            for c in range(3):
                block[3 * k + c, 3 * k + c] += stress[k]
                block[3 * j + c, 3 * j + c] += stress[k]
                block[3 * k + c, 3 * j + c] -= stress[k]
                block[3 * j + c, 3 * k + c] -= stress[k]
        for p in range(21):
            for q in range(21):
                data[pattern.triangle[t, p, q]] += block[p, q]


@kernel
def _add_creases(model, pattern, work, floor, data):
    along = np.empty(14)
    p = model.piece_parameters
    for k in range(model.piece_hinge.size):
        h, turn, rest = model.piece_hinge[k], work.piece_turn[k], model.piece_rest[k]
        work.moment[h] += model.piece_stiffness[k] * hinge_moment(
            model.code, turn, rest, p[k, 0], p[k, 1], p[k, 2], p[k, 3], model.addresses[1]
        )
        slope = hinge_slope(model.code, turn, rest, p[k, 0], p[k, 1], model.addresses[2])
        slope = model.piece_stiffness[k] * max(slope, floor)
        for c in range(12):
            along[c] = work.gradient[h, c]
        along[12], along[13] = -1.0, -1.0
        for r in range(14):
            for q in range(14):
                data[pattern.piece[k, r, q]] += slope * along[r] * along[q]


@kernel
def _add_hinges(model, pattern, u, work, data):
    points, gradient, block = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3, 4, 3))
    n = u.shape[0]
    for h in range(model.hinges.shape[0]):
        for v in range(4):
            node = model.hinges[h, v]
            for c in range(3):
                points[v, c] = model.rest[node, c] + (u[node, c] if node < n else 0.0)
                gradient[v, c] = work.gradient[h, 3 * v + c]
        block[:] = 0.0
        add_hessian(points, gradient, work.moment[h], block)
        for v in range(4):
            for a in range(3):
                for w in range(4):
                    for b in range(3):
                        data[pattern.hinge[h, 3 * v + a, 3 * w + b]] += block[v, a, w, b]


def shell_tangent(
    model: ShellModel, pattern: ShellPattern, u: NDArray, x: NDArray, work: ShellWork,
    floor: float = -np.inf,
) -> sparse.csr_array:  # fmt: skip
    """Tangent stiffness at displacements u (n, 3) and rotations x (r,).

    floor : slopes of the creases' law per unit stiffness below it are raised to it.
    """
    data = np.zeros(len(pattern.indices) + 1)
    fold(model, u, x, work)
    work.moment[:] = 0.0
    _add_triangles(model, pattern, u, x, work, data)
    _add_creases(model, pattern, work, floor, data)
    _add_hinges(model, pattern, u, work, data)
    return sparse.csr_array(
        (data[:-1], pattern.indices, pattern.indptr), shape=(pattern.size, pattern.size)
    )
