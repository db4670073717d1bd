"""Forces of many models of one topology at once: each vector lane is a model.

Each value of a node or an element is stored as WIDTH consecutive numbers, one per model, so that
nothing has to be gathered. The formulas are the same as in `mechanics.force`, for one element of
WIDTH models at once, whose values stay in registers from load to sum.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner, inner_scalar
from foldyn.jit.eights import any_of, choose, eight, put
from foldyn.jit.intrinsics import LINE
from foldyn.materials import ogden, superlinear
from foldyn.materials.enhanced_linear import AS_PUBLISHED, STRESS_FREE
from foldyn.materials.linear import CODE as LINEAR
from foldyn.materials.series import series_energy, series_moment
from foldyn.materials.switch import bar_energy, bar_stress
from foldyn.mechanics.dihedral import dihedral_gradient
from foldyn.mechanics.model import BarsHinges

WIDTH = 8  # models side by side
SHARED = ("bars", "bar_runs", "hinges", "hinge_runs", "hinge_group", "addresses")
"""What the models share."""


def lanes(models: Sequence[BarsHinges]) -> BarsHinges:
    """One model with the topology of the first of WIDTH models and the values of all."""
    numbers = [name for name in BarsHinges._fields if name not in SHARED]
    own = {name: side_by_side([getattr(model, name) for model in models]) for name in numbers}
    return models[0]._replace(**own)


def side_by_side(arrays: Sequence[NDArray]) -> NDArray:
    """WIDTH arrays of equal shapes side by side in a flat array, which starts at a cache line."""
    room = np.empty(WIDTH * arrays[0].size + WIDTH)
    out = room[-room.ctypes.data % LINE // room.itemsize :][: room.size - WIDTH]
    np.stack(arrays, axis=-1, out=out.reshape(*arrays[0].shape, WIDTH))
    return out


@inner_scalar
def take(array, row, columns=3):
    """Load the three eights of a node or an element."""
    at = columns * WIDTH * np.int64(row)
    return eight(array, at), eight(array, at + WIDTH), eight(array, at + 2 * WIDTH)


@inner_scalar
def place(array, row, x, y, z):
    """Store three eights as those of a node or an element."""
    at = 3 * WIDTH * np.int64(row)
    put(array, at, x)
    put(array, at + WIDTH, y)
    put(array, at + 2 * WIDTH, z)


@inner_scalar
def add(array, row, x, y, z):
    """Add three eights to a node."""
    at = 3 * WIDTH * np.int64(row)
    increase(array, at, x)
    increase(array, at + WIDTH, y)
    increase(array, at + 2 * WIDTH, z)


@inner_scalar
def increase(array, at, more):
    """array[at :][:8] += more."""
    put(array, at, eight(array, at) + more)


@inner
def add_bars(model, u, force, value, strain):
    """Add the forces of the bars at u to `force`, both (3 n WIDTH,).

    value (WIDTH,) is scratch. Adds strain energies (J) to strain[0], unless it is empty.
    """
    for run in range(model.bar_runs.shape[0]):
        code = model.bar_runs[run, 2]
        for e in range(model.bar_runs[run, 0], model.bar_runs[run, 1]):
            one, other = model.bars[e, 0], model.bars[e, 1]
            x1, y1, z1 = take(u, one)
            x2, y2, z2 = take(u, other)
            vx, vy, vz = take(model.bar_vector, e)
            dx, dy, dz = x2 - x1, y2 - y1, z2 - z1
            at = e * WIDTH
            excess = eight(model.bar_per_length2, at) * (
                dx * (2.0 * vx + dx) + dy * (2.0 * vy + dy) + dz * (2.0 * vz + dz)
            )
            if code == ogden.CODE:
                s = ogden.stress_of_excess(excess)
            else:
                put(value, 0, excess / (1.0 + math.sqrt(1.0 + excess)))
                for q in range(WIDTH):
                    value[q] = bar_stress(code, value[q], 0)
                s = eight(value, 0)
            if strain is not None:
                put(value, 0, excess / (1.0 + math.sqrt(1.0 + excess)))
                for q in range(WIDTH):
                    k = model.bar_stiffness[at + q] / model.bar_per_length2[at + q]
                    strain[0, q] += k * bar_energy(code, value[q], 0)
            s = s * eight(model.bar_stiffness, at)
            fx, fy, fz = s * (vx + dx), s * (vy + dy), s * (vz + dz)
            add(force, one, -fx, -fy, -fz)
            add(force, other, fx, fy, fz)


@inner
def add_hinges(model, position, force, angles, wrong, value, strain):
    """Add the forces of the hinges at the positions to `force`, both (3 n WIDTH,).

    Updates the angles, and sets `wrong` (WIDTH,) for models in which a hinge has passed through 0
    or 360 degrees since the last call. value (WIDTH,) is scratch. Adds strain energies (J) of group
    g to strain[1 + g], unless it is empty.
    """
    hinges, p = model.hinges, model.hinge_parameters
    for run in range(model.hinge_runs.shape[0]):
        code, address = model.hinge_runs[run, 2], model.addresses[model.hinge_runs[run, 3]]
        for e in range(model.hinge_runs[run, 0], model.hinge_runs[run, 1]):
            j, k, i, l = hinges[e, 0], hinges[e, 1], hinges[e, 2], hinges[e, 3]  # noqa: E741
            turned = dihedral_gradient(
                *(take(position, j) + take(position, k) + take(position, i) + take(position, l))
            )
            angle = turned[0]
            at = e * WIDTH
            jumped = abs(angle - eight(angles, at)) > math.pi
            if any_of(jumped):
                put(wrong, 0, choose(jumped, 1.0, eight(wrong, 0)))
            put(angles, at, angle)
            rest, share = eight(model.hinge_rest, at), eight(model.hinge_share, at)
            if (code == superlinear.CODE) and not any_of(share < 1.0):
                moment = superlinear.moment(angle - rest)
            elif code == LINEAR:
                moment = angle - rest
            else:
                low, high, shift = take(p, e, 4)
                moment = angle - rest - shift
                crease = share * angle + (1.0 - share) * (rest + shift)
                plain = (code == STRESS_FREE) | (code == AS_PUBLISHED)
                if not plain or any_of(crease < low) or any_of(crease > high):
                    for q in range(WIDTH):
                        n, c = at + q, 4 * at + q
                        value[q] = series_moment(
                            code, angles[n], model.hinge_rest[n], p[c], p[c + WIDTH],
                            p[c + 2 * WIDTH], p[c + 3 * WIDTH], model.hinge_share[n], address,
                        )  # fmt: skip
                    moment = eight(value, 0)
            if strain is not None:
                for q in range(WIDTH):
                    n, c = at + q, 4 * at + q
                    w = series_energy(
                        code, angles[n], model.hinge_rest[n], p[c], p[c + WIDTH],
                        p[c + 2 * WIDTH], p[c + 3 * WIDTH], model.hinge_share[n], address,
                    )  # fmt: skip
                    strain[1 + model.hinge_group[e], q] += model.hinge_stiffness[n] * w
            m = eight(model.hinge_stiffness, at) * moment
            add(force, j, m * turned[1], m * turned[2], m * turned[3])
            add(force, k, m * turned[4], m * turned[5], m * turned[6])
            add(force, i, m * turned[7], m * turned[8], m * turned[9])
            add(force, l, m * turned[10], m * turned[11], m * turned[12])
