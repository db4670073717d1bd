"""Bars, folds and plates: panels whose bends are coupled, and which give way at their edges.

A plate has angles phi: the turns of its hinges from rest, and rotations beta of its edges relative
to the facets there. Its energy is 1/2 phi^T K phi. A fold is a hinge between two plates; its angle
is the dihedral of the facets minus the two adjacent rotations. At a clamped edge the sheet keeps
its direction in space: the angle of the plate is the angle between its facet and the facet's mirror
image at rest. The last point of this hinge is no node but follows the mean displacement of the ends
of the edge: translating the edge causes no strain.

Rotations are massless dofs in addition to the displacements u (n, 3). The dofs x (r,) of rotations
are lengths, too (m), so that norms over all dofs do not depend on the unit of length: beta is x
times `per_reach`.

Explicit methods give these dofs an inertia. For them the dofs z of the two rotations beside a fold
are y and d,

    x_1 = (turn - y) / 2 + d,    x_2 = (turn - y) / 2 - d,

with `turn` the turn of the dihedral from its value without displacements, over `per_reach`; of a
single rotation, x = turn - y. Then `per_reach` y is the turn of the fold itself: what makes a
crease stiff, or damps it, acts on one dof alone, and does not make the others heavy.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.jit.context import Context, numbers_at, rows_at, run_at
from foldyn.jit.intrinsics import flat
from foldyn.materials.switch import hinge_energy, hinge_moment, hinge_slope
from foldyn.mechanics.bars_hinges import ALL, bars_hinges_kernels
from foldyn.mechanics.discrete_gradient import discrete_gradient, mean_moment, put_motion
from foldyn.mechanics.force import (
    ForceScratch,
    force_scratch,
    gather,
    put_dihedral,
    scatter,
    whole_lanes,
)
from foldyn.mechanics.model import BLOCK, BarsHinges
from foldyn.mechanics.term import (
    ENERGIES,
    FORCES,
    MEAN_FORCES,
    CompiledTerm,
    energies,
    forces,
    mean_forces,
    parted_rows,
)
from foldyn.mechanics.threads import Team, team

RIDES = -1  # stands for the node of a virtual wing


class BarsPlates(NamedTuple):
    """Arrays of n nodes with bars, nf folds, nb bends and p plates of nq angles in all.

    The last c bends are clamped edges: their hinges have the first end of the edge in place of a
    wing.
    """

    bars: BarsHinges  # without hinges
    rotations: int  # r
    per_reach: float  # rotation (rad) of a dof of 1 m, 1/m
    rotation_hinge: NDArray  # (r,) row in `hinges` of each rotation's edge
    hinges: NDArray  # (nf + nb, 4) of the folds, then of the bends
    wings: NDArray  # (c, 3) virtual wings of clamped edges, from the edge's middle, m
    fold_rotations: NDArray  # (nf, 2) rotations on both sides of each fold, or -1
    fold_ways: NDArray  # (nf, 2) 1, or -1 for rotations that open the fold, as at junctions
    unmoved: NDArray  # (nf,) dihedrals at rest, rad, if dofs are turns of folds; or (0,)
    fold_stiffness: NDArray  # (nf,) N m/rad
    fold_rest: NDArray  # (nf,) rad
    fold_parameters: NDArray  # (nf, 4)
    code: NDArray  # (nf,) code of each fold's law
    addresses: NDArray  # (nf, 3) addresses of users' laws
    bend_rest: NDArray  # (nb,) rad
    start: NDArray  # (p + 1,) first angle of each plate
    angle: NDArray  # (nq,) row in `hinges`, or -1 - number of a rotation
    entry: NDArray  # (p + 1,) first entry of each plate's matrix
    stiffness: NDArray  # entries of the matrices, N m/rad

    @property
    def nodes(self) -> int:
        """Number of the nodes."""
        return len(self.bars.rest)

    @property
    def rows(self) -> int:
        """Rows of three that hold displacements and then rotations, the last row padded."""
        return self.nodes + -(-self.rotations // 3)


class PlatesScratch(NamedTuple):
    """Scratch of one evaluation; nh = nf + nb."""

    bars: ForceScratch
    corners: NDArray  # (4 nh,) nodes of the hinges, uint32: signed would be tested for wraparound
    position: NDArray  # (4 n,) rows of four load as vectors
    sums: NDArray  # (4 n,) forces of hinges
    points: NDArray  # (12 * BLOCK,) of a block of hinges
    found: NDArray  # (13 * BLOCK,) for each block: gradients and, in the last row, angles
    angle: NDArray  # (nh,) dihedrals, rad
    gradient: NDArray  # (nh, 12) the same gradients, if `put_gradients` has put them there
    moment: NDArray  # (nh,) N m
    fold_angle: NDArray  # (nf,) rad
    x: NDArray  # (r,) rotations, m
    turn: NDArray  # (the most angles of a plate,) rad
    own: NDArray  # (2,) first and last + 1 of the rows
    team: Team


def plates_scratch(model: BarsPlates) -> PlatesScratch:
    """Scratch for `model`."""
    nh, nf = len(model.hinges), len(model.fold_rest)
    most, blocks = int(np.diff(model.start).max(initial=0)), -(-nh // BLOCK)
    corners = np.ascontiguousarray(model.hinges, np.uint32).ravel()
    return PlatesScratch(
        force_scratch(model.bars), corners, np.zeros(4 * model.nodes), np.zeros(4 * model.nodes),
        np.ones(12 * BLOCK), np.zeros(13 * BLOCK * blocks), np.zeros(nh),
        np.zeros((nh, 12)), np.zeros(nh), np.zeros(nf), np.zeros(model.rotations),
        np.zeros(most), np.array([0, model.rows]), team(1)[0],
    )  # fmt: skip


@kernel
def turn_hinges(model, u, scratch):
    """Dihedrals and their gradients at displacements u, in blocks of hinges."""
    x, p, rest, position = scratch.points, np.empty((4, 3)), model.bars.rest, scratch.position
    for i in range(rest.shape[0]):
        for c in range(3):
            position[4 * i + c] = rest[i, c] + u[i, c]
    for first in range(0, model.hinges.shape[0], BLOCK):
        m = min(BLOCK, model.hinges.shape[0] - first)
        g = scratch.found[13 * first : 13 * (first + BLOCK)]
        for v in range(4):
            gather(position, ALL, scratch.corners, 4, v, first, m, x, 3 * v * BLOCK)
        for q in range(ridden(model, first), m):
            put_points(model, u, first + q, p)
            for c in range(12):
                x[c * BLOCK + q] = flat(p)[c]
        for q in range(whole_lanes(m)):
            put_dihedral(x, q, g)
        for q in range(m):
            scratch.angle[first + q] = g[12 * BLOCK + q]
        for q in range(ridden(model, first), m):
            carry(g, q, BLOCK)


@kernel
def put_gradients(model, scratch):
    """Put the gradients of all hinges into `scratch.gradient`, after `turn_hinges`."""
    for h in range(model.hinges.shape[0]):
        first = h // BLOCK * BLOCK
        for c in range(12):
            scratch.gradient[h, c] = scratch.found[13 * first + c * BLOCK + h - first]


@inner_scalar
def rides(model, h):
    """Whether hinge h is a clamped edge."""
    return h >= model.hinges.shape[0] - model.wings.shape[0]


@inner_scalar
def ridden(model, first):
    """Number of the first clamped edge in the block of hinges from `first` on."""
    return max(0, model.hinges.shape[0] - model.wings.shape[0] - first)


@inner_scalar
def ride(model, h, share, points):
    """If hinge h is a clamped edge, move the wing in `points` (4, 3) along with the edge's ends.

    share : 1 for positions, 0 for differences of positions.
    """
    if rides(model, h):
        e = h - model.hinges.shape[0] + model.wings.shape[0]
        for c in range(3):
            middle = 0.5 * (points[0, c] + points[1, c])
            points[3, c] = middle + share * model.wings[e, c]


@inner_scalar
def put_points(model, u, h, points):
    """Put the positions (4, 3) of the points of hinge h at displacements u to `points`."""
    for v in range(4):
        node = model.hinges[h, v]
        for c in range(3):
            points[v, c] = model.bars.rest[node, c] + u[node, c]
    ride(model, h, 1.0, points)


@inner_scalar
def carry(gradient, at, stride):
    """Distribute the gradient of a clamped edge's wing to both ends, half each.

    The first end takes the place of the wing in `hinges`, so its half stays there. Entries of the
    flat gradient are `stride` apart, from `at` on.
    """
    for c in range(3):
        gradient[at + (9 + c) * stride] *= 0.5
        gradient[at + (3 + c) * stride] += gradient[at + (9 + c) * stride]


@inner
def put_rotations(model, z, share, angle, out):
    """Put rotations (r,) into `out`, for dofs z and dihedrals `angle`; or rates, with share 0.

    share : factor of the dihedrals without displacements.
    """
    for k in range(out.size):
        out[k] = z[k]
    for f in range(model.unmoved.size):
        put_rotations_beside(model, f, z, share, angle, out)


@inner_scalar
def put_rotations_beside(model, f, z, share, angle, out):
    """Put the rotations beside fold f into `out`; see `put_rotations`."""
    one, other = model.fold_rotations[f, 0], model.fold_rotations[f, 1]
    turn = (angle[f] - share * model.unmoved[f]) / model.per_reach
    if one >= 0 and other >= 0:
        half = 0.5 * (turn - z[one])
        out[one], out[other] = half + z[other], half - z[other]
    elif one >= 0 or other >= 0:
        only = max(one, other)
        out[only] = turn - z[only]


@kernel
def hand_over(model, couple, moment):
    """Turn forces on rotations into those on dofs, in place; the rest adds to moments of hinges."""
    for f in range(model.unmoved.size):
        moment[f] += hand_over_beside(model, f, couple)


@inner_scalar
def hand_over_beside(model, f, couple):
    """Turn forces on the rotations beside fold f into those on dofs; returns its moment, N m."""
    one, other = model.fold_rotations[f, 0], model.fold_rotations[f, 1]
    if one >= 0 and other >= 0:
        half, apart = 0.5 * (couple[one] + couple[other]), couple[one] - couple[other]
        couple[one], couple[other] = -half, apart
        return half / model.per_reach
    if one >= 0 or other >= 0:
        only = max(one, other)
        couple[only] = -couple[only]
        return -couple[only] / model.per_reach
    return 0.0


def handed_over(model: BarsPlates, push: NDArray) -> tuple[NDArray, NDArray]:
    """Moments (nf,), N m, on folds, and forces (k,), N, on dofs, of forces (k,) on rotations."""
    moment, handed = np.zeros(len(model.fold_rest)), np.zeros(model.rotations)
    handed[: len(push)] = push
    hand_over(Context(model), handed, moment)
    return moment, handed[: len(push)]


@kernel
def turn_folds(model, x, scratch):
    """Angles of the folds with rotations x."""
    for f in range(model.fold_rest.size):
        scratch.fold_angle[f] = turned_fold(model, f, x, scratch.angle)


@inner_scalar
def turned_fold(model, f, x, angle):
    """Angle (rad) of fold f with rotations x, for dihedrals `angle`."""
    out = angle[f]
    for side in range(2):
        rotation = model.fold_rotations[f, side]
        if rotation >= 0:
            turn = model.per_reach * x[rotation]
            out -= model.fold_ways[f, side] * turn
    return out


@kernel
def _turn_folds_by(model, z, scratch):
    put_rotations(model, z, 1.0, scratch.angle, scratch.x)
    turn_folds(model, scratch.x, scratch)


def turned_plates(model: BarsPlates, u: NDArray, z: NDArray | None = None) -> PlatesScratch:
    """Dihedrals and gradients at displacements u (n, 3); rotations and angles of folds for z."""
    return turned_contexts(model, u, z)[1].value


def turned_contexts(
    model: BarsPlates, u: NDArray, z: NDArray | None = None
) -> tuple[Context, Context]:
    """Contexts of the model and of `turned_plates`."""
    own, room = Context(model), Context(plates_scratch(model))  # one version of each kernel
    turn_hinges(own, u, room)
    put_gradients(own, room)
    if z is not None:
        _turn_folds_by(own, z, room)
    return own, room


@inner
def turn_plate(model, angle, share, x, p, out):
    """Put angles phi of plate p, for dihedrals `angle` and rotations x, into `out`; or rates.

    share : factor of the dihedrals at rest, 0 for rates.
    """
    for k in range(model.start[p + 1] - model.start[p]):
        out[k] = plate_angle(model, model.start[p] + k, angle, share, x)


@inner_scalar
def plate_angle(model, k, angle, share, x):
    """Angle k of all plates, rad; see `turn_plate`."""
    h = model.angle[k]
    if h >= 0:
        return angle[h] - share * model.bend_rest[h - model.fold_rest.size]
    return model.per_reach * x[-1 - h]


@inner
def fold_energy(model, f, angle):
    """Energy (J) of fold f at its angle."""
    rest, p = model.fold_rest[f], model.fold_parameters
    return model.fold_stiffness[f] * hinge_energy(
        model.code[f], angle, rest, p[f, 0], p[f, 1], p[f, 2], p[f, 3], model.addresses[f, 0],
    )  # fmt: skip


@inner
def fold_moment(model, f, angle):
    """Moment (N m) of fold f at its angle."""
    rest, p = model.fold_rest[f], model.fold_parameters
    return model.fold_stiffness[f] * hinge_moment(
        model.code[f], angle, rest, p[f, 0], p[f, 1], p[f, 2], p[f, 3], model.addresses[f, 1],
    )  # fmt: skip


@inner
def fold_slope(model, f, angle):
    """Slope of the moment of fold f at its angle, per unit of its stiffness."""
    rest, p = model.fold_rest[f], model.fold_parameters
    return hinge_slope(
        model.code[f], angle, rest, p[f, 0], p[f, 1], p[f, 2], p[f, 3], model.addresses[f, 2],
    )  # fmt: skip


class Bars(NamedTuple):
    """The kernels of the bars, called by address: a model without bars does not compile them."""

    context: NDArray  # slots of their context
    kernels: NDArray  # (3,) addresses of `FORCES`, `ENERGIES` and `MEAN_FORCES`, 0 without bars
    first: bool  # whether the term comes first, and overwrites forces and energies


def bars_of(model: BarsPlates, scratch: PlatesScratch, first: bool) -> Bars:
    """The kernels of the bars, with scratch of the plates."""
    term = bars_hinges_kernels(model.bars, scratch.bars, 3)
    kernels = np.zeros(3, np.int64)
    if len(model.bars.bar_runs):
        kernels[:] = [term.kernels[k].at(term.context) for k in (FORCES, ENERGIES, MEAN_FORCES)]
    return Bars(term.context.slots, kernels, first)


@inner_scalar
def put_bar_forces(bars, u, force):
    """Write the forces (n, 3) of the bars."""
    if bars.kernels[0] != 0:
        run_at(bars.kernels[0], (bars.context, u, u, 0.0, force, force))
    elif bars.first:
        for k in range(force.size):
            flat(force)[k] = 0.0


@inner
def plates_energy(model, bars, u, z, scratch, out):
    """Energies (J) of bars, folds and bends, to out (3,)."""
    out[0], out[1], out[2] = 0.0, 0.0, 0.0
    if bars.kernels[1] != 0:
        run_at(bars.kernels[1], (bars.context, u, out))
    turn_hinges(model, u, scratch)
    put_rotations(model, z, 1.0, scratch.angle, scratch.x)
    turn_folds(model, scratch.x, scratch)
    for f in range(model.fold_rest.size):
        out[1] += fold_energy(model, f, scratch.fold_angle[f])
    for plate in range(model.start.size - 1):
        turn_plate(model, scratch.angle, 1.0, scratch.x, plate, scratch.turn)
        count = model.start[plate + 1] - model.start[plate]
        for k in range(count):
            for m in range(count):
                stiff = model.stiffness[model.entry[plate] + k * count + m]
                out[2] += 0.5 * scratch.turn[k] * stiff * scratch.turn[m]


@inner
def plates_force(model, bars, u, z, force, couple, scratch):
    """Internal forces on nodes (n, 3), and on the dofs of rotations (r,), N."""
    put_bar_forces(bars, u, force)
    turn_hinges(model, u, scratch)
    put_rotations(model, z, 1.0, scratch.angle, scratch.x)
    turn_moments(model, scratch.x, couple, scratch)
    hand_over(model, couple, scratch.moment)
    add_hinge_moments(model, scratch, force)


@inner
def add_hinge_moments(model, scratch, force):
    """Add the forces (n, 3) of the moments of all hinges."""
    sums = scratch.sums
    sums[:] = 0.0
    for first in range(0, model.hinges.shape[0], BLOCK):
        m = min(BLOCK, model.hinges.shape[0] - first)
        g = scratch.found[13 * first : 13 * (first + BLOCK)]
        for v in range(4):
            at = 3 * v * BLOCK
            scatter(sums, ALL, scratch.corners, 4, v, first, m, g, at, scratch.moment, first)
    for i in range(force.shape[0]):
        for c in range(3):
            force[i, c] += sums[4 * i + c]


@inner
def turn_moments(model, x, couple, scratch):
    """Moments of all hinges, and forces (r,) on rotations, at known dihedrals."""
    turn_folds(model, x, scratch)
    couple[:] = 0.0
    scratch.moment[:] = 0.0
    for f in range(model.fold_rest.size):
        scratch.moment[f] = fold_moment(model, f, scratch.fold_angle[f])
        turn_rotations_beside(model, f, scratch.moment[f], couple)
    for p in range(model.start.size - 1):
        turn_plate(model, scratch.angle, 1.0, x, p, scratch.turn)
        add_plate_moments(model, couple, scratch, p)


@inner_scalar
def turn_rotations_beside(model, f, moment, couple):
    """Add the forces of the moment of fold f on the rotations beside it."""
    for side in range(2):
        rotation = model.fold_rotations[f, side]
        if rotation >= 0:
            couple[rotation] -= model.fold_ways[f, side] * model.per_reach * moment


@inner
def add_plate_moments(model, couple, scratch, p):
    """Add the moments of plate p at its angles, and its forces on the dofs of rotations."""
    count = model.start[p + 1] - model.start[p]
    for k in range(count):
        moment = 0.0
        for m in range(count):
            moment += model.stiffness[model.entry[p] + k * count + m] * scratch.turn[m]
        h = model.angle[model.start[p] + k]
        if h >= 0:
            scratch.moment[h] += moment  # a weld adds the moments of two plates
        else:
            couple[-1 - h] += model.per_reach * moment


class _Context(NamedTuple):
    model: BarsPlates
    bars: Bars
    scratch: PlatesScratch
    rows: int
    groups: NDArray  # (3,) energy groups of bars, folds and bends
    energy: NDArray  # (3,) energies of bars, folds and bends, J
    place: int  # index of the first hinge among those of all terms


@forces
def _forces(own, u, v, t, force, powers):
    model, moved, out = own.model, rows_at(u, own.rows), rows_at(force, own.rows)
    n, r = model.bars.rest.shape[0], model.rotations
    for k in range(3 * n + r, out.size):
        flat(out)[k] = 0.0
    (here, x), (pull, couple) = parted_rows(moved, n, r), parted_rows(out, n, r)
    plates_force(model, own.bars, here, x, pull, couple, own.scratch)


@energies
def _energies(own, u, out):
    model, moved = own.model, rows_at(u, own.rows)
    n, r = model.bars.rest.shape[0], model.rotations
    here, x = parted_rows(moved, n, r)
    plates_energy(model, own.bars, here, x, own.scratch, own.energy)
    for k in range(3):
        group = own.groups[k]
        before = 0.0 if own.bars.first else numbers_at(out, 3)[group]
        numbers_at(out, 3)[group] = before + own.energy[k]


@mean_forces
def _mean_forces(own, u0, u1, before, h, t, force, powers):
    model, scratch, first = own.model, own.scratch, np.empty(own.scratch.turn.size)
    n, r = model.bars.rest.shape[0], model.rotations
    began = numbers_at(before, own.place + scratch.angle.size)[own.place :]
    start, x0 = parted_rows(rows_at(u0, own.rows), n, r)
    end, x1 = parted_rows(rows_at(u1, own.rows), n, r)
    out, couple = parted_rows(rows_at(force, own.rows), n, r)
    if own.bars.kernels[2] != 0:
        run_at(own.bars.kernels[2], (own.bars.context, start, end, before, h, t, out, powers))
    turn_hinges(model, end, scratch)
    turn_folds(model, x1, scratch)
    scratch.moment[:] = 0.0
    for f in range(model.fold_rest.size):
        angle = turned_fold(model, f, x0, began)
        scratch.moment[f] = model.fold_stiffness[f] * mean_moment(
            model.code[f], model.addresses[f], model.fold_parameters[f], 1.0, model.fold_rest[f],
            angle, scratch.fold_angle[f] - angle,
        )[0]  # fmt: skip
        turn_rotations_beside(model, f, scratch.moment[f], couple)
    for p in range(model.start.size - 1):
        turn_plate(model, began, 1.0, x0, p, first)
        turn_plate(model, scratch.angle, 1.0, x1, p, scratch.turn)
        for k in range(first.size):
            scratch.turn[k] = 0.5 * (first[k] + scratch.turn[k])
        add_plate_moments(model, couple, scratch, p)
    x, dx, points = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3))
    plain, gradient = np.empty((4, 3)), np.empty((4, 3))
    for hinge in range(model.hinges.shape[0]):
        put_motion(model.bars.rest, model.hinges, hinge, start, end, x, dx)
        ride(model, hinge, 1.0, x)
        ride(model, hinge, 0.0, dx)
        discrete_gradient(x, dx, scratch.angle[hinge] - began[hinge], points, plain, gradient)
        at = 13 * (hinge // BLOCK * BLOCK) + hinge % BLOCK
        for c in range(12):
            scratch.found[at + c * BLOCK] = flat(gradient)[c]
        if rides(model, hinge):
            carry(scratch.found, at, BLOCK)
    add_hinge_moments(model, scratch, out)


def plates_kernels(
    model: BarsPlates, scratch: PlatesScratch, rows: int, groups: tuple[int, int, int],
    place: int | None = None,
) -> CompiledTerm:  # fmt: skip
    """Kernels of bars, folds and plates with dofs in `rows` rows, and their energy groups.

    place : index of the first hinge among those of all terms, for a term that is not the first.
    """
    bars = bars_of(model, scratch, place is None)
    own = Context(_Context(model, bars, scratch, rows, np.array(groups), np.zeros(3), place or 0))
    return CompiledTerm(own, {FORCES: _forces, ENERGIES: _energies, MEAN_FORCES: _mean_forces})
