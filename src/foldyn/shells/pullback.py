"""The pullback of a shell (`mechanics.pullback`).

A prime is a rate where the nodes and rotations move by their weights. With the strains E and the
rotations beta of the sides of a triangle, its matrices S and B, and the moments M and angles phi of
the pieces of creases,

    w . F = sum of E'^T S E + sum of beta'^T B beta + sum of M phi'.

A dihedral has therein a moment that multiplies its rate, and one, `back`, that multiplies its
changes; see `mechanics.plates_pullback`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner
from foldyn.jit.context import Context, rows_at
from foldyn.materials.series import series_derivatives
from foldyn.mechanics.dihedral import dihedral_rates
from foldyn.mechanics.pullback import Pulled, pullback
from foldyn.mechanics.term import parted_rows
from foldyn.shells.kernels import (
    ShellModel,
    ShellWork,
    shell_work,
    side_rotations,
    side_strains,
    wing_points,
)


class Gradient(NamedTuple):
    """Derivatives by arrays of `ShellModel` of the same names."""

    per_reach: NDArray  # (1,)
    rest: NDArray
    side: NDArray
    per_length2: NDArray
    membrane: NDArray
    bending: NDArray
    hinge_rest: NDArray
    weight: NDArray
    sign: NDArray
    piece_stiffness: NDArray
    piece_rest: NDArray
    piece_parameters: NDArray


class Back(NamedTuple):
    """Memory of one evaluation, and what it adds to."""

    out: Gradient
    points: NDArray  # (4, 3) of a hinge, m
    moves: NDArray  # (4, 3) weights there
    rate: NDArray  # (nh,) of the dihedrals
    gradient_rate: NDArray  # (nh, 12)
    moment: NDArray  # (nh,) back
    sides: NDArray  # (8, 3) of a triangle, see `pull_triangle`


@inner
def rate_hinges(model, u, w, work, back):
    """Dihedrals, their turns and gradients at u, and their rates where the nodes move by w."""
    x, dx = back.points, back.moves
    for h in range(model.hinges.shape[0]):
        wing_points(model, u, h, x)
        j, k = model.hinges[h, 0], model.hinges[h, 1]
        for v in range(4):
            node = model.hinges[h, v]
            for c in range(3):
                dx[v, c] = w[node, c] if node < model.nodes else 0.5 * (w[j, c] + w[k, c])
        found = dihedral_rates(
            x[0, 0], x[0, 1], x[0, 2], x[1, 0], x[1, 1], x[1, 2],
            x[2, 0], x[2, 1], x[2, 2], x[3, 0], x[3, 1], x[3, 2],
            dx[0, 0], dx[0, 1], dx[0, 2], dx[1, 0], dx[1, 1], dx[1, 2],
            dx[2, 0], dx[2, 1], dx[2, 2], dx[3, 0], dx[3, 1], dx[3, 2],
        )  # fmt: skip
        work.angle[h], work.turn[h] = found[0], found[0] - model.hinge_rest[h]
        back.rate[h], back.moment[h], work.moment[h] = found[13], 0.0, 0.0
        for c in range(12):
            work.gradient[h, c], back.gradient_rate[h, c] = found[1 + c], found[14 + c]


@inner
def pull_triangle(model, u, w, x, y, work, back, product, by_x, t):
    """Add the derivatives for a triangle, and the moments of its dihedrals."""
    e, strained, stress, pulled = back.sides[0], back.sides[1], back.sides[2], back.sides[3]
    beta, turned, moment, resisted = back.sides[4], back.sides[5], back.sides[6], back.sides[7]
    out = back.out
    side_strains(model, u, t, e)
    side_rotations(model, x, work.turn, t, beta)
    side_rotations(model, y, back.rate, t, turned)
    for k in range(3):
        a, b = model.triangles[t, k], model.triangles[t, (k + 1) % 3]
        strained[k] = 0.0  # the rate of half the square of the length
        for c in range(3):
            along = model.side[t, k, c] + u[b, c] - u[a, c]
            strained[k] += along * (w[b, c] - w[a, c])
        stress[k], pulled[k], moment[k], resisted[k] = 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        rate = model.per_length2[t, k] * strained[k]
        for m in range(3):
            stress[k] += model.membrane[t, k, m] * e[m]
            pulled[m] += model.membrane[t, k, m] * rate
            out.membrane[t, k, m] += rate * e[m]
            moment[k] += model.bending[t, k, m] * beta[m]
            resisted[m] += model.bending[t, k, m] * turned[k]
            out.bending[t, k, m] += turned[k] * beta[m]
    for k in range(3):
        a, b = model.triangles[t, k], model.triangles[t, (k + 1) % 3]
        per_length2, square = model.per_length2[t, k], 0.0
        for c in range(3):
            moved, rest = u[b, c] - u[a, c], model.side[t, k, c]
            square += moved * (2.0 * rest + moved)
            by = stress[k] * (w[b, c] - w[a, c]) + pulled[k] * moved
            out.side[t, k, c] += per_length2 * by
            by = per_length2 * (by + pulled[k] * rest)
            product[b, c] += by
            product[a, c] -= by
        out.per_length2[t, k] += stress[k] * strained[k] + 0.5 * pulled[k] * square
        h, rotation = model.hinge[t, k], model.rotation[t, k]
        if h >= 0:
            work.moment[h] += model.weight[t, k] * moment[k]
            back.moment[h] += model.weight[t, k] * resisted[k]
            out.hinge_rest[h] -= model.weight[t, k] * resisted[k]
            out.weight[t, k] += moment[k] * back.rate[h] + resisted[k] * work.turn[h]
        if rotation >= 0:
            by_x[rotation] += model.sign[t, k] * model.per_reach * resisted[k]
            by = moment[k] * y[rotation] + resisted[k] * x[rotation]
            out.sign[t, k] += model.per_reach * by
            out.per_reach[0] += model.sign[t, k] * by


@inner
def pull_pieces(model, x, y, work, back, by_x):
    """The same for all pieces of creases."""
    out, p = back.out, model.piece_parameters
    for k in range(model.piece_hinge.size):
        h, stiffness = model.piece_hinge[k], model.piece_stiffness[k]
        angle, rate = work.angle[h], back.rate[h]
        for rotation in model.piece_rotations[k]:
            if rotation >= 0:
                angle -= model.per_reach * x[rotation]
                rate -= model.per_reach * y[rotation]
        moment, slope, by_rest, by_a, by_b, by_c, _ = series_derivatives(
            model.code, angle, model.piece_rest[k], p[k, 0], p[k, 1], p[k, 2], p[k, 3], 1.0,
            model.addresses,
        )  # fmt: skip
        out.piece_stiffness[k] += moment * rate
        rate *= stiffness
        moment, resisted = stiffness * moment, slope * rate
        work.moment[h] += moment
        back.moment[h] += resisted
        for rotation in model.piece_rotations[k]:
            if rotation >= 0:
                by_x[rotation] -= model.per_reach * resisted
                out.per_reach[0] -= moment * y[rotation] + resisted * x[rotation]
        out.piece_rest[k] += rate * by_rest
        out.piece_parameters[k, 0] += rate * by_a
        out.piece_parameters[k, 1] += rate * by_b
        out.piece_parameters[k, 2] += rate * by_c


@inner
def pull_hinges(model, work, back, product):
    """Add what the nodes and wings of all hinges get."""
    rest = back.out.rest
    for h in range(model.hinges.shape[0]):
        for v in range(4):
            node = model.hinges[h, v]
            for c in range(3):
                by = work.moment[h] * back.gradient_rate[h, 3 * v + c]
                by += back.moment[h] * work.gradient[h, 3 * v + c]
                rest[node, c] += by
                if node < model.nodes:
                    product[node, c] += by
                else:  # a wing rides on the ends of its side
                    product[model.hinges[h, 0], c] += 0.5 * by
                    product[model.hinges[h, 1], c] += 0.5 * by


class _Context(NamedTuple):
    model: ShellModel
    work: ShellWork
    back: Back
    rows: int


@pullback
def _pullback(own, u, v, t, weight, product, rate):
    model, work, back = own.model, own.work, own.back
    n, r = model.nodes, model.rotations
    here, x = parted_rows(rows_at(u, own.rows), n, r)
    w, y = parted_rows(rows_at(weight, own.rows), n, r)
    out, by_x = parted_rows(rows_at(product, own.rows), n, r)
    rate_hinges(model, here, w, work, back)
    for triangle in range(model.triangles.shape[0]):
        pull_triangle(model, here, w, x, y, work, back, out, by_x, triangle)
    pull_pieces(model, x, y, work, back, by_x)
    pull_hinges(model, work, back, out)


def shell_pulled(model: ShellModel) -> Pulled:
    """A shell differentiated."""
    nh = len(model.hinges)
    arrays = (np.zeros_like(getattr(model, name)) for name in Gradient._fields[1:])
    out = Gradient(np.zeros(1), *arrays)
    points, moves = np.zeros((2, 4, 3))
    back = Back(
        out, points, moves, np.zeros(nh), np.zeros((nh, 12)), np.zeros(nh), np.zeros((8, 3))
    )
    own = Context(_Context(model, shell_work(model), back, model.rows))
    gradient = {**out._asdict(), "per_reach": out.per_reach.reshape(())}
    return Pulled(own, _pullback, gradient)
