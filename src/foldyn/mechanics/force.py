"""Internal force of bars and hinges: gather a block, compute without branches, scatter.

The compute passes run over blocks of 64 elements in structure-of-arrays form, which the compiler
vectorizes; the moment pass stands apart, so that laws with branches or powers do not stop it.
The scratch arrays are flat and addressed as row * BLOCK + lane: with a stride known when compiling
the compiler proves that loads and stores do not overlap (two-dimensional scratch: 5 times slower).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.materials.compiled import kernel, scalar
from foldyn.materials.ogden import stress_of_excess as ogden_stress
from foldyn.materials.superlinear import moment as superlinear_moment
from foldyn.materials.switch import bar_stress, hinge_moment
from foldyn.mechanics.dihedral import dihedral_gradient
from foldyn.mechanics.flat import flat
from foldyn.mechanics.model import BLOCK, BarsHinges


class Workspace(NamedTuple):
    """Scratch memory of the force kernels, made once and used at every evaluation."""

    points: NDArray  # (12 * BLOCK,)
    gradient: NDArray  # (13 * BLOCK,), the last row the angle
    value: NDArray  # (BLOCK,)
    position: NDArray  # (n, 3)
    angle: NDArray  # (nh,) the dihedrals of the last evaluation, rad


def workspace(model: BarsHinges) -> Workspace:
    """Scratch memory for `model`."""
    return Workspace(
        np.zeros(12 * BLOCK),  # lanes beyond a block's end are computed too
        np.zeros(13 * BLOCK),
        np.zeros(BLOCK),
        np.empty((len(model.rest), 3)),
        np.empty(len(model.hinges)),
    )


@kernel
def add_bar_forces(model, u, force, work):
    """Add the bars' internal force at displacement u (n, 3) to force (n, 3)."""
    d, s = work.points, work.value
    u, force = flat(u), flat(force)
    bars, vector = flat(model.bars), flat(model.bar_vector)
    per_length2, stiffness = model.bar_per_length2, model.bar_stiffness
    for run in range(model.bar_runs.shape[0]):
        code = model.bar_runs[run, 2]
        address = model.addresses[model.bar_runs[run, 3], 1]
        end = model.bar_runs[run, 1]
        for first in range(model.bar_runs[run, 0], end, BLOCK):
            m = min(BLOCK, end - first)
            for q in range(m):
                e = first + q
                a, b = 3 * bars[2 * e], 3 * bars[2 * e + 1]
                for c in range(3):
                    d[c * BLOCK + q] = vector[3 * e + c]
                    d[(3 + c) * BLOCK + q] = u[b + c] - u[a + c]
            lanes = whole_lanes(m)
            for q in range(m):
                s[q] = per_length2[first + q]
            for q in range(lanes):
                # lambda^2 - 1 from displacements: nothing cancels
                x = d[3 * BLOCK + q] * (2.0 * d[q] + d[3 * BLOCK + q])
                x += d[4 * BLOCK + q] * (2.0 * d[BLOCK + q] + d[4 * BLOCK + q])
                x += d[5 * BLOCK + q] * (2.0 * d[2 * BLOCK + q] + d[5 * BLOCK + q])
                s[q] *= x
            if code == 1:
                for q in range(lanes):
                    s[q] = ogden_stress(s[q])
            else:
                for q in range(m):
                    s[q] = bar_stress(code, s[q] / (1.0 + math.sqrt(1.0 + s[q])), address)
            for q in range(m):
                s[q] *= stiffness[first + q]
            for q in range(lanes):
                d[q] = s[q] * (d[q] + d[3 * BLOCK + q])
                d[BLOCK + q] = s[q] * (d[BLOCK + q] + d[4 * BLOCK + q])
                d[2 * BLOCK + q] = s[q] * (d[2 * BLOCK + q] + d[5 * BLOCK + q])
            for q in range(m):
                e = first + q
                a, b = 3 * bars[2 * e], 3 * bars[2 * e + 1]
                for c in range(3):
                    force[a + c] -= d[c * BLOCK + q]
                    force[b + c] += d[c * BLOCK + q]


@scalar
def whole_lanes(m):
    """The count of lanes to compute for m elements: the rest of a vector costs nothing."""
    return (m + 7) // 8 * 8


@scalar
def enhanced_moments(stiffness, rest, p, first, m, angle, value):
    """Moments of hinges of the enhanced linear law: those between theta1 and theta2 at once."""
    beyond = 0
    for q in range(m):
        e = first + q
        beyond += (angle[e] < p[4 * e]) | (angle[e] > p[4 * e + 1])
        value[q] = stiffness[e] * (angle[e] - rest[e] - p[4 * e + 2])
    if beyond > 0:
        for q in range(m):
            e = first + q
            if (angle[e] < p[4 * e]) | (angle[e] > p[4 * e + 1]):
                value[q] = stiffness[e] * hinge_moment(
                    2, angle[e], rest[e], p[4 * e], p[4 * e + 1], p[4 * e + 2], 0.0, 0
                )


@scalar
def superlinear_moments(stiffness, rest, first, m, angle, value):
    """Moments of hinges of the superlinear law."""
    for q in range(m):
        e = first + q
        value[q] = stiffness[e] * superlinear_moment(angle[e], rest[e])


@kernel
def hinge_moments(code, address, stiffness, rest, p, first, m, angle, value):
    """Moment (N m) of the m hinges of a block with dihedrals `angle`, all of one law."""
    for q in range(m):
        e = first + q
        value[q] = stiffness[e] * hinge_moment(
            code, angle[e], rest[e], p[4 * e], p[4 * e + 1], p[4 * e + 2], p[4 * e + 3], address
        )


@kernel
def add_hinge_forces(model, u, force, work):
    """Add the hinges' internal force at displacement u (n, 3) to force (n, 3)."""
    x, g, value, angle = work.points, work.gradient, work.value, work.angle
    position, hinges = flat(work.position), flat(model.hinges)
    u, force, at_rest = flat(u), flat(force), flat(model.rest)
    stiffness, rest = model.hinge_stiffness, model.hinge_rest
    parameters = flat(model.hinge_parameters)
    for n in range(u.size):
        position[n] = at_rest[n] + u[n]
    for run in range(model.hinge_runs.shape[0]):
        code = model.hinge_runs[run, 2]
        address = model.addresses[model.hinge_runs[run, 3], 1]
        end = model.hinge_runs[run, 1]
        for first in range(model.hinge_runs[run, 0], end, BLOCK):
            m = min(BLOCK, end - first)
            for q in range(m):
                h = 4 * (first + q)
                j, k = 3 * hinges[h], 3 * hinges[h + 1]
                i, l = 3 * hinges[h + 2], 3 * hinges[h + 3]  # noqa: E741
                for c in range(3):
                    x[c * BLOCK + q] = position[j + c]
                    x[(3 + c) * BLOCK + q] = position[k + c]
                    x[(6 + c) * BLOCK + q] = position[i + c]
                    x[(9 + c) * BLOCK + q] = position[l + c]
            for q in range(whole_lanes(m)):
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
            for q in range(m):
                angle[first + q] = g[12 * BLOCK + q]
            if code == 1:
                superlinear_moments(stiffness, rest, first, m, angle, value)
            elif code == 2:
                enhanced_moments(stiffness, rest, parameters, first, m, angle, value)
            else:
                hinge_moments(code, address, stiffness, rest, parameters, first, m, angle, value)
            for q in range(m):
                h = 4 * (first + q)
                j, k = 3 * hinges[h], 3 * hinges[h + 1]
                i, l = 3 * hinges[h + 2], 3 * hinges[h + 3]  # noqa: E741
                moment = value[q]
                for c in range(3):
                    force[j + c] += moment * g[c * BLOCK + q]
                    force[k + c] += moment * g[(3 + c) * BLOCK + q]
                    force[i + c] += moment * g[(6 + c) * BLOCK + q]
                    force[l + c] += moment * g[(9 + c) * BLOCK + q]


@scalar
def internal_force(model, u, force, work):
    """Internal force (n, 3), N, at displacement u (n, 3), m; dihedrals go to work.angle."""
    force[:] = 0.0
    add_bar_forces(model, u, force, work)
    add_hinge_forces(model, u, force, work)
