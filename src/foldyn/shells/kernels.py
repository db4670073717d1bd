"""Energy and forces of a shell of triangles, compiled.

Displacements u (n, 3) and rotations; see `shells.sides`. The dofs x (r,) of
the rotations are lengths as well, m, so that norms over all dofs do not depend on the unit of
length: a rotation is x times `per_reach`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.jit.intrinsics import flat
from foldyn.materials.switch import hinge_energy, hinge_moment
from foldyn.mechanics.dihedral import dihedral_gradient
from foldyn.mechanics.discrete_gradient import discrete_gradient, mean_moment
from foldyn.mechanics.term import (
    ENERGIES,
    FORCES,
    MEAN_FORCES,
    Compiled,
    Whole,
    energies,
    forces,
    mean_forces,
    parted_rows,
)
from foldyn.mechanics.threads import Team, team


class ShellModel(NamedTuple):
    """Arrays of a shell: n nodes, g wings, nt triangles, nh hinges, c pieces of creases."""

    nodes: int  # n
    rotations: int  # r
    per_reach: float  # rotation (rad) of a dof of 1 m, 1/m
    rest: NDArray  # (n + g, 3) from the mean of the nodes, m; wings ride on their sides' ends
    triangles: NDArray  # (nt, 3)
    side: NDArray  # (nt, 3, 3) rest vectors of the sides, m
    per_length2: NDArray  # (nt, 3) 1 / L^2
    membrane: NDArray  # (nt, 3, 3) J
    bending: NDArray  # (nt, 3, 3) N m
    hinges: NDArray  # (nh, 4)
    hinge_rest: NDArray  # (nh,) rad
    hinge: NDArray  # (nt, 3), and so on as in `Sides`
    weight: NDArray
    rotation: NDArray
    sign: NDArray
    piece_hinge: NDArray  # (c,)
    piece_rotations: NDArray  # (c, 2)
    piece_stiffness: NDArray  # (c,) N m/rad
    piece_rest: NDArray  # (c,) rad
    piece_parameters: NDArray  # (c, 4)
    code: int  # of the creases' law
    addresses: NDArray  # (3,) of a user's law

    @property
    def rows(self) -> int:
        """Rows of three that hold displacements and then rotations, the last one filled up."""
        return self.nodes + -(-self.rotations // 3)


class ShellWork(NamedTuple):
    """Memory of one evaluation."""

    turn: NDArray  # (nh,) change of the dihedrals, rad
    gradient: NDArray  # (nh, 12)
    moment: NDArray  # (nh,) N m
    fold_angle: NDArray  # (c,) dihedral of each piece of a crease, rad
    angle: NDArray  # (nh,) dihedrals, rad
    strips: Whole
    team: Team


def shell_work(model: ShellModel) -> ShellWork:
    """Memory for `model`."""
    nh = len(model.hinges)
    return ShellWork(
        np.zeros(nh), np.zeros((nh, 12)), np.zeros(nh), np.zeros(len(model.piece_hinge)),
        np.zeros(nh), Whole(np.array([0, model.rows])), team(1)[0],
    )  # fmt: skip


@kernel
def fold(model, u, x, work):
    """Dihedrals, their gradients and those of the creases at a state; see `ride` for wings."""
    rest, n = model.rest, u.shape[0]
    p = np.empty(12)
    for e in range(model.hinges.shape[0]):
        for v in range(4):
            node = model.hinges[e, v]
            for c in range(3):
                p[3 * v + c] = rest[node, c] + (u[node, c] if node < n else 0.0)
        found = dihedral_gradient(
            p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11]
        )
        work.angle[e] = found[0]
        work.turn[e] = found[0] - model.hinge_rest[e]
        for c in range(12):
            work.gradient[e, c] = found[1 + c]
    for k in range(model.piece_hinge.size):
        e = model.piece_hinge[k]
        one, other = model.piece_rotations[k]
        both = (x[one] if one >= 0 else 0.0) + (x[other] if other >= 0 else 0.0)
        work.fold_angle[k] = model.hinge_rest[e] + work.turn[e] - model.per_reach * both


@kernel
def ride(model, u, work):
    """Dihedrals of the hinges with wings, the last ones, where these ride on j and k."""
    wings, p = model.rest.shape[0] - model.nodes, np.empty((4, 3))
    for e in range(model.hinges.shape[0] - wings, model.hinges.shape[0]):
        wing_points(model, u, e, p)
        found = dihedral_gradient(
            p[0, 0], p[0, 1], p[0, 2], p[1, 0], p[1, 1], p[1, 2],
            p[2, 0], p[2, 1], p[2, 2], p[3, 0], p[3, 1], p[3, 2],
        )  # fmt: skip
        work.angle[e] = found[0]
        work.turn[e] = found[0] - model.hinge_rest[e]
        for c in range(12):
            work.gradient[e, c] = found[1 + c]


@inner_scalar
def wing_points(model, u, e, out):
    """Points (4, 3) of a hinge, of which the last may be a wing."""
    j, k, n = model.hinges[e, 0], model.hinges[e, 1], model.nodes
    for c in range(3):
        for v in range(4):
            node = model.hinges[e, v]
            moved = u[node, c] if node < n else 0.5 * (u[j, c] + u[k, c])
            out[v, c] = model.rest[node, c] + moved


@inner
def side_strains(model, u, t, out):
    """Green strains of the sides of a triangle, from displacements."""
    for k in range(3):
        a, b = model.triangles[t, k], model.triangles[t, (k + 1) % 3]
        total = 0.0
        for c in range(3):
            du = u[b, c] - u[a, c]
            total += du * (2.0 * model.side[t, k, c] + du)
        out[k] = 0.5 * total * model.per_length2[t, k]


@inner
def side_rotations(model, x, turn, t, out):
    """Rotations beta of the sheet at the sides of a triangle."""
    for k in range(3):
        out[k] = 0.0
        if model.hinge[t, k] >= 0:
            out[k] += model.weight[t, k] * turn[model.hinge[t, k]]
        if model.rotation[t, k] >= 0:
            out[k] += model.sign[t, k] * model.per_reach * x[model.rotation[t, k]]


@inner
def shell_energy(model, u, x, work, out):
    """Energies (J) of membrane, bending and creases, to out (3,)."""
    fold(model, u, x, work)
    ride(model, u, work)
    e, beta = np.empty(3), np.empty(3)
    out[:] = 0.0
    for t in range(model.triangles.shape[0]):
        side_strains(model, u, t, e)
        side_rotations(model, x, work.turn, t, beta)
        for k in range(3):
            for m in range(3):
                out[0] += 0.5 * e[k] * model.membrane[t, k, m] * e[m]
                out[1] += 0.5 * beta[k] * model.bending[t, k, m] * beta[m]
    p = model.piece_parameters
    for k in range(model.piece_hinge.size):
        w = hinge_energy(
            model.code, work.fold_angle[k], model.piece_rest[k],
            p[k, 0], p[k, 1], p[k, 2], p[k, 3], model.addresses[0],
        )  # fmt: skip
        out[2] += model.piece_stiffness[k] * w


@inner
def shell_force(model, u, x, force, couple, work):
    """Internal force (n, 3), N, and that of the dofs of rotations (r,), N."""
    fold(model, u, x, work)
    ride(model, u, work)
    n = u.shape[0]
    force[:] = 0.0
    couple[:] = 0.0
    work.moment[:] = 0.0
    e, beta = np.empty(3), np.empty(3)
    for t in range(model.triangles.shape[0]):
        side_strains(model, u, t, e)
        side_rotations(model, x, work.turn, t, beta)
        for k in range(3):
            stress, moment = 0.0, 0.0
            for m in range(3):
                stress += model.membrane[t, k, m] * e[m]
                moment += model.bending[t, k, m] * beta[m]
            stress *= model.per_length2[t, k]
            a, b = model.triangles[t, k], model.triangles[t, (k + 1) % 3]
            for c in range(3):
                pull = stress * (model.side[t, k, c] + u[b, c] - u[a, c])
                force[b, c] += pull
                force[a, c] -= pull
            if model.hinge[t, k] >= 0:
                work.moment[model.hinge[t, k]] += model.weight[t, k] * moment
            if model.rotation[t, k] >= 0:
                couple[model.rotation[t, k]] += model.sign[t, k] * model.per_reach * moment
    p = model.piece_parameters
    for k in range(model.piece_hinge.size):
        moment = model.piece_stiffness[k] * hinge_moment(
            model.code, work.fold_angle[k], model.piece_rest[k],
            p[k, 0], p[k, 1], p[k, 2], p[k, 3], model.addresses[1],
        )  # fmt: skip
        work.moment[model.piece_hinge[k]] += moment
        for rotation in model.piece_rotations[k]:
            if rotation >= 0:
                couple[rotation] -= model.per_reach * moment
    for h in range(model.hinges.shape[0]):
        for v in range(4):
            node = model.hinges[h, v]
            if node < n:
                for c in range(3):
                    force[node, c] += work.moment[h] * work.gradient[h, 3 * v + c]
    carry(model, force, work)


@inner
def carry(model, force, work):
    """Give the forces on wings to the nodes on which they ride."""
    wings = model.rest.shape[0] - model.nodes
    for h in range(model.hinges.shape[0] - wings, model.hinges.shape[0]):
        for end in range(2):
            for c in range(3):
                carried = 0.5 * work.moment[h] * work.gradient[h, 9 + c]
                force[model.hinges[h, end], c] += carried


@inner
def add_mean_shell_force(model, u0, x0, u1, x1, before, force, couple, work):
    """Add forces whose work is the change of the energy; `before` are the dihedrals at u0.

    Strains are quadratic in the positions, as those of bars: see `mechanics.discrete_gradient`.
    """
    fold(model, u1, x1, work)
    ride(model, u1, work)
    work.moment[:] = 0.0
    for h in range(work.turn.size):
        work.turn[h] = 0.5 * (before[h] + work.angle[h]) - model.hinge_rest[h]
    e, beta, start, rotated = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for t in range(model.triangles.shape[0]):
        side_strains(model, u0, t, start)
        side_strains(model, u1, t, e)
        side_rotations(model, x0, work.turn, t, rotated)
        side_rotations(model, x1, work.turn, t, beta)
        for k in range(3):
            stress, moment = 0.0, 0.0
            for m in range(3):
                stress += 0.5 * model.membrane[t, k, m] * (start[m] + e[m])
                moment += 0.5 * model.bending[t, k, m] * (rotated[m] + beta[m])
            stress *= model.per_length2[t, k]
            a, b = model.triangles[t, k], model.triangles[t, (k + 1) % 3]
            for c in range(3):
                moved = 0.5 * (u0[b, c] - u0[a, c] + u1[b, c] - u1[a, c])
                force[b, c] += stress * (model.side[t, k, c] + moved)
                force[a, c] -= stress * (model.side[t, k, c] + moved)
            if model.hinge[t, k] >= 0:
                work.moment[model.hinge[t, k]] += model.weight[t, k] * moment
            if model.rotation[t, k] >= 0:
                couple[model.rotation[t, k]] += model.sign[t, k] * model.per_reach * moment
    for k in range(model.piece_hinge.size):
        angle = before[model.piece_hinge[k]]
        for rotation in model.piece_rotations[k]:
            angle -= model.per_reach * x0[rotation] if rotation >= 0 else 0.0
        moment = model.piece_stiffness[k] * mean_moment(
            model.code, model.addresses, model.piece_parameters[k], 1.0, model.piece_rest[k], angle,
            work.fold_angle[k] - angle,
        )[0]  # fmt: skip
        work.moment[model.piece_hinge[k]] += moment
        for rotation in model.piece_rotations[k]:
            if rotation >= 0:
                couple[rotation] -= model.per_reach * moment
    x, dx, points = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3))
    plain, gradient, end, n = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3)), u0.shape[0]
    for h in range(model.hinges.shape[0]):
        wing_points(model, u0, h, x)
        wing_points(model, u1, h, end)
        for v in range(4):
            for c in range(3):
                dx[v, c], x[v, c] = end[v, c] - x[v, c], 0.5 * (x[v, c] + end[v, c])
        discrete_gradient(x, dx, work.angle[h] - before[h], points, plain, gradient)
        for v in range(4):
            for c in range(3):
                work.gradient[h, 3 * v + c] = gradient[v, c]
                if model.hinges[h, v] < n:
                    force[model.hinges[h, v], c] += work.moment[h] * gradient[v, c]
    carry(model, force, work)


class _Context(NamedTuple):
    model: ShellModel
    work: ShellWork
    rows: int


@forces
def _forces(own, u, v, t, force, powers):
    model, moved, out = own.model, rows_at(u, own.rows), rows_at(force, own.rows)
    n, r = model.nodes, model.rotations
    for k in range(3 * n + r, out.size):
        flat(out)[k] = 0.0
    (here, x), (pull, couple) = parted_rows(moved, n, r), parted_rows(out, n, r)
    shell_force(model, here, x, pull, couple, own.work)


@energies
def _energies(own, u, out):
    model, moved = own.model, rows_at(u, own.rows)
    n, r = model.nodes, model.rotations
    here, x = parted_rows(moved, n, r)
    shell_energy(model, here, x, own.work, numbers_at(out, 3))


@mean_forces
def _mean_forces(own, u0, u1, before, h, t, force, powers):
    model, start, end = own.model, rows_at(u0, own.rows), rows_at(u1, own.rows)
    out, angle = rows_at(force, own.rows), numbers_at(before, own.work.angle.size)
    n, r = model.nodes, model.rotations
    (one, x0), (other, x1) = parted_rows(start, n, r), parted_rows(end, n, r)
    pull, couple = parted_rows(out, n, r)
    add_mean_shell_force(model, one, x0, other, x1, angle, pull, couple, own.work)


def shell_kernels(model: ShellModel, work: ShellWork) -> Compiled:
    """A shell."""
    own = Context(_Context(model, work, model.rows))
    return Compiled(own, {FORCES: _forces, ENERGIES: _energies, MEAN_FORCES: _mean_forces})
