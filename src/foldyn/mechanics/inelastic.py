"""Hinges with memory on a model: what the branches of their laws add to its forces.

The state of the branches is that of the last accepted step. Every evaluation computes from it, from
the dihedrals then and now, and from the time since then, what the state would be now; only `commit`
makes that the state. A step that is refused or tried again leaves no trace.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload
from numpy.typing import NDArray

from foldyn.jit.compiled import kernel, scalar
from foldyn.jit.intrinsics import flat
from foldyn.materials.branch_switch import update
from foldyn.mechanics.dihedral import add_hessian
from foldyn.mechanics.kernels import (
    commit,
    contact_limit,
    contact_powers,
    elapse,
    energies_of,
    folds_of,
    force_of,
    lost_of,
    place_obstacles,
    recall,
)
from foldyn.mechanics.viscous import hinge_gradient


class MemoryHinges(NamedTuple):
    """Arrays of h hinges with b branches in all; dofs are 3 row + column of arrays (rows, 3).

    Those from `angle` on change in place. The angles in them are turns from the rest angle, with
    the offset that the laws of the body see (`Body.series`).
    """

    dofs: NDArray  # (h, 14), see `viscous.hinge_gradient`
    corners: NDArray  # (h, 4, 3) m
    hidden_turn: NDArray  # (h, 2) rad/m
    rest: NDArray  # (h,) rad
    row: NDArray  # (h,) int64: of the offsets
    stiffness: NDArray  # (h,) N m/rad
    group: NDArray  # (h,) int64: of the model's energies
    first: NDArray  # (h + 1,) int64: a hinge has the branches first[e] to first[e + 1]
    code: NDArray  # (b,) int64
    parameters: NDArray  # (b, 4)
    angle: NDArray  # (h,) at the last accepted step, rad
    state: NDArray  # (b, 2) then
    turned: NDArray  # (h,) at the last evaluation, rad
    reached: NDArray  # (b, 2) then
    moment: NDArray  # (h,) of the branches then, N m
    slope: NDArray  # (h,) its derivative with respect to the angle, N m/rad
    stored: NDArray  # (h,) energy of the branches then, J
    lost: NDArray  # (2,) energy dissipated up to the last accepted step, and since then, J
    elapsed: NDArray  # (1,) time since then, s
    gradient: NDArray  # (14,) memory of one hinge


class Inelastic(NamedTuple):
    """A model whose hinges have memory."""

    inner: Any
    hinges_with_memory: MemoryHinges
    offset: NDArray  # (., 4) see `Body.series`

    @property
    def hinges(self) -> NDArray:
        """Rows (nh, 4) of all hinges."""
        return self.inner.hinges


@scalar
def evaluate_branches(own, offset, e, turn):
    """Note what the branches of a hinge do at a turn (rad); returns the energy dissipated, J."""
    moment, slope, stored, lost = 0.0, 0.0, 0.0, 0.0
    turn += offset[own.row[e], 0]
    for k in range(own.first[e], own.first[e + 1]):
        found = update(
            own.code[k], own.parameters[k], own.angle[e], turn, own.elapsed[0], own.state[k, 0],
            own.state[k, 1],
        )  # fmt: skip
        own.reached[k, 0], own.reached[k, 1] = found[0], found[1]
        moment += found[2]
        slope += found[3]
        stored += found[4]
        lost += found[5]
    own.turned[e] = turn
    offset[own.row[e], 1] += own.stiffness[e] * moment - own.moment[e]  # beside other laws' there
    own.moment[e], own.slope[e] = own.stiffness[e] * moment, own.stiffness[e] * slope
    own.stored[e] = own.stiffness[e] * stored
    return own.stiffness[e] * lost


@kernel
def add_memory_forces(own, offset, u, force):
    """Add the forces of the branches at u to `force`, both (rows, 3)."""
    moved, out, g, lost = flat(u), flat(force), own.gradient, 0.0
    for e in range(own.rest.size):
        angle = hinge_gradient(own.corners[e], own.dofs[e], own.hidden_turn[e], moved, g)
        lost += evaluate_branches(own, offset, e, angle - own.rest[e])
        for c in range(14):
            out[own.dofs[e, c]] += own.moment[e] * g[c]
    own.lost[1] = lost


@kernel
def evaluate_at(own, offset, u):
    """Evaluate the branches at u (rows, 3)."""
    moved, lost = flat(u), 0.0
    for e in range(own.rest.size):
        x, dofs = own.corners[e], own.dofs[e]
        angle = hinge_gradient(x, dofs, own.hidden_turn[e], moved, own.gradient)
        lost += evaluate_branches(own, offset, e, angle - own.rest[e])
    own.lost[1] = lost


@kernel
def make_last(own):
    """Make the last evaluation the last accepted step."""
    own.angle[:] = own.turned
    own.state[:] = own.reached
    own.lost[0] += own.lost[1]
    own.lost[1] = 0.0
    own.elapsed[0] = 0.0


@kernel
def memory_tangents(own, u, out):
    """Derivatives (h, 14, 14) of the forces of the branches at u, after their evaluation there."""
    points, gradient, block = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3, 4, 3))
    moved, g = flat(u), own.gradient
    for e in range(own.rest.size):
        hinge_gradient(own.corners[e], own.dofs[e], own.hidden_turn[e], moved, g)
        for v in range(4):
            for c in range(3):
                points[v, c] = own.corners[e, v, c] + moved[own.dofs[e, 3 * v + c]]
                gradient[v, c] = g[3 * v + c]
        block[:] = 0.0
        add_hessian(points, gradient, own.moment[e], block)
        for i in range(14):
            for j in range(14):
                out[e, i, j] = own.slope[e] * g[i] * g[j]
                if i < 12 and j < 12:
                    out[e, i, j] += block[i // 3, i % 3, j // 3, j % 3]


@kernel
def memory_gradients(own, u, out):
    """Gradients (h, 14) of the angles at u."""
    moved = flat(u)
    for e in range(own.rest.size):
        hinge_gradient(own.corners[e], own.dofs[e], own.hidden_turn[e], moved, out[e])


@overload(force_of, inline="always")
def _force(model, u, force, work):
    if model.instance_class is not Inelastic:
        return None

    def inelastic(model, u, force, work):
        force_of(model.inner, u, force, work)
        add_memory_forces(model.hinges_with_memory, model.offset, u, force)

    return inelastic


@overload(energies_of, inline="always")
def _energies(model, u, work, out):
    if model.instance_class is not Inelastic:
        return None

    def inelastic(model, u, work, out):
        energies_of(model.inner, u, work, out)
        own = model.hinges_with_memory
        for e in range(own.rest.size):  # as at the last evaluation, which was at u
            out[own.group[e]] += own.stored[e]

    return inelastic


@overload(folds_of, inline="always")
def _folds(model):
    if model.instance_class is not Inelastic:
        return None
    return lambda model: folds_of(model.inner)


@overload(place_obstacles, inline="always")
def _obstacles(model, factor, work):
    if model.instance_class is not Inelastic:
        return None
    return lambda model, factor, work: place_obstacles(model.inner, factor, work)


@overload(contact_powers, inline="always")
def _powers(model, v, work):
    if model.instance_class is not Inelastic:
        return None
    return lambda model, v, work: contact_powers(model.inner, v, work)


@overload(contact_limit, inline="always")
def _limit(model, u, v, a, dt, pace, lightness, work):
    if model.instance_class is not Inelastic:
        return None
    return lambda model, u, v, a, dt, pace, lightness, work: contact_limit(
        model.inner, u, v, a, dt, pace, lightness, work
    )


@overload(elapse, inline="always")
def _elapse(model, time):
    if model.instance_class is not Inelastic:
        return None

    def inelastic(model, time):
        model.hinges_with_memory.elapsed[0] = time

    return inelastic


@overload(commit, inline="always")
def _commit(model):
    if model.instance_class is not Inelastic:
        return None
    return lambda model: make_last(model.hinges_with_memory)


@overload(lost_of, inline="always")
def _lost(model):
    if model.instance_class is not Inelastic:
        return None
    return lambda model: model.hinges_with_memory.lost[0] + model.hinges_with_memory.lost[1]


@overload(recall, inline="always")
def _recall(model, out):
    if model.instance_class is not Inelastic:
        return None

    def inelastic(model, out):
        out[:] = model.hinges_with_memory.reached

    return inelastic
