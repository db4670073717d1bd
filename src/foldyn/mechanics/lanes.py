"""Forces of many models of one topology at once: the lanes of a vector are models.

Every number of a node or an element stands in memory as WIDTH numbers in a row, one of each model.
Nothing has to be gathered from scattered places then; the formulas are those of `mechanics.force`,
and what is computed at once is GROUP elements of WIDTH models.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner
from foldyn.jit.eights import add_eight, take_eight
from foldyn.materials import enhanced_linear, ogden, superlinear
from foldyn.materials.enhanced_linear import AS_PUBLISHED, STRESS_FREE
from foldyn.materials.switch import bar_energy, bar_stress, hinge_energy, hinge_moment
from foldyn.mechanics.dihedral import dihedral_gradient
from foldyn.mechanics.model import BarsHinges

WIDTH = 8  # models side by side
GROUP = 8  # elements that are computed at once
BLOCK = GROUP * WIDTH


class Topology(NamedTuple):
    """What the models share, flat."""

    bars: NDArray  # (2 nb,) uint32
    bar_runs: NDArray  # (rb, 4)
    hinges: NDArray  # (4 nh,) uint32
    hinge_runs: NDArray  # (rh, 4)
    hinge_group: NDArray  # (nh,)


class Lanes(NamedTuple):
    """What tells WIDTH models apart: so many numbers for each of n nodes, nb bars, nh hinges."""

    rest: NDArray  # (3 n WIDTH,) m
    bar_vector: NDArray  # (3 nb WIDTH,) m
    bar_per_length2: NDArray  # (nb WIDTH,)
    bar_stiffness: NDArray  # N/m
    hinge_stiffness: NDArray  # (nh WIDTH,) N m/rad
    hinge_rest: NDArray  # rad
    hinge_parameters: NDArray  # (4, nh WIDTH)


class LaneWork(NamedTuple):
    """Memory of the force kernels, flat."""

    points: NDArray  # (12 BLOCK,)
    gradient: NDArray  # (13 BLOCK,)
    value: NDArray  # (BLOCK,)
    angle: NDArray  # (nh WIDTH,) rad, of the last evaluation


def topology(model: BarsHinges) -> Topology:
    """What a model shares with those beside it."""
    return Topology(
        model.bars.ravel(), model.bar_runs, model.hinges.ravel(), model.hinge_runs,
        model.hinge_group,
    )  # fmt: skip


def side_by_side(arrays: Sequence[NDArray]) -> NDArray:
    """Arrays of equal shapes, of WIDTH models, as one flat array."""
    return np.ascontiguousarray(np.stack(arrays, axis=-1), float).ravel()


def lanes(models: Sequence[BarsHinges]) -> Lanes:
    """The numbers of WIDTH models."""
    columns = (
        "rest", "bar_vector", "bar_per_length2", "bar_stiffness", "hinge_stiffness", "hinge_rest",
    )  # fmt: skip
    parameters = np.stack([model.hinge_parameters.T for model in models], axis=-1)
    numbers = [side_by_side([getattr(model, name) for model in models]) for name in columns]
    return Lanes._make([*numbers, np.ascontiguousarray(parameters.reshape(4, -1))])


def lane_work(model: BarsHinges) -> LaneWork:
    """Memory for the kernels."""
    rows = (12 * BLOCK, 13 * BLOCK, BLOCK, len(model.hinges) * WIDTH)
    return LaneWork(*map(np.zeros, rows))


@inner
def add_bar_lanes(topology, own, u, force, work):
    """Add the forces of the bars at u to `force`, both (3 n WIDTH,)."""
    x, s, minus = work.points, work.value, work.gradient
    bars, vector = topology.bars, own.bar_vector
    for run in range(topology.bar_runs.shape[0]):
        code = topology.bar_runs[run, 2]
        start, end = topology.bar_runs[run, 0], topology.bar_runs[run, 1]
        for first in range(start, end, GROUP):
            m = min(GROUP, end - first)
            for k in range(m):
                e = first + k
                for c in range(3):
                    for v in range(2):
                        node = np.int64(bars[2 * e + v])
                        take_eight(u, (3 * node + c) * WIDTH, x, (3 * v + c) * BLOCK + k * WIDTH)
                    take_eight(vector, (3 * e + c) * WIDTH, x, (6 + c) * BLOCK + k * WIDTH)
                take_eight(own.bar_per_length2, e * WIDTH, s, k * WIDTH)
            for q in range(BLOCK):
                dx, vx = x[3 * BLOCK + q] - x[q], x[6 * BLOCK + q]
                dy, vy = x[4 * BLOCK + q] - x[BLOCK + q], x[7 * BLOCK + q]
                dz, vz = x[5 * BLOCK + q] - x[2 * BLOCK + q], x[8 * BLOCK + q]
                s[q] *= dx * (2.0 * vx + dx) + dy * (2.0 * vy + dy) + dz * (2.0 * vz + dz)
                x[q], x[BLOCK + q], x[2 * BLOCK + q] = vx + dx, vy + dy, vz + dz
            if code == ogden.CODE:
                for q in range(BLOCK):
                    s[q] = ogden.stress_of_excess(s[q])
            else:
                for q in range(m * WIDTH):
                    s[q] = bar_stress(code, s[q] / (1.0 + math.sqrt(1.0 + s[q])), 0)
            for q in range(m * WIDTH):
                s[q] *= own.bar_stiffness[first * WIDTH + q]
                minus[q] = -s[q]
            for k in range(m):
                one, other = np.int64(bars[2 * (first + k)]), np.int64(bars[2 * (first + k) + 1])
                for c in range(3):
                    row = c * BLOCK + k * WIDTH
                    add_eight(force, (3 * one + c) * WIDTH, minus, k * WIDTH, x, row)
                    add_eight(force, (3 * other + c) * WIDTH, s, k * WIDTH, x, row)


@inner
def add_hinge_lanes(topology, own, position, force, work):
    """Add the forces of the hinges at the positions to `force`, both (3 n WIDTH,)."""
    x, g, value, hinges = work.points, work.gradient, work.value, topology.hinges
    angle, rest, stiffness = g[12 * BLOCK :], own.hinge_rest, own.hinge_stiffness
    p = own.hinge_parameters
    for run in range(topology.hinge_runs.shape[0]):
        code = topology.hinge_runs[run, 2]
        start, end = topology.hinge_runs[run, 0], topology.hinge_runs[run, 1]
        for first in range(start, end, GROUP):
            m = min(GROUP, end - first)
            for k in range(m):
                for v in range(4):
                    node = np.int64(hinges[4 * (first + k) + v])
                    for c in range(3):
                        at = (3 * v + c) * BLOCK + k * WIDTH
                        take_eight(position, (3 * node + c) * WIDTH, x, at)
            for q in range(BLOCK):
                (
                    g[12 * BLOCK + q],
                    g[q], g[BLOCK + q], g[2 * BLOCK + q],
                    g[3 * BLOCK + q], g[4 * BLOCK + q], g[5 * BLOCK + q],
                    g[6 * BLOCK + q], g[7 * BLOCK + q], g[8 * BLOCK + q],
                    g[9 * BLOCK + q], g[10 * BLOCK + q], g[11 * BLOCK + q],
                ) = dihedral_gradient(
                    x[q], x[BLOCK + q], x[2 * BLOCK + q],
                    x[3 * BLOCK + q], x[4 * BLOCK + q], x[5 * BLOCK + q],
                    x[6 * BLOCK + q], x[7 * BLOCK + q], x[8 * BLOCK + q],
                    x[9 * BLOCK + q], x[10 * BLOCK + q], x[11 * BLOCK + q],
                )  # fmt: skip
            there, count = first * WIDTH, m * WIDTH
            for q in range(count):
                work.angle[there + q] = angle[q]
            if code == superlinear.CODE:
                for q in range(count):
                    e = there + q
                    value[q] = stiffness[e] * superlinear.moment(angle[q], rest[e])
            elif (code == STRESS_FREE) | (code == AS_PUBLISHED):
                beyond = 0
                for q in range(count):
                    e = there + q
                    beyond += (angle[q] < p[0, e]) | (angle[q] > p[1, e])
                    value[q] = stiffness[e] * (angle[q] - rest[e] - p[2, e])
                if beyond > 0:
                    for q in range(count):
                        e = there + q
                        at = enhanced_linear.moment(angle[q], rest[e], p[0, e], p[1, e]) - p[2, e]
                        value[q] = stiffness[e] * at
            else:
                for q in range(count):
                    e = there + q
                    value[q] = stiffness[e] * hinge_moment(
                        code, angle[q], rest[e], p[0, e], p[1, e], p[2, e], p[3, e], 0
                    )
            for k in range(m):
                for v in range(4):
                    node = np.int64(hinges[4 * (first + k) + v])
                    for c in range(3):
                        row = (3 * v + c) * BLOCK + k * WIDTH
                        add_eight(force, (3 * node + c) * WIDTH, value, k * WIDTH, g, row)


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
        code = topology.hinge_runs[run, 2]
        for e in range(topology.hinge_runs[run, 0], topology.hinge_runs[run, 1]):
            for q in range(WIDTH):
                i = e * WIDTH + q
                w = hinge_energy(
                    code, angle[i], own.hinge_rest[i], p[0, i], p[1, i], p[2, i], p[3, i], 0
                )
                out[1 + topology.hinge_group[e], q] += own.hinge_stiffness[i] * w
