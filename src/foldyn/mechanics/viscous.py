"""Viscous elements whose direction follows the motion: axial dashpots and creases.

Each resists the rate of a scalar s(q) of the dofs, a distance or an angle, with the force
c (ds/dt) grad s, ds/dt = grad s . v. It takes the power c (ds/dt)^2, which is none in rigid
motions, and its matrix in a state is c grad s grad s'. Grad s is sparse: the columns of `dofs`.

The angle of a hinge is its dihedral less a multiple of two dofs beside displacements, if it has
them, as a piece of a shell's crease does.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.compiled import inner_scalar, kernel
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.block_matrix import assembled, pairs_within
from foldyn.mechanics.dihedral import dihedral_gradient
from foldyn.mechanics.sheet_term import NO_DOF
from foldyn.mechanics.term import nodal
from foldyn.mechanics.viscous_panels import (
    ViscousPanels,
    add_viscous_panels,
    panel_blocks,
    viscous_panels_work,
)

WIDTH = 14  # dofs of an element at most: four nodes, and two beside displacements


class Viscous(NamedTuple):
    """Arrays of p axial elements and h hinges; dofs are 3 row + column of arrays (rows, 3)."""

    dofs: NDArray  # (p + h, 14) of each element; the dof 0 with a gradient of 0 where it has fewer
    axial: NDArray  # (p, 3) rest vector from the first node to the second, m
    corners: NDArray  # (h, 4, 3) rest positions of the nodes j, k, i, l, m
    hidden_turn: NDArray  # (h, 2) what a unit of the last two dofs takes from the dihedral, rad/m
    coefficient: NDArray  # (p + h,) N s/m, N m s/rad
    gradient: NDArray  # (14,) memory of one element
    panels: ViscousPanels

    @property
    def present(self) -> bool:
        """Whether there are any."""
        return len(self.coefficient) > 0 or len(self.panels.nodes) > 0


def viscous(
    pairs: NDArray,
    axial: NDArray,
    axial_coefficient: NDArray,
    hinges: NDArray,
    corners: NDArray,
    hidden: NDArray,
    hidden_turn: NDArray,
    hinge_coefficient: NDArray,
    panels: ViscousPanels,
) -> Viscous:
    """Pack elements.

    Parameters
    ----------
    pairs, axial : (p, 2), (p, 3)
        Rows of the nodes, and the rest vector from the first to the second, m.
    axial_coefficient : (p,)
        N s/m.
    hinges, corners : (h, 4), (h, 4, 3)
        Rows of the nodes: axis j, k, wings i, l; where they are at rest, m.
    hidden, hidden_turn : (h, 2)
        Dofs beside displacements, or NO_DOF, and what a unit of each turns, rad/m.
    hinge_coefficient : (h,)
        N m s/rad.
    panels : those that resist the rates of their strains.
    """
    p, h = len(pairs), len(hinges)
    dofs = np.zeros((p + h, WIDTH), np.int64)
    dofs[:p, :6] = (3 * pairs[:, :, None] + np.arange(3)).reshape(p, 6)
    dofs[p:] = hinge_dofs(hinges, hidden)
    return Viscous(
        dofs=dofs,
        axial=np.array(axial, float).reshape(p, 3),
        corners=np.array(corners, float).reshape(h, 4, 3),
        hidden_turn=np.array(hidden_turn, float).reshape(h, 2),
        coefficient=np.concatenate([axial_coefficient, hinge_coefficient]).astype(float),
        gradient=np.zeros(WIDTH),
        panels=panels,
    )


def hinge_dofs(hinges: NDArray, hidden: NDArray) -> NDArray:
    """Dofs (h, 14) of hinges, rows of nodes (h, 4), with two hidden dofs (h, 2).

    In the place of NO_DOF stands the dof 0, whose part is 0 (`FoldHinges.hidden_turn`).
    """
    dofs = np.zeros((len(hinges), WIDTH), np.int64)
    dofs[:, :12] = (3 * hinges[:, :, None] + np.arange(3)).reshape(-1, 12)
    dofs[:, 12:] = np.where(hidden == NO_DOF, 0, hidden)
    return dofs


def turns(elements: Viscous, hidden: NDArray) -> sparse.csr_array:
    """Rows (k, r) of how hidden dofs (r,) turn those hinges that have some, over the largest."""
    turn, dofs = elements.hidden_turn, elements.dofs[len(elements.axial) :, 12:]
    some = turn.any(axis=1)
    row, end = np.nonzero(turn[some])
    values = turn[some][row, end] / turn[some].max(axis=1)[row]
    entries = (values, (row, np.searchsorted(hidden, dofs[some][row, end])))
    return sparse.csr_array(sparse.coo_array(entries, shape=(int(some.sum()), len(hidden))))


@inner_scalar
def hinge_gradient(x, dofs, hidden_turn, moved, out):
    """Angle (rad) of a hinge at flat displacements, and its gradient to `out` (14,).

    A wing with the node of the axis' first end is that of a clamp: it rides on the mean of both.

    x : (4, 3) rest positions of its nodes, m; dofs, hidden_turn : see `Viscous`.
    """
    ride = 3 if dofs[9] == dofs[0] else 9
    found = dihedral_gradient(
        x[0, 0] + moved[dofs[0]], x[0, 1] + moved[dofs[1]], x[0, 2] + moved[dofs[2]],
        x[1, 0] + moved[dofs[3]], x[1, 1] + moved[dofs[4]], x[1, 2] + moved[dofs[5]],
        x[2, 0] + moved[dofs[6]], x[2, 1] + moved[dofs[7]], x[2, 2] + moved[dofs[8]],
        x[3, 0] + 0.5 * (moved[dofs[9]] + moved[dofs[ride]]),
        x[3, 1] + 0.5 * (moved[dofs[10]] + moved[dofs[ride + 1]]),
        x[3, 2] + 0.5 * (moved[dofs[11]] + moved[dofs[ride + 2]]),
    )  # fmt: skip
    for c in range(12):
        out[c] = found[1 + c]
    if ride == 3:
        for c in range(3):
            out[9 + c] *= 0.5
            out[3 + c] += out[9 + c]
    out[12], out[13] = -hidden_turn[0], -hidden_turn[1]
    return found[0] - hidden_turn[0] * moved[dofs[12]] - hidden_turn[1] * moved[dofs[13]]


@kernel
def _gradient(elements, moved, e, out):
    """Gradient (14,) of element e at flat displacements."""
    dofs, p = elements.dofs[e], elements.axial.shape[0]
    for c in range(14):
        out[c] = 0.0
    if e < p:
        square = 0.0
        for c in range(3):
            out[3 + c] = elements.axial[e, c] + moved[dofs[3 + c]] - moved[dofs[c]]
            square += out[3 + c] * out[3 + c]
        length = math.sqrt(square)
        for c in range(3):
            out[3 + c] /= length
            out[c] = -out[3 + c]
        return
    hinge_gradient(elements.corners[e - p], dofs, elements.hidden_turn[e - p], moved, out)


@kernel
def add_viscous_elements(elements, u, v, force):
    """Add their forces at u and v to `force`, all (rows, 3); returns the power taken, W."""
    power, moved, speed, out = 0.0, flat(u), flat(v), flat(force)
    g = elements.gradient
    for e in range(elements.coefficient.size):
        _gradient(elements, moved, e, g)
        rate = 0.0
        for c in range(14):
            rate += g[c] * speed[elements.dofs[e, c]]
        resist = elements.coefficient[e] * rate
        for c in range(14):
            out[elements.dofs[e, c]] += resist * g[c]
        power += resist * rate
    return power + add_viscous_panels(elements.panels, u, v, force)


@kernel
def viscous_elements_work(elements, u, v, shift):
    """Work (J) of their forces at u and v along a shift, all (rows, 3)."""
    work, moved, speed, along, g = 0.0, flat(u), flat(v), flat(shift), elements.gradient
    for e in range(elements.coefficient.size):
        _gradient(elements, moved, e, g)
        rate, change = 0.0, 0.0
        for c in range(14):
            rate += g[c] * speed[elements.dofs[e, c]]
            change += g[c] * along[elements.dofs[e, c]]
        work += elements.coefficient[e] * rate * change
    return work + viscous_panels_work(elements.panels, u, v, shift)


@kernel
def put_gradients(elements, u, out):
    """Gradients of all elements at u, flat or (rows, 3), to out (p + h, 14)."""
    moved = flat(u)
    for e in range(elements.coefficient.size):
        _gradient(elements, moved, e, out[e])


def viscous_matrix(elements: Viscous, q: NDArray, size: int) -> sparse.csr_array:
    """Sum of c grad s grad s' and of panels at the dofs q (m,), a matrix (size, size), N s/m."""
    gradients = np.zeros((len(elements.coefficient), WIDTH))
    put_gradients(elements, np.ascontiguousarray(q, float), gradients)
    row = np.repeat(np.arange(len(gradients)), WIDTH)
    entries = (gradients.ravel(), (row, elements.dofs.ravel()))
    rates = sparse.csr_array(entries, (len(gradients), size))
    rates.eliminate_zeros()
    matrix = sparse.csr_array(rates.T @ (sparse.diags_array(elements.coefficient) @ rates))
    if len(elements.panels.nodes):
        blocks = panel_blocks(elements.panels, nodal(q))
        matrix = matrix + assembled(pairs_within(elements.panels.nodes), blocks, size)
    return sparse.csr_array(matrix)
