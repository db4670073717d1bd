"""Forces of many models of one topology at once: the lanes of a vector are models.

Every number of a node or an element stands in memory as WIDTH numbers in a row, one of each model.
Nothing has to be gathered from scattered places then; the formulas are those of `mechanics.force`,
of one element of WIDTH models at once, from load to sum in registers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner, inner_scalar
from foldyn.jit.eights import any_of, eight, put
from foldyn.jit.intrinsics import LINE
from foldyn.materials import ogden, superlinear
from foldyn.materials.enhanced_linear import AS_PUBLISHED, STRESS_FREE
from foldyn.materials.linear import CODE as LINEAR
from foldyn.materials.series import series_energy, series_moment
from foldyn.materials.switch import bar_energy, bar_stress
from foldyn.mechanics.dihedral import dihedral_gradient
from foldyn.mechanics.model import BarsHinges

WIDTH = 8  # models side by side


class Topology(NamedTuple):
    """What the models share, flat."""

    bars: NDArray  # (2 nb,) uint32
    bar_runs: NDArray  # (rb, 4)
    hinges: NDArray  # (4 nh,) uint32
    hinge_runs: NDArray  # (rh, 4)
    hinge_group: NDArray  # (nh,)
    addresses: NDArray  # (na, 3) zero: users' laws are computed one by one


class Lanes(NamedTuple):
    """What tells WIDTH models apart: so many numbers for each of n nodes, nb bars, nh hinges."""

    rest: NDArray  # (3 n WIDTH,) m
    bar_vector: NDArray  # (3 nb WIDTH,) m
    bar_per_length2: NDArray  # (nb WIDTH,)
    bar_stiffness: NDArray  # N/m
    hinge_stiffness: NDArray  # (nh WIDTH,) N m/rad
    hinge_rest: NDArray  # rad
    hinge_share: NDArray
    hinge_parameters: NDArray  # (4, nh WIDTH)


def topology(model: BarsHinges) -> Topology:
    """What a model shares with those beside it."""
    return Topology(
        model.bars.ravel(), model.bar_runs, model.hinges.ravel(), model.hinge_runs,
        model.hinge_group, model.addresses,
    )  # fmt: skip


def side_by_side(arrays: Sequence[NDArray]) -> NDArray:
    """Arrays of equal shapes, of WIDTH models, as one flat array from the start of a cache line."""
    room = np.empty(sum(array.size for array in arrays) + WIDTH)
    out = room[-room.ctypes.data % LINE // room.itemsize :][: room.size - WIDTH]
    np.stack(arrays, axis=-1, out=out.reshape(*arrays[0].shape, len(arrays)))
    return out


def lanes(models: Sequence[BarsHinges]) -> Lanes:
    """The numbers of WIDTH models."""
    columns = (
        "rest", "bar_vector", "bar_per_length2", "bar_stiffness", "hinge_stiffness", "hinge_rest",
        "hinge_share",
    )  # fmt: skip
    parameters = side_by_side([model.hinge_parameters.T for model in models])
    numbers = [side_by_side([getattr(model, name) for model in models]) for name in columns]
    return Lanes._make([*numbers, parameters.reshape(4, -1)])


@inner_scalar
def take(array, row):
    """Three eights of a node or an element."""
    at = 3 * WIDTH * np.int64(row)
    return eight(array, at), eight(array, at + WIDTH), eight(array, at + 2 * WIDTH)


@inner_scalar
def add(array, row, x, y, z):
    """Add three eights to those of a node."""
    at = 3 * WIDTH * np.int64(row)
    put(array, at, eight(array, at) + x)
    put(array, at + WIDTH, eight(array, at + WIDTH) + y)
    put(array, at + 2 * WIDTH, eight(array, at + 2 * WIDTH) + z)


@inner
def add_bar_lanes(topology, own, u, force, value):
    """Add the forces of the bars at u to `force`, both (3 n WIDTH,); value (WIDTH,) is scratch."""
    bars = topology.bars
    for run in range(topology.bar_runs.shape[0]):
        code = topology.bar_runs[run, 2]
        for e in range(topology.bar_runs[run, 0], topology.bar_runs[run, 1]):
            one, other = bars[2 * e], bars[2 * e + 1]
            x1, y1, z1 = take(u, one)
            x2, y2, z2 = take(u, other)
            vx, vy, vz = take(own.bar_vector, e)
            dx, dy, dz = x2 - x1, y2 - y1, z2 - z1
            at = e * WIDTH
            excess = eight(own.bar_per_length2, at) * (
                dx * (2.0 * vx + dx) + dy * (2.0 * vy + dy) + dz * (2.0 * vz + dz)
            )
            if code == ogden.CODE:
                s = ogden.stress_of_excess(excess)
            else:
                put(value, 0, excess / (1.0 + math.sqrt(1.0 + excess)))
                for q in range(WIDTH):
                    value[q] = bar_stress(code, value[q], 0)
                s = eight(value, 0)
            s = s * eight(own.bar_stiffness, at)
            fx, fy, fz = s * (vx + dx), s * (vy + dy), s * (vz + dz)
            add(force, one, -fx, -fy, -fz)
            add(force, other, fx, fy, fz)


@inner
def add_hinge_lanes(topology, own, position, force, value, angles, before, hinge):
    """Add the forces of the hinges at the positions to `force`, both (3 n WIDTH,).

    The angles of the last evaluation, which are updated, tell whether a hinge has passed through 0
    or 360 degrees: returned. Of each model the first such hinge and its angle before are then
    noted. value (WIDTH,) is scratch.
    """
    hinges, p, passed = topology.hinges, own.hinge_parameters, False
    for run in range(topology.hinge_runs.shape[0]):
        code, address = topology.hinge_runs[run, 2], topology.addresses[topology.hinge_runs[run, 3]]
        for e in range(topology.hinge_runs[run, 0], topology.hinge_runs[run, 1]):
            j, k, i, l = hinges[4 * e], hinges[4 * e + 1], hinges[4 * e + 2], hinges[4 * e + 3]  # noqa: E741
            jx, jy, jz = take(position, j)
            kx, ky, kz = take(position, k)
            ix, iy, iz = take(position, i)
            lx, ly, lz = take(position, l)
            angle, jx, jy, jz, kx, ky, kz, ix, iy, iz, lx, ly, lz = dihedral_gradient(
                jx, jy, jz, kx, ky, kz, ix, iy, iz, lx, ly, lz
            )
            at = e * WIDTH
            if any_of(abs(angle - eight(angles, at)) > math.pi):
                passed = True
                put(value, 0, angle)
                for q in range(WIDTH):
                    if abs(value[q] - angles[at + q]) > math.pi and hinge[q] < 0:
                        hinge[q], before[q] = e, angles[at + q]
            put(angles, at, angle)
            rest, share = eight(own.hinge_rest, at), eight(own.hinge_share, at)
            if (code == superlinear.CODE) and not any_of(share < 1.0):
                moment = superlinear.moment(angle, rest)
            elif code == LINEAR:
                moment = angle - rest
            else:
                middle = rest + eight(p[2], at)
                moment = angle - rest - eight(p[2], at)
                crease = share * angle + (1.0 - share) * middle
                plain = (code == STRESS_FREE) | (code == AS_PUBLISHED)
                low, high = eight(p[0], at), eight(p[1], at)
                if not plain or any_of(crease < low) or any_of(crease > high):
                    for q in range(WIDTH):
                        n, r = at + q, own.hinge_rest[at + q]
                        value[q] = series_moment(
                            code, angles[n], r, p[0, n], p[1, n], p[2, n], p[3, n],
                            own.hinge_share[n], address,
                        )  # fmt: skip
                    moment = eight(value, 0)
            m = eight(own.hinge_stiffness, at) * moment
            add(force, j, m * jx, m * jy, m * jz)
            add(force, k, m * kx, m * ky, m * kz)
            add(force, i, m * ix, m * iy, m * iz)
            add(force, l, m * lx, m * ly, m * lz)
    return passed


@inner
def energies_of_lanes(topology, own, u, angle, out):
    """Strain energies (J) of all models: out[0] the bars, out[1 + g] the hinges of group g.

    out : (groups, WIDTH).
    """
    out[:] = 0.0
    for run in range(topology.bar_runs.shape[0]):
        code = topology.bar_runs[run, 2]
        for e in range(topology.bar_runs[run, 0], topology.bar_runs[run, 1]):
            one, other = np.int64(topology.bars[2 * e]), np.int64(topology.bars[2 * e + 1])
            for q in range(WIDTH):
                x = 0.0
                for c in range(3):
                    du = u[(3 * other + c) * WIDTH + q] - u[(3 * one + c) * WIDTH + q]
                    x += du * (2.0 * own.bar_vector[(3 * e + c) * WIDTH + q] + du)
                i = e * WIDTH + q
                x *= own.bar_per_length2[i]
                w = bar_energy(code, x / (1.0 + math.sqrt(1.0 + x)), 0)
                out[0, q] += own.bar_stiffness[i] / own.bar_per_length2[i] * w
    p = own.hinge_parameters
    for run in range(topology.hinge_runs.shape[0]):
        code, address = topology.hinge_runs[run, 2], topology.addresses[topology.hinge_runs[run, 3]]
        for e in range(topology.hinge_runs[run, 0], topology.hinge_runs[run, 1]):
            for q in range(WIDTH):
                i = e * WIDTH + q
                w = series_energy(
                    code, angle[i], own.hinge_rest[i], p[0, i], p[1, i], p[2, i], p[3, i],
                    own.hinge_share[i], address,
                )  # fmt: skip
                out[1 + topology.hinge_group[e], q] += own.hinge_stiffness[i] * w
