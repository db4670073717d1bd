"""Strain energy of bars and of each group of hinges."""

from __future__ import annotations

import math

import numpy as np

from foldyn.jit.compiled import inner_scalar, kernel
from foldyn.materials.series import series_energy
from foldyn.materials.switch import bar_energy
from foldyn.mechanics.dihedral import dihedral_gradient, hinge_at


@inner_scalar
def bar_extension(model, u, bar):
    """Stretch minus one of a bar, from displacements."""
    a, b = model.bars[bar, 0], model.bars[bar, 1]
    x = 0.0
    for c in range(3):
        du = u[b, c] - u[a, c]
        x += du * (2.0 * model.bar_vector[bar, c] + du)
    x *= model.bar_per_length2[bar]
    return x / (1.0 + math.sqrt(1.0 + x))


@inner_scalar
def hinge_dihedral(model, u, hinge):
    """Dihedral (rad) of a hinge at displacement u, followed by its gradient (12 numbers)."""
    rest, h = model.rest, model.hinges
    j, k, i, l = h[hinge, 0], h[hinge, 1], h[hinge, 2], h[hinge, 3]  # noqa: E741
    return dihedral_gradient(
        rest[j, 0] + u[j, 0], rest[j, 1] + u[j, 1], rest[j, 2] + u[j, 2],
        rest[k, 0] + u[k, 0], rest[k, 1] + u[k, 1], rest[k, 2] + u[k, 2],
        rest[i, 0] + u[i, 0], rest[i, 1] + u[i, 1], rest[i, 2] + u[i, 2],
        rest[l, 0] + u[l, 0], rest[l, 1] + u[l, 1], rest[l, 2] + u[l, 2],
    )  # fmt: skip


@kernel
def angles(x, hinges):
    """Dihedrals (nh,), rad, of hinge rows (nh, 4) at node positions x (n, 3)."""
    out = np.empty(hinges.shape[0])
    for e in range(out.size):
        out[e] = hinge_at(x, hinges, e)[0]
    return out


@kernel
def strain_energies(model, u, out):
    """Energy (J): out[0] the bars, out[1 + g] the hinges of group g."""
    out[:] = 0.0
    for run in range(model.bar_runs.shape[0]):
        code = model.bar_runs[run, 2]
        address = model.addresses[model.bar_runs[run, 3], 0]
        for e in range(model.bar_runs[run, 0], model.bar_runs[run, 1]):
            w = bar_energy(code, bar_extension(model, u, e), address)
            out[0] += model.bar_stiffness[e] / model.bar_per_length2[e] * w
    p = model.hinge_parameters
    for run in range(model.hinge_runs.shape[0]):
        code = model.hinge_runs[run, 2]
        address = model.addresses[model.hinge_runs[run, 3]]
        for e in range(model.hinge_runs[run, 0], model.hinge_runs[run, 1]):
            theta = hinge_dihedral(model, u, e)[0] + model.hinge_offset[e, 0]
            w = series_energy(
                code, theta, model.hinge_rest[e], p[e, 0], p[e, 1], p[e, 2], p[e, 3],
                model.hinge_share[e], address,
            )  # fmt: skip
            out[1 + model.hinge_group[e]] += model.hinge_stiffness[e] * w
