"""Bars and hinges as a term of a model: kernels, and their pullback (`mechanics.pullback`).

The pullback works in blocks, like the force. A bar with the vector d = V + du,
x = (2 V + du).du / L^2 and the force T d, T = k s(x), has

    w . F = T (w.d),    K w = T w + 2 k s' (w.d) d / L^2,

with w the difference of the weights at its ends. A hinge with the moment M(theta) has

    w . F = M theta',    K w = M g' + M' theta' g,

with g the gradient of the dihedral theta; theta' and g' are the rates of theta and g for nodal
velocities w.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner, inner_scalar
from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.jit.intrinsics import flat
from foldyn.materials import ogden, superlinear
from foldyn.materials.enhanced_linear import AS_PUBLISHED, STRESS_FREE
from foldyn.materials.linear import CODE as LINEAR
from foldyn.materials.series import series_derivatives
from foldyn.materials.switch import bar_slope, bar_stress
from foldyn.mechanics.dihedral import dihedral_rates
from foldyn.mechanics.discrete_gradient import add_bar_forces, add_hinge_forces
from foldyn.mechanics.energy import strain_energies
from foldyn.mechanics.force import (
    ForceScratch,
    gather,
    gives_way,
    internal_force,
    scatter,
    whole_lanes,
)
from foldyn.mechanics.model import BLOCK, BarsHinges
from foldyn.mechanics.pullback import Pulled, pullback
from foldyn.mechanics.term import (
    ENERGIES,
    FORCES,
    MEAN_FORCES,
    CompiledTerm,
    energies,
    forces,
    mean_forces,
)


class _Context(NamedTuple):
    model: BarsHinges
    scratch: ForceScratch
    groups: int


@forces
def _forces(own, u, v, t, force, powers):
    """Forces of bars and hinges; overwrites `force`, because this term is the first."""
    rows = own.model.rest.shape[0]
    internal_force(own.model, rows_at(u, rows), rows_at(force, rows), own.scratch)


@energies
def _energies(own, u, out):
    moved = rows_at(u, own.model.rest.shape[0])
    strain_energies(own.model, moved, numbers_at(out, own.groups))


@mean_forces
def _mean_forces(own, u0, u1, before, h, t, force, powers):
    rows, angle = own.model.rest.shape[0], own.scratch.angle
    start, end, out = rows_at(u0, rows), rows_at(u1, rows), rows_at(force, rows)
    add_bar_forces(own.model, start, end, out)
    add_hinge_forces(own.model, start, end, numbers_at(before, angle.size), angle, out)


def bars_hinges_kernels(model: BarsHinges, scratch: ForceScratch, groups: int) -> CompiledTerm:
    """`CompiledTerm` of bars and hinges, with `groups` energy groups."""
    own = Context(_Context(model, scratch, groups))
    return CompiledTerm(own, {FORCES: _forces, ENERGIES: _energies, MEAN_FORCES: _mean_forces})


ALL = (1 << 32) - 1  # mask of buffers that hold all nodes
LAW = 7  # values per law, from `series_derivatives`
TINY = 1e-280  # rad^2: at much smaller squared turns the slope is 0


class PullbackScratch(NamedTuple):
    """Scratch of one evaluation."""

    points: NDArray  # (24 * BLOCK,) points of the nodes, then their weights
    rates: NDArray  # (26 * BLOCK,) of `dihedral_rates`
    law: NDArray  # (LAW * BLOCK,)
    ones: NDArray  # (2 * BLOCK,) 1, then -1
    position: NDArray  # (n, 4)
    displacement: NDArray  # (n, 4)
    weight: NDArray  # (n, 4)
    sums: NDArray  # (n, 4)


class Gradient(NamedTuple):
    """Gradients with respect to arrays of `BarsHinges`, and to the excess of bars.

    The excess of a bar is lambda^2 - 1 at rest: 0 in a model, positive if the bar is longer than
    its natural length.
    """

    rest: NDArray
    bar_vector: NDArray
    bar_per_length2: NDArray
    bar_stiffness: NDArray
    hinge_stiffness: NDArray
    hinge_rest: NDArray
    hinge_parameters: NDArray
    hinge_share: NDArray
    hinge_offset: NDArray
    bar_excess: NDArray  # (nb,)


def pullback_scratch(nodes: int) -> PullbackScratch:
    """Scratch of a model with `nodes` nodes."""
    ones = np.ones(2 * BLOCK)
    ones[BLOCK:] = -1.0
    buffers = (np.zeros((nodes + 1, 4)) for _ in range(4))
    return PullbackScratch(
        np.zeros(24 * BLOCK), np.zeros(26 * BLOCK), np.zeros(LAW * BLOCK), ones, *buffers
    )


@inner_scalar
def _spread(rows, out):
    """Copy rows of three to rows of four."""
    for i in range(rows.shape[0]):
        for c in range(3):
            out[i, c] = rows[i, c]


@inner
def pull_bars(model, scratch, out):
    """Add K w of the bars to scratch.sums, and their gradients to `out`."""
    x, s, ones = scratch.points, scratch.law, scratch.ones
    u, weight, sums = flat(scratch.displacement), flat(scratch.weight), flat(scratch.sums)
    bars, vector, by_vector = flat(model.bars), flat(model.bar_vector), flat(out.bar_vector)
    w, dx, d = x[6 * BLOCK :], x[12 * BLOCK :], x[15 * BLOCK :]
    stress, slope, wd = s[BLOCK:], s[2 * BLOCK :], s[3 * BLOCK :]
    per_length2, stiffness = model.bar_per_length2, model.bar_stiffness
    for run in range(model.bar_runs.shape[0]):
        code, row = model.bar_runs[run, 2], model.bar_runs[run, 3]
        stress_at, slope_at = model.addresses[row, 1], model.addresses[row, 2]
        for first in range(model.bar_runs[run, 0], model.bar_runs[run, 1], BLOCK):
            m = min(BLOCK, model.bar_runs[run, 1] - first)
            for v in range(2):
                gather(u, ALL, bars, 2, v, first, m, x, 3 * v * BLOCK)
                gather(weight, ALL, bars, 2, v, first, m, w, 3 * v * BLOCK)
            for q in range(m):
                for c in range(3):
                    d[c * BLOCK + q] = vector[3 * (first + q) + c]
                s[q] = per_length2[first + q]
            for q in range(whole_lanes(m)):
                a, b = x[3 * BLOCK + q] - x[q], x[4 * BLOCK + q] - x[BLOCK + q]
                c = x[5 * BLOCK + q] - x[2 * BLOCK + q]
                raw = a * (2.0 * d[q] + a)
                raw += b * (2.0 * d[BLOCK + q] + b) + c * (2.0 * d[2 * BLOCK + q] + c)
                dx[q], dx[BLOCK + q], dx[2 * BLOCK + q] = a, b, c
                d[q] += a
                d[BLOCK + q] += b
                d[2 * BLOCK + q] += c
                w[q] = w[3 * BLOCK + q] - w[q]
                w[BLOCK + q] = w[4 * BLOCK + q] - w[BLOCK + q]
                w[2 * BLOCK + q] = w[5 * BLOCK + q] - w[2 * BLOCK + q]
                s[q] *= raw
                wd[q] = (
                    w[q] * d[q] + w[BLOCK + q] * d[BLOCK + q] + w[2 * BLOCK + q] * d[2 * BLOCK + q]
                )
            if code == ogden.CODE:
                for q in range(whole_lanes(m)):
                    e = s[q] / (1.0 + math.sqrt(1.0 + s[q]))
                    stress[q], slope[q] = ogden.stress_of_excess(s[q]), ogden.slope(e)
            else:
                for q in range(m):
                    e = s[q] / (1.0 + math.sqrt(1.0 + s[q]))
                    stress[q] = bar_stress(code, e, stress_at)
                    slope[q] = bar_slope(code, e, slope_at)
            for q in range(m):
                e = first + q
                k = stiffness[e]
                out.bar_stiffness[e] += stress[q] * wd[q]
                rise = k * slope[q] * wd[q]  # s' = slope / 2
                out.bar_excess[e] += 0.5 * rise
                out.bar_per_length2[e] += 0.5 * rise * s[q] / per_length2[e]
                stress[q], slope[q] = k * stress[q], rise * per_length2[e]
            for c in range(3):
                for q in range(whole_lanes(m)):
                    by = stress[q] * w[c * BLOCK + q]
                    dx[c * BLOCK + q] = by + slope[q] * dx[c * BLOCK + q]
                    x[c * BLOCK + q] = by + slope[q] * d[c * BLOCK + q]
            for q in range(m):
                for c in range(3):
                    by_vector[3 * (first + q) + c] += dx[c * BLOCK + q]
            scatter(sums, ALL, bars, 2, 0, first, m, x, 0, ones, BLOCK)
            scatter(sums, ALL, bars, 2, 1, first, m, x, 0, ones, 0)


@inner
def _laws(model, code, address, low, high, first, m, angle, law):
    """Put the law's values for the m hinges of a block with dihedrals `angle` into `law`."""
    p, offset = flat(model.hinge_parameters), flat(model.hinge_offset)
    locks = (code == STRESS_FREE) | (code == AS_PUBLISHED)
    beyond = 0
    if (code == LINEAR) | locks:
        for q in range(m):
            e = first + q
            turn, middle = angle[q] + offset[4 * e], model.hinge_rest[e] + p[4 * e + 2]
            if locks:
                crease = model.hinge_share[e] * turn + (1.0 - model.hinge_share[e]) * middle
                beyond += (crease < low) | (crease > high)
                law[q], law[5 * BLOCK + q] = turn - middle, -1.0 * (code == STRESS_FREE)
            else:
                law[q], law[5 * BLOCK + q] = turn - model.hinge_rest[e], 0.0
            law[BLOCK + q], law[2 * BLOCK + q], law[3 * BLOCK + q] = 1.0, -1.0, 0.0
            law[4 * BLOCK + q], law[6 * BLOCK + q] = 0.0, 0.0
        if beyond == 0:
            return
    if (code == superlinear.CODE) and not gives_way(model.hinge_share, first, m):
        for q in range(m):
            turn = angle[q] - model.hinge_rest[first + q]
            law[q] = superlinear.moment(turn)
            law[BLOCK + q] = 4.0 / 3.0 * law[q] * turn / (turn * turn + TINY)
            law[2 * BLOCK + q] = -law[BLOCK + q]
            for c in range(3, LAW):
                law[c * BLOCK + q] = 0.0
        return
    for q in range(m):
        e = first + q
        found = series_derivatives(
            code, angle[q] + offset[4 * e], model.hinge_rest[e], p[4 * e], p[4 * e + 1],
            p[4 * e + 2], p[4 * e + 3], model.hinge_share[e], address,
        )  # fmt: skip
        law[q], law[BLOCK + q], law[2 * BLOCK + q], law[3 * BLOCK + q] = found[:4]
        law[4 * BLOCK + q], law[5 * BLOCK + q], law[6 * BLOCK + q] = found[4:]


@inner
def pull_hinges(model, scratch, out):
    """Add K w of the hinges to scratch.sums, and their gradients, except for `rest`, to `out`."""
    x, g, law, ones = scratch.points, scratch.rates, scratch.law, scratch.ones
    position, weight, sums = flat(scratch.position), flat(scratch.weight), flat(scratch.sums)
    hinges, p, by_p = flat(model.hinges), flat(model.hinge_parameters), flat(out.hinge_parameters)
    by_offset = flat(out.hinge_offset)
    for run in range(model.hinge_runs.shape[0]):
        code, address = model.hinge_runs[run, 2], model.addresses[model.hinge_runs[run, 3]]
        start, end = model.hinge_runs[run, 0], model.hinge_runs[run, 1]
        for first in range(start, end, BLOCK):
            m = min(BLOCK, end - first)
            for v in range(4):
                gather(position, ALL, hinges, 4, v, first, m, x, 3 * v * BLOCK)
                gather(weight, ALL, hinges, 4, v, first, m, x, (12 + 3 * v) * BLOCK)
            for q in range(whole_lanes(m)):
                (
                    g[q],
                    g[BLOCK + q], g[2 * BLOCK + q], g[3 * BLOCK + q],
                    g[4 * BLOCK + q], g[5 * BLOCK + q], g[6 * BLOCK + q],
                    g[7 * BLOCK + q], g[8 * BLOCK + q], g[9 * BLOCK + q],
                    g[10 * BLOCK + q], g[11 * BLOCK + q], g[12 * BLOCK + q],
                    g[13 * BLOCK + q],
                    g[14 * BLOCK + q], g[15 * BLOCK + q], g[16 * BLOCK + q],
                    g[17 * BLOCK + q], g[18 * BLOCK + q], g[19 * BLOCK + q],
                    g[20 * BLOCK + q], g[21 * BLOCK + q], g[22 * BLOCK + q],
                    g[23 * BLOCK + q], g[24 * BLOCK + q], g[25 * BLOCK + q],
                ) = dihedral_rates(
                    x[q], x[BLOCK + q], x[2 * BLOCK + q],
                    x[3 * BLOCK + q], x[4 * BLOCK + q], x[5 * BLOCK + q],
                    x[6 * BLOCK + q], x[7 * BLOCK + q], x[8 * BLOCK + q],
                    x[9 * BLOCK + q], x[10 * BLOCK + q], x[11 * BLOCK + q],
                    x[12 * BLOCK + q], x[13 * BLOCK + q], x[14 * BLOCK + q],
                    x[15 * BLOCK + q], x[16 * BLOCK + q], x[17 * BLOCK + q],
                    x[18 * BLOCK + q], x[19 * BLOCK + q], x[20 * BLOCK + q],
                    x[21 * BLOCK + q], x[22 * BLOCK + q], x[23 * BLOCK + q],
                )  # fmt: skip
            # theta1 and theta2 are equal within the run
            _laws(model, code, address, p[4 * start], p[4 * start + 1], first, m, g, law)
            for q in range(m):
                e = first + q
                k, rate = model.hinge_stiffness[e], g[13 * BLOCK + q]
                out.hinge_stiffness[e] += law[q] * rate
                law[q] *= k
                rate *= k
                law[BLOCK + q] *= rate
                by_offset[4 * e] += law[BLOCK + q]
                out.hinge_rest[e] += rate * law[2 * BLOCK + q]
                by_p[4 * e] += rate * law[3 * BLOCK + q]
                by_p[4 * e + 1] += rate * law[4 * BLOCK + q]
                by_p[4 * e + 2] += rate * law[5 * BLOCK + q]
                out.hinge_share[e] += rate * law[6 * BLOCK + q]
            for c in range(12):
                for q in range(m):
                    x[c * BLOCK + q] = (
                        law[q] * g[(14 + c) * BLOCK + q] + law[BLOCK + q] * g[(1 + c) * BLOCK + q]
                    )
            for v in range(4):
                scatter(sums, ALL, hinges, 4, v, first, m, x, 3 * v * BLOCK, ones, 0)


@inner
def pull_bars_hinges(model, u, w, scratch, out, product):
    """Add K w of the model at u to `product` (n, 3), and its gradients to `out`."""
    n = model.rest.shape[0]
    _spread(u, scratch.displacement)
    _spread(w, scratch.weight)
    for i in range(n):
        for c in range(3):
            scratch.position[i, c] = model.rest[i, c] + u[i, c]
    scratch.sums[:] = 0.0
    pull_hinges(model, scratch, out)
    for i in range(n):  # hinges depend on the sum of rest and displacement
        for c in range(3):
            out.rest[i, c] += scratch.sums[i, c]
    pull_bars(model, scratch, out)
    for i in range(n):
        for c in range(3):
            product[i, c] += scratch.sums[i, c]


class _Backward(NamedTuple):
    model: BarsHinges
    scratch: PullbackScratch
    out: Gradient


@pullback
def _pullback(own, u, v, t, weight, product, rate):
    rows = own.model.rest.shape[0]
    moved, weights, out = rows_at(u, rows), rows_at(weight, rows), rows_at(product, rows)
    pull_bars_hinges(own.model, moved, weights, own.scratch, own.out, out)


def gradient_of(model: BarsHinges) -> Gradient:
    """Zero arrays for the gradients with respect to a model's arrays."""
    arrays = model._asdict() | {"bar_excess": model.bar_stiffness}
    return Gradient(*(np.zeros_like(arrays[name]) for name in Gradient._fields))


def bars_hinges_pulled(model: BarsHinges) -> Pulled:
    """Pullback of bars and hinges."""
    out = gradient_of(model)
    own = Context(_Backward(model, pullback_scratch(len(model.rest)), out))
    return Pulled(own, _pullback, out._asdict())
