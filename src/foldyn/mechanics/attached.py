"""Springs and clamped edges on a model: further terms of its energy, on the same dofs.

A *clamp* holds the tangent of a panel at its edge j-k: a hinge (j, k, i, wing) with a linear law,
whose wing is no node but rides on the mean displacement of j and k. It keeps its direction in space
and strains nothing when the edge is moved as a whole.

A *spring* is of one of two kinds. A directed one pulls with k (u_a - u_b) . d along a direction d
that stays; without b its foot stands on the ground, in space. An axial one pulls with k (l - l0)
along the current line between its ends.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner_scalar, kernel
from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.mechanics.dihedral import add_hessian, carry_wing, dihedral_gradient
from foldyn.mechanics.term import ENERGIES, FORCES, Term, energies, forces
from foldyn.mechanics.threads import Team

GROUND = -1  # row of a foot that stands still


class Clamps(NamedTuple):
    """Arrays of c clamped edges."""

    nodes: NDArray  # (c, 3) axis j, k and wing i
    points: NDArray  # (c, 4, 3) rest positions of j, k, i and of the wing that rides, m
    rest: NDArray  # (c,) rad
    stiffness: NDArray  # (c,) N m/rad
    group: int  # of the model's energies, to which theirs is added


class Springs(NamedTuple):
    """Arrays of d directed and a axial springs."""

    ends: NDArray  # (d, 2) a and b; `GROUND` in place of b
    direction: NDArray  # (d, 3) unit vectors
    stiffness: NDArray  # (d,) N/m
    axial_ends: NDArray  # (a, 2)
    vector: NDArray  # (a, 3) from the first end to the second at rest, m
    length: NDArray  # (a,) its length, m
    stretch: NDArray  # (a,) how much longer that is than the spring without force, m
    axial_stiffness: NDArray  # (a,) N/m


class AttachedWork(NamedTuple):
    """Memory of one evaluation."""

    inner: Any
    angle: NDArray  # (nh,) dihedrals of the inner model, then of the clamps, rad
    fold_angle: NDArray  # the inner model's
    strips: Any
    team: Team


def no_clamps() -> Clamps:
    """None."""
    empty = np.zeros(0)
    return Clamps(np.zeros((0, 3), np.int64), np.zeros((0, 4, 3)), empty, empty, 0)


def no_springs() -> Springs:
    """None."""
    ends, vectors, numbers = np.zeros((0, 2), np.int64), np.zeros((0, 3)), np.zeros(0)
    return Springs(ends, vectors, numbers, ends, vectors, numbers, numbers, numbers)


@inner_scalar
def clamp_dihedral(clamps, u, e):
    """Dihedral (rad) of a clamp at displacement u, followed by its gradient (12 numbers)."""
    p = clamps.points
    j, k, i = clamps.nodes[e, 0], clamps.nodes[e, 1], clamps.nodes[e, 2]
    return dihedral_gradient(
        p[e, 0, 0] + u[j, 0], p[e, 0, 1] + u[j, 1], p[e, 0, 2] + u[j, 2],
        p[e, 1, 0] + u[k, 0], p[e, 1, 1] + u[k, 1], p[e, 1, 2] + u[k, 2],
        p[e, 2, 0] + u[i, 0], p[e, 2, 1] + u[i, 1], p[e, 2, 2] + u[i, 2],
        p[e, 3, 0] + 0.5 * (u[j, 0] + u[k, 0]),
        p[e, 3, 1] + 0.5 * (u[j, 1] + u[k, 1]),
        p[e, 3, 2] + 0.5 * (u[j, 2] + u[k, 2]),
    )  # fmt: skip


@kernel
def clamp_angles(clamps, u):
    """Dihedrals (c,), rad, and their gradients (c, 9) with respect to j, k, i."""
    angle, gradient = np.empty(clamps.rest.size), np.empty((clamps.rest.size, 9))
    for e in range(angle.size):
        found = clamp_dihedral(clamps, u, e)
        angle[e] = found[0]
        for c in range(9):
            gradient[e, c] = found[1 + c]
            if c < 6:
                gradient[e, c] += 0.5 * found[10 + c % 3]
    return angle, gradient


@kernel
def add_clamp_forces(clamps, u, force, angle):
    """Add the forces of clamps to those of the nodes; their dihedrals end `angle`."""
    first = angle.size - clamps.rest.size
    for e in range(clamps.rest.size):
        found = clamp_dihedral(clamps, u, e)
        angle[first + e] = found[0]
        moment = clamps.stiffness[e] * (found[0] - clamps.rest[e])
        for c in range(3):
            carried = 0.5 * found[10 + c]
            force[clamps.nodes[e, 0], c] += moment * (found[1 + c] + carried)
            force[clamps.nodes[e, 1], c] += moment * (found[4 + c] + carried)
            force[clamps.nodes[e, 2], c] += moment * found[7 + c]


@kernel
def clamp_energy(clamps, u):
    """Energy (J) of clamps."""
    energy = 0.0
    for e in range(clamps.rest.size):
        turned = clamp_dihedral(clamps, u, e)[0] - clamps.rest[e]
        energy += 0.5 * clamps.stiffness[e] * turned * turned
    return energy


@kernel
def clamp_blocks(clamps, u):
    """Tangent (c, 3, 3, 3, 3), N/m, of clamps: node, node, axis, axis."""
    out = np.empty((clamps.rest.size, 3, 3, 3, 3))
    points, gradient, block = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3, 4, 3))
    for e in range(clamps.rest.size):
        found = clamp_dihedral(clamps, u, e)
        for c in range(3):
            for v in range(3):
                points[v, c] = clamps.points[e, v, c] + u[clamps.nodes[e, v], c]
            mean = 0.5 * (u[clamps.nodes[e, 0], c] + u[clamps.nodes[e, 1], c])
            points[3, c] = clamps.points[e, 3, c] + mean
            for v in range(4):
                gradient[v, c] = found[1 + 3 * v + c]
        stiffness = clamps.stiffness[e]
        for v in range(4):
            for a in range(3):
                for w in range(4):
                    for b in range(3):
                        block[v, a, w, b] = stiffness * gradient[v, a] * gradient[w, b]
        add_hessian(points, gradient, stiffness * (found[0] - clamps.rest[e]), block)
        carry_wing(block)
        for v in range(3):
            for w in range(3):
                for a in range(3):
                    for b in range(3):
                        out[e, v, w, a, b] = block[v, a, w, b]
    return out


@inner_scalar
def directed_extension(springs, u, s):
    """(u_a - u_b) . d of a directed spring, m."""
    a, b = springs.ends[s, 0], springs.ends[s, 1]
    extension = 0.0
    for c in range(3):
        moved = u[a, c] - (u[b, c] if b >= 0 else 0.0)
        extension += moved * springs.direction[s, c]
    return extension


@inner_scalar
def axial_extension(springs, u, s):
    """l - l0 of an axial spring, and l, m; from displacements, so that nothing cancels."""
    a, b = springs.axial_ends[s, 0], springs.axial_ends[s, 1]
    length, x = springs.length[s], 0.0
    for c in range(3):
        du = u[b, c] - u[a, c]
        x += du * (2.0 * springs.vector[s, c] + du)
    now = math.sqrt(max(length * length + x, 0.0))
    longer = x / (now + length) if now + length > 0.0 else 0.0
    return longer + springs.stretch[s], now


@kernel
def add_spring_forces(springs, u, force):
    """Add the forces of springs to those of the nodes."""
    for s in range(springs.stiffness.size):
        a, b = springs.ends[s, 0], springs.ends[s, 1]
        pull = springs.stiffness[s] * directed_extension(springs, u, s)
        for c in range(3):
            force[a, c] += pull * springs.direction[s, c]
            if b >= 0:
                force[b, c] -= pull * springs.direction[s, c]
    for s in range(springs.axial_stiffness.size):
        a, b = springs.axial_ends[s, 0], springs.axial_ends[s, 1]
        extension, length = axial_extension(springs, u, s)
        per_length = springs.axial_stiffness[s]
        if springs.stretch[s] < springs.length[s]:  # else it is k, also where the ends meet
            per_length *= extension / length
        for c in range(3):
            pull = per_length * (springs.vector[s, c] + u[b, c] - u[a, c])
            force[b, c] += pull
            force[a, c] -= pull


@kernel
def spring_energy(springs, u):
    """Energy (J) of springs."""
    energy = 0.0
    for s in range(springs.stiffness.size):
        extension = directed_extension(springs, u, s)
        energy += 0.5 * springs.stiffness[s] * extension * extension
    for s in range(springs.axial_stiffness.size):
        extension = axial_extension(springs, u, s)[0]
        energy += 0.5 * springs.axial_stiffness[s] * extension * extension
    return energy


@kernel
def axial_blocks(springs, u, loose):
    """Derivative (a, 3, 3), N/m, of the forces of axial springs; `loose`: without their force."""
    out = np.empty((springs.axial_stiffness.size, 3, 3))
    for s in range(springs.axial_stiffness.size):
        a, b = springs.axial_ends[s, 0], springs.axial_ends[s, 1]
        extension, length = axial_extension(springs, u, s)
        across, along = 1.0, 1.0
        if springs.stretch[s] < springs.length[s]:  # else it is k in all directions
            across = 0.0 if loose else extension / length
        for p in range(3):
            x = springs.vector[s, p] + u[b, p] - u[a, p]
            for q in range(3):
                y = springs.vector[s, q] + u[b, q] - u[a, q]
                out[s, p, q] = across if p == q else 0.0
                if across != along:
                    out[s, p, q] += (along - across) * x * y / (length * length)
                out[s, p, q] *= springs.axial_stiffness[s]
    return out


class _ClampsTerm(NamedTuple):
    clamps: Clamps
    angle: NDArray  # (nh + c,) dihedrals of all hinges, theirs at the end
    rows: int


@forces
def _clamp_forces(own, u, v, t, force, powers):
    add_clamp_forces(own.clamps, rows_at(u, own.rows), rows_at(force, own.rows), own.angle)


@energies
def _clamp_energies(own, u, out):
    group = own.clamps.group
    numbers_at(out, group + 1)[group] += clamp_energy(own.clamps, rows_at(u, own.rows))


def clamps_term(clamps: Clamps, angle: NDArray, rows: int) -> Term:
    """Clamped edges; their dihedrals end `angle`."""
    own = Context(_ClampsTerm(clamps, angle, rows))
    return Term(own, {FORCES: _clamp_forces, ENERGIES: _clamp_energies})


class _SpringsTerm(NamedTuple):
    springs: Springs
    group: int  # of the energies
    rows: int


@forces
def _spring_forces(own, u, v, t, force, powers):
    add_spring_forces(own.springs, rows_at(u, own.rows), rows_at(force, own.rows))


@energies
def _spring_energies(own, u, out):
    numbers_at(out, own.group + 1)[own.group] = spring_energy(own.springs, rows_at(u, own.rows))


def springs_term(springs: Springs, group: int, rows: int) -> Term:
    """Springs, with the group of their energy."""
    own = Context(_SpringsTerm(springs, group, rows))
    return Term(own, {FORCES: _spring_forces, ENERGIES: _spring_energies})
