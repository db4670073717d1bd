"""Panels that bend as plates, on the GPU, in two halves with a barrier between them.

Each thread first has some hinges: it writes their dihedrals, the rotations beside folds, and the
gradients of dihedrals to slots. With all of these known, it multiplies the gradients of its hinges
by their moments, and finds the forces on rotations.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from foldyn.dynamics.gpu.elements import put
from foldyn.dynamics.gpu.ported import on_device, ported
from foldyn.mechanics import dihedral, plates
from foldyn.mechanics.plates import BarsPlates

gradient_at, rides, carry = map(ported, (dihedral.gradient_at, plates.rides, plates.carry))
put_points, plate_angle = ported(plates.put_points), ported(plates.plate_angle)
put_rotations_beside = ported(plates.put_rotations_beside)
turn_rotations_beside = ported(plates.turn_rotations_beside)
hand_over_beside, turned_fold = ported(plates.hand_over_beside), ported(plates.turned_fold)
fold_energy, fold_moment = ported(plates.fold_energy), ported(plates.fold_moment)


class Plates(NamedTuple):
    """Plates of m models; nh hinges, and h dofs in the rows after those of nodes."""

    model: BarsPlates  # without bars; numbers with a leading axis of m, or of 1 if all are equal
    per_reach: Any  # (m,)
    first: Any  # (nh + h + 1,) first angle of each hinge, then of each dof, in `angle`
    angle: Any  # (nq,) angles of the plates, in the order of hinges and dofs
    plate: Any  # (nq,) plate of each of them
    alone: Any  # (k,) dofs that are not beside a fold


class Rest(NamedTuple):
    """Nodes at rest, in place of the bars of a `BarsPlates`."""

    rest: Any  # (n, 3)


@on_device
def hinges_of_plates_to(
    own, alone, u, z, slot, size, at_slot, who, crowd, looks, angle, turned, x, points, g
):
    """Write dihedrals, rotations and gradients; return the number of hinges that have passed."""
    count, jumped = own.hinges.shape[0], 0
    for h in range(who, count, crowd):
        put_points(own, u, h, points)
        found = gradient_at(points)
        for c in range(12):
            g[c] = found[1 + c]
        if rides(own, h):
            carry(g, 0, 1)
        for v in range(4):
            put(slot, size, at_slot + v * count + h, g[3 * v], g[3 * v + 1], g[3 * v + 2])
        turned[h] = found[0]
        if h < own.unmoved.shape[0]:
            put_rotations_beside(own, h, z, 1.0, turned, x)
        if looks:
            jumped += abs(found[0] - angle[h]) > math.pi
            angle[h] = found[0]
    for i in range(who, alone.shape[0], crowd):
        x[alone[i]] = z[alone[i]]
    return jumped


@on_device
def moment_of_plates(own, table, turned, x, item, sampled, strain):
    """Moment of plates at a hinge, or on a rotation, N m; adds the energy at a sample."""
    total = 0.0
    for i in range(table.first[item], table.first[item + 1]):
        k, p = table.angle[i], table.plate[i]
        first, moment = own.start[p], 0.0
        count = own.start[p + 1] - first
        row = own.entry[p] + (k - first) * count
        for j in range(count):
            moment += own.stiffness[row + j] * plate_angle(own, first + j, turned, 1.0, x)
        if sampled:
            strain[2] += 0.5 * moment * plate_angle(own, k, turned, 1.0, x)
        total += moment
    return total


@on_device
def moments_to(own, table, slot, size, at_slot, who, crowd, sampled, turned, x, couple, strain):
    """Turn gradients into forces of hinges; write the forces on dofs of rotations to `couple`."""
    count = own.hinges.shape[0]
    for h in range(who, count, crowd):
        moment = moment_of_plates(own, table, turned, x, h, sampled, strain)
        if h < own.fold_rest.shape[0]:
            theta = turned_fold(own, h, x, turned)
            crease = fold_moment(own, h, theta)
            if sampled:
                strain[1] += fold_energy(own, h, theta)
            for side in range(2):
                k = own.fold_rotations[h, side]
                if k >= 0:
                    plate = moment_of_plates(own, table, turned, x, count + k, sampled, strain)
                    couple[k] = own.per_reach * plate
            turn_rotations_beside(own, h, crease, couple)
            moment += crease + hand_over_beside(own, h, couple)
        for v in range(4):
            k = at_slot + v * count + h
            x_, y, z = slot[k], slot[size + k], slot[2 * size + k]
            put(slot, size, k, moment * x_, moment * y, moment * z)
    for i in range(who, table.alone.shape[0], crowd):
        plate = moment_of_plates(own, table, turned, x, count + table.alone[i], sampled, strain)
        couple[table.alone[i]] = own.per_reach * plate
