"""Viscous elements whose direction follows the motion: axial dashpots and creases.

Each resists the rate of a scalar s(q) of the dofs, a distance or an angle, with the force c (ds/dt)
grad s, ds/dt = grad s . v. It dissipates the power c (ds/dt)^2, which is zero in rigid motions, and
its matrix in a state is c grad s grad s'. Grad s is sparse: its columns are in `dofs`.

The angle of a hinge is its dihedral. If the hinge has two hidden dofs, like a piece of a shell's
crease, multiples of these dofs are subtracted.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.jit.context import Context, numbers_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.dihedral import dihedral_gradient, dihedral_rates
from foldyn.mechanics.pullback import Arrays, Pulled, arrays_of, pullback, zeros_for
from foldyn.mechanics.sheet_term import NO_DOF
from foldyn.mechanics.term import FORCES, CompiledTerm, Term, forces

WIDTH = 14  # largest number of dofs of an element: four nodes, and two hidden dofs


class Viscous(NamedTuple):
    """Arrays of p axial elements and h hinges; dofs are 3 row + column of arrays (rows, 3)."""

    dofs: NDArray  # (p + h, 14) of each element; unused ones are dof 0 with a gradient of 0
    axial: NDArray  # (p, 3) rest vector from the first node to the second, m
    corners: NDArray  # (h, 4, 3) rest positions of the nodes j, k, i, l, m
    hidden_turn: NDArray  # (h, 2) reduction of the dihedral per unit of the last two dofs, rad/m
    coefficient: NDArray  # (p + h,) N s/m, N m s/rad
    gradient: NDArray  # (14,) scratch of one element


def viscous(
    pairs: NDArray, axial: NDArray, axial_coefficient: NDArray, hinges: NDArray, corners: NDArray,
    hidden: NDArray, hidden_turn: NDArray, hinge_coefficient: NDArray,
) -> Viscous:  # fmt: skip
    """Pack elements.

    Parameters
    ----------
    pairs, axial : (p, 2), (p, 3)
        Rows of the nodes, and the rest vector from the first to the second, m.
    axial_coefficient : (p,)
        N s/m.
    hinges, corners : (h, 4), (h, 4, 3)
        Rows of the nodes: axis j, k, wings i, l; their rest positions, m.
    hidden, hidden_turn : (h, 2)
        Hidden dofs, or NO_DOF, and the turn per unit of each, rad/m.
    hinge_coefficient : (h,)
        N m s/rad.
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
    )


def hinge_dofs(hinges: NDArray, hidden: NDArray) -> NDArray:
    """Dofs (h, 14) of hinges, rows of nodes (h, 4), with two hidden dofs (h, 2).

    Dof 0 replaces NO_DOF, with a turn of 0 (`FoldHinges.hidden_turn`). A hinge with one hidden dof
    twice turns by this dof alone, which then stands for its nodal dofs.
    """
    dofs = np.zeros((len(hinges), WIDTH), np.int64)
    dofs[:, :12] = (3 * hinges[:, :, None] + np.arange(3)).reshape(-1, 12)
    dofs[:, 12:] = np.where(hidden == NO_DOF, 0, hidden)
    alone = (hidden[:, 0] == hidden[:, 1]) & (hidden[:, 0] != NO_DOF)
    dofs[alone, :12] = hidden[alone, :1]
    return dofs


def coupled(dofs: NDArray, own: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Mask (e, w, w) of the pairs of dofs (e, w) that elements have; rows and columns of these.

    own : (e, w) bool, which of the dofs an element has.
    """
    pairs = own[:, :, None] & own[:, None, :]
    row, column = (np.broadcast_to(d, pairs.shape) for d in (dofs[:, :, None], dofs[:, None, :]))
    return pairs, row[pairs], column[pairs]


@inner_scalar
def hinge_gradient(x, dofs, hidden_turn, moved, out):
    """Angle (rad) of a hinge at flat displacements, and its gradient into `out` (14,).

    A wing that repeats the first axis node is virtual, as in a clamp: it follows the mean of both
    axis nodes. A hinge whose axis repeats a dof turns by hidden dofs alone.

    x : (4, 3) rest positions of the hinge's nodes, m; dofs, hidden_turn : see `Viscous`.
    """
    ride = 3 if dofs[9] == dofs[0] else 9
    s = 0.0 if dofs[0] == dofs[1] else 1.0
    found = dihedral_gradient(
        x[0, 0] + s * moved[dofs[0]], x[0, 1] + s * moved[dofs[1]], x[0, 2] + s * moved[dofs[2]],
        x[1, 0] + s * moved[dofs[3]], x[1, 1] + s * moved[dofs[4]], x[1, 2] + s * moved[dofs[5]],
        x[2, 0] + s * moved[dofs[6]], x[2, 1] + s * moved[dofs[7]], x[2, 2] + s * moved[dofs[8]],
        x[3, 0] + s * 0.5 * (moved[dofs[9]] + moved[dofs[ride]]),
        x[3, 1] + s * 0.5 * (moved[dofs[10]] + moved[dofs[ride + 1]]),
        x[3, 2] + s * 0.5 * (moved[dofs[11]] + moved[dofs[ride + 2]]),
    )  # fmt: skip
    for c in range(12):
        out[c] = s * found[1 + c]
    if ride == 3:
        for c in range(3):
            out[9 + c] *= 0.5
            out[3 + c] += out[9 + c]
    out[12], out[13] = -hidden_turn[0], -hidden_turn[1]
    return found[0] - hidden_turn[0] * moved[dofs[12]] - hidden_turn[1] * moved[dofs[13]]


@inner
def element_gradient(elements, moved, e, out):
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
def put_gradients(elements, moved, out):
    """Gradients of all elements at flat displacements, into out (p + h, 14)."""
    for e in range(elements.coefficient.size):
        element_gradient(elements, moved, e, out[e])


class _Context(NamedTuple):
    elements: Viscous
    size: int  # size of flat arrays


@forces
def _forces(own, u, v, t, force, powers):
    elements, g, power = own.elements, own.elements.gradient, 0.0
    moved, speed = numbers_at(u, own.size), numbers_at(v, own.size)
    out = numbers_at(force, own.size)
    for e in range(elements.coefficient.size):
        element_gradient(elements, moved, e, g)
        rate = 0.0
        for c in range(14):
            rate += g[c] * speed[elements.dofs[e, c]]
        resisted = elements.coefficient[e] * rate
        for c in range(14):
            out[elements.dofs[e, c]] += resisted * g[c]
        power += resisted * rate
    numbers_at(powers, 2)[1] += power


class _Backward(NamedTuple):
    elements: Viscous
    out: Viscous  # gradients
    points: NDArray  # (4, 3) scratch: positions of one hinge, m
    moves: NDArray  # (14,) velocities of the dofs of one element
    by: NDArray  # (14,)
    size: int  # number of dofs up to the last one used


@inner
def _turn_gradient(elements, moved, e, z, points, out):
    """Rate (14,) of the gradient of element e for dof velocities z (14,), into `out`."""
    dofs, p = elements.dofs[e], elements.axial.shape[0]
    for c in range(14):
        out[c] = 0.0
    if e < p:
        g, square, along = elements.gradient, 0.0, 0.0  # g is evaluated at these displacements
        for c in range(3):
            x = elements.axial[e, c] + moved[dofs[3 + c]] - moved[dofs[c]]
            square += x * x
            along += g[3 + c] * (z[3 + c] - z[c])
        length = math.sqrt(square)
        for c in range(3):
            out[3 + c] = (z[3 + c] - z[c] - g[3 + c] * along) / length
            out[c] = -out[3 + c]
        return
    if dofs[0] == dofs[1]:
        for c in range(12):
            out[c] = 0.0
        return
    ride = 3 if dofs[9] == dofs[0] else 9
    for c in range(3):
        for n in range(3):
            points[n, c] = elements.corners[e - p, n, c] + moved[dofs[3 * n + c]]
        mean = 0.5 * (moved[dofs[9 + c]] + moved[dofs[ride + c]])
        points[3, c] = elements.corners[e - p, 3, c] + mean
    x = flat(points)
    found = dihedral_rates(
        x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11],
        z[0], z[1], z[2], z[3], z[4], z[5], z[6], z[7], z[8],
        0.5 * (z[9] + z[ride]), 0.5 * (z[10] + z[ride + 1]), 0.5 * (z[11] + z[ride + 2]),
    )  # fmt: skip
    for c in range(12):
        out[c] = found[14 + c]


@pullback
def _pullback(own, u, v, t, weight, product, rate):
    """Of w . F = c (g . w) (g . v), d/dx is c times the rate of g along (g.w) v + (g.v) w."""
    elements, g, z, by, out = own.elements, own.elements.gradient, own.moves, own.by, own.out
    moved, speed = numbers_at(u, own.size), numbers_at(v, own.size)
    weights, p = numbers_at(weight, own.size), own.out.axial.shape[0]
    by_u, by_v = numbers_at(product, own.size), numbers_at(rate, own.size)
    for e in range(elements.coefficient.size):
        dofs, coefficient = elements.dofs[e], elements.coefficient[e]
        element_gradient(elements, moved, e, g)
        ahead, back = 0.0, 0.0
        for c in range(14):
            ahead += g[c] * speed[dofs[c]]
            back += g[c] * weights[dofs[c]]
        for c in range(14):
            by_v[dofs[c]] += coefficient * back * g[c]
            z[c] = coefficient * (back * speed[dofs[c]] + ahead * weights[dofs[c]])
        out.coefficient[e] += back * ahead
        _turn_gradient(elements, moved, e, z, own.points, by)
        if e < p:
            for c in range(3):
                out.axial[e, c] += by[3 + c]
        else:
            for c in range(12):
                out.corners[e - p, c // 3, c % 3] += by[c]
            out.hidden_turn[e - p, 0] -= z[12]
            out.hidden_turn[e - p, 1] -= z[13]
            if dofs[9] == dofs[0]:
                for c in range(3):
                    by[9 + c] *= 0.5
                    by[3 + c] += by[9 + c]
        for c in range(12):
            by_u[dofs[c]] += by[c]


class ViscousTerm(Term):
    """Viscous elements; see `Term`."""

    damps = True

    def __init__(self, elements: Viscous) -> None:
        self.elements = elements

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """Context and kernels for a thread; see `Term`."""
        own = Context(_Context(self.elements, 3 * int(part.own[1])))
        return CompiledTerm(own, {FORCES: _forces})

    def arrays(self) -> Arrays:
        """Arrays that the term's forces depend on; see `Term`."""
        return arrays_of(self.elements, "gradient")

    def pulled(self) -> Pulled:
        """Pullback of the term's forces; see `Term`."""
        out = zeros_for(self.elements, "gradient")
        moves, by = np.zeros((2, WIDTH))
        size = 1 + int(self.elements.dofs.max(initial=0))
        own = Context(_Backward(self.elements, out, np.zeros((4, 3)), moves, by, size))
        return Pulled(own, _pullback, arrays_of(out, "gradient").numbers)

    @cached_property
    def _coupled(self) -> tuple[NDArray, NDArray, NDArray]:
        axial, own = len(self.elements.axial), np.ones(self.elements.dofs.shape, bool)
        own[:axial, 6:] = False
        own[axial:, 12:] = self.elements.hidden_turn != 0.0
        return coupled(self.elements.dofs, own)

    @property
    def damping_places(self) -> tuple[NDArray, NDArray]:
        """Rows and columns (k,) of the term's damping entries; see `Term`."""
        return self._coupled[1:]

    def damping_entries(self, q: NDArray, hidden: float = 1.0) -> NDArray:
        """Damping entries; forces on hidden dofs are scaled too, for symmetry. See `Term`."""
        gradient = np.zeros(self.elements.dofs.shape)
        put_gradients(self.elements, np.ravel(q), gradient)
        gradient[:, 12:] *= hidden**0.5
        weighted = self.elements.coefficient[:, None] * gradient
        return (weighted[:, :, None] * gradient[:, None, :])[self._coupled[0]]

    def turns(self, hidden: NDArray) -> sparse.csr_array:
        """Rows (k, r) by which hidden dofs (r,) turn hinges, relative to each row's largest."""
        turn, dofs = self.elements.hidden_turn, self.elements.dofs[len(self.elements.axial) :, 12:]
        some = turn.any(axis=1)
        row, end = np.nonzero(turn[some])
        values = turn[some][row, end] / turn[some].max(axis=1)[row]
        column = np.searchsorted(hidden, dofs[some][row, end])
        return sparse.csr_array((values, (row, column)), (int(some.sum()), len(hidden)))

    def placed(self, order: NDArray, before: Assembly) -> ViscousTerm:
        """The term with nodes in memory order; see `Term`."""
        dofs = before.numbering(order).dofs(self.elements.dofs)
        return ViscousTerm(self.elements._replace(dofs=dofs))
