"""Clamped edges, which hold the tangents of panels.

A *clamp* at an edge j-k is a hinge (j, k, i, wing) with a linear law, whose wing is a virtual point
that follows the mean displacement of j and k. Seen from the edge, the point keeps its direction in
space; translating the edge causes no strain.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.compiled import inner_scalar, kernel
from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.block_matrix import pairs_within, places_of
from foldyn.mechanics.dihedral import add_hessian, carry_wing, dihedral_gradient, rates_at
from foldyn.mechanics.discrete_gradient import discrete_gradient
from foldyn.mechanics.model import ranks
from foldyn.mechanics.pullback import Arrays, Pulled, arrays_of, pullback, zeros_for
from foldyn.mechanics.sheet_term import unit_rows
from foldyn.mechanics.term import (
    ENERGIES,
    FORCES,
    MEAN_FORCES,
    CompiledTerm,
    Strains,
    Term,
    Unstrained,
    energies,
    forces,
    mean_forces,
    nodal,
)

RIDES = -1  # stands for the node of a virtual wing


class Clamps(NamedTuple):
    """Arrays of c clamped edges."""

    nodes: NDArray  # (c, 3) axis j, k and wing i
    points: NDArray  # (c, 4, 3) rest positions of j, k, i and the virtual wing, m
    rest: NDArray  # (c,) rad
    stiffness: NDArray  # (c,) N m/rad
    group: int  # energy group of the model that the clamps belong to


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


class _Backward(NamedTuple):
    clamps: Clamps
    out: Clamps  # gradients
    points: NDArray  # (4, 3) scratch: positions of one clamp, m
    moves: NDArray  # (4, 3) weights of these points
    rows: int  # number of rows up to the last node


@pullback
def _pullback(own, u, v, t, weight, product, rate):
    moved, weights, out = (
        rows_at(u, own.rows), rows_at(weight, own.rows), rows_at(product, own.rows)
    )  # fmt: skip
    clamps, by, x, dx = own.clamps, own.out, own.points, own.moves
    for e in range(clamps.rest.size):
        for c in range(3):
            for n in range(3):
                node = clamps.nodes[e, n]
                x[n, c], dx[n, c] = clamps.points[e, n, c] + moved[node, c], weights[node, c]
            j, k = clamps.nodes[e, 0], clamps.nodes[e, 1]
            x[3, c] = clamps.points[e, 3, c] + 0.5 * (moved[j, c] + moved[k, c])
            dx[3, c] = 0.5 * (weights[j, c] + weights[k, c])
        found = rates_at(x, dx)
        turn, turned = found[0] - clamps.rest[e], clamps.stiffness[e] * found[13]
        by.stiffness[e] += turn * found[13]
        by.rest[e] -= turned
        moment = clamps.stiffness[e] * turn
        for c in range(12):
            flat(x)[c] = moment * found[14 + c] + turned * found[1 + c]
        for c in range(3):
            for n in range(4):
                by.points[e, n, c] += x[n, c]
            for n in range(3):
                carried = 0.5 * x[3, c] if n < 2 else 0.0
                out[clamps.nodes[e, n], c] += x[n, c] + carried


class _Context(NamedTuple):
    clamps: Clamps
    angle: NDArray  # (nh + c,) dihedrals of all hinges, clamps last
    rows: int


@forces
def _forces(own, u, v, t, force, powers):
    clamps, moved, out = own.clamps, rows_at(u, own.rows), rows_at(force, own.rows)
    first = own.angle.size - clamps.rest.size
    for e in range(clamps.rest.size):
        found = clamp_dihedral(clamps, moved, e)
        own.angle[first + e] = found[0]
        moment = clamps.stiffness[e] * (found[0] - clamps.rest[e])
        for c in range(3):
            carried = 0.5 * found[10 + c]
            out[clamps.nodes[e, 0], c] += moment * (found[1 + c] + carried)
            out[clamps.nodes[e, 1], c] += moment * (found[4 + c] + carried)
            out[clamps.nodes[e, 2], c] += moment * found[7 + c]


@energies
def _energies(own, u, out):
    clamps, moved, energy = own.clamps, rows_at(u, own.rows), 0.0
    for e in range(clamps.rest.size):
        turned = clamp_dihedral(clamps, moved, e)[0] - clamps.rest[e]
        energy += 0.5 * clamps.stiffness[e] * turned * turned
    numbers_at(out, clamps.group + 1)[clamps.group] += energy


@mean_forces
def _mean_forces(own, u0, u1, before, h, t, force, powers):
    clamps, angle, began = own.clamps, own.angle, numbers_at(before, own.angle.size)
    start, end, out = rows_at(u0, own.rows), rows_at(u1, own.rows), rows_at(force, own.rows)
    x, dx, points = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3))
    plain, gradient, first = np.empty((4, 3)), np.empty((4, 3)), angle.size - clamps.rest.size
    for e in range(clamps.rest.size):
        for c in range(3):
            x[3, c], dx[3, c] = clamps.points[e, 3, c], 0.0
            for v in range(3):
                one, other = start[clamps.nodes[e, v], c], end[clamps.nodes[e, v], c]
                x[v, c], dx[v, c] = clamps.points[e, v, c] + 0.5 * (one + other), other - one
                if v < 2:
                    x[3, c] += 0.25 * (one + other)
                    dx[3, c] += 0.5 * (other - one)
        angle[first + e] = clamp_dihedral(clamps, end, e)[0]
        turn = angle[first + e] - began[first + e]
        discrete_gradient(x, dx, turn, points, plain, gradient)
        moment = clamps.stiffness[e] * (began[first + e] + 0.5 * turn - clamps.rest[e])
        for c in range(3):
            for v in range(3):
                carried = 0.5 * gradient[3, c] if v < 2 else 0.0
                out[clamps.nodes[e, v], c] += moment * (gradient[v, c] + carried)


class ClampsTerm(Term):
    """Clamped edges as a term; their energy belongs to a group of the sheet.

    Parameters
    ----------
    clamps : Clamps
    """

    of_hinges = True

    def __init__(self, clamps: Clamps) -> None:
        self.clamps = clamps

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """Kernels for a thread; the clamps' dihedrals are last in its angles. See `Term`."""
        own = Context(_Context(self.clamps, part.angle, int(part.own[1])))
        return CompiledTerm(own, {FORCES: _forces, ENERGIES: _energies, MEAN_FORCES: _mean_forces})

    def arrays(self) -> Arrays:
        """Arrays that the term's forces depend on; see `Term`."""
        return arrays_of(self.clamps)

    def pulled(self) -> Pulled:
        """Pullback of the term's forces; see `Term`."""
        out = zeros_for(self.clamps)
        points, moves = np.zeros((2, 4, 3))
        rows = 1 + int(self.clamps.nodes.max(initial=0))
        own = Context(_Backward(self.clamps, out, points, moves, rows))
        return Pulled(own, _pullback, arrays_of(out).numbers)

    @cached_property
    def places(self) -> tuple[NDArray, NDArray]:
        """Rows and columns (k,) of the term's tangent entries; see `Term`."""
        return places_of(pairs_within(self.clamps.nodes))

    def entries(self, q: NDArray, floor: float = -np.inf) -> NDArray:
        """Tangent entries (k,), N/m; see `Term`."""
        return clamp_blocks(self.clamps, nodal(q)).ravel()

    def unstrained(self, q: NDArray) -> Unstrained:
        """The model without strain at q; see `Term`."""
        tangent = self.nominal(q).tangent(q)
        return Unstrained(tangent, tangent, lambda motion: 0.0)

    @property
    def hinges(self) -> NDArray:
        """Rows (nh, 4) of the term's hinges; see `Term`."""
        own = self.clamps.nodes
        return np.column_stack([own, np.full(len(own), RIDES)])

    def angles(self, q: NDArray) -> NDArray:
        """Dihedrals (nh,) of the term's hinges, rad; see `Term`."""
        return clamp_angles(self.clamps, nodal(q))[0]

    def holds(self, q: NDArray) -> sparse.csr_array:
        """Internal constraints: clamps hold their dihedrals. See `Term`."""
        return unit_rows(self.clamps.nodes, clamp_angles(self.clamps, nodal(q))[1], q.size)

    def turning_moments(self) -> float:
        """Sum of the moments of the term's hinges (N m) for a unit turn; see `Term`."""
        return float(self.clamps.stiffness.sum())

    def strains(self, others: Strains) -> Strains:
        """Strains with clamps; a wing repeats the first axis node (`viscous.hinge_gradient`)."""
        clamps = self.clamps
        return others._replace(
            hinges=np.concatenate([others.hinges, clamps.nodes[:, [0, 1, 2, 0]]]),
            corners=np.concatenate([others.corners, clamps.points]),
            hinge_stiffness=np.concatenate([others.hinge_stiffness, clamps.stiffness]),
        )

    def placed(self, order: NDArray, before: Any) -> ClampsTerm:
        """The term with nodes in memory order; see `Term`."""
        return ClampsTerm(self.clamps._replace(nodes=ranks(order)[self.clamps.nodes]))

    def nominal(self, q: NDArray) -> ClampsTerm:
        """The model at nominal stiffness, about its state at q; see `Term`."""
        return ClampsTerm(self.clamps._replace(rest=self.angles(q)))
