"""Mean strains of a repeated sheet, and the energy of a cell that is relaxed under them.

Under mean strains all cells deform alike, but for a rigid motion of each: with w and t linear in R,
the power of exp(w, a + t) that takes cell 0 to cell R moves its points x by

    w x (x - a) + t + w x a / 2,

a the shift of the cell. The mean curvature of a plate turns cell R by w = n x (kappa a), a beam by
R times its twist and curvature per cell. Only the elements of one cell count for the energy, and
its second derivative is exact: internal forces in the state do work in terms of second order.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.errors import InputError
from foldyn.linear.linearized import slope_change
from foldyn.linear.linearized_cell import LinearizedCell

LEFT = 1e-6  # largest force that relaxing leaves, relative to the forces of the mean strains,
ROUNDING = 1e-12  # and, of a unit strain, to the stiffest dof


class MeanStrains(NamedTuple):
    """Rigid motions of s cells per unit of p mean strains.

    Attributes
    ----------
    turn, move : (s, p, 3)
        w (rad) and t (m).
    shift : (s, 3)
        a, m.
    """

    turn: NDArray
    move: NDArray
    shift: NDArray

    def __matmul__(self, combined: NDArray) -> MeanStrains:
        """Rigid motions of combinations (p, c) of the strains."""
        turn, move = (np.einsum("spx,pc->scx", each, combined) for each in (self.turn, self.move))
        return MeanStrains(turn, move, self.shift)

    def at(self, number: NDArray, points: NDArray) -> NDArray:
        """Displacements (n, p, 3) of points (n, 3), m, of the cells with these numbers (n,)."""
        turn, shift = self.turn[number], self.shift[number][:, None]
        return np.cross(turn, points[:, None] - 0.5 * shift) + self.move[number]

    def second(self, number: NDArray, points: NDArray, force: NDArray) -> NDArray:
        """Work (p, p), J, of forces (n, 3) in second derivatives of the displacements."""
        turn, move, shift = self.turn[number], self.move[number], self.shift[number][:, None]
        moved = np.cross(turn, points[:, None] - shift * 2.0 / 3.0) + move
        # f . w x v = (f x w) . v
        total = np.einsum("npx,ncx->pc", np.cross(force[:, None], turn.conj()), moved)
        return 0.5 * (total + total.conj().T)


class CellEnergy:
    """The energy of one cell's elements, to second order in its dofs and in mean strains.

    Attributes
    ----------
    points : (n, 3)
        Nodes of the patch in the state, m.
    mass : (k,)
        Masses of the nodes of a cell, kg.
    center : (3,)
        Their center, m.

    Parameters
    ----------
    linear : LinearizedCell
    amplitude : float or None
        Amplitude (rad) of superlinear hinges that `linear` has.
    """

    def __init__(self, linear: LinearizedCell, amplitude: float | None) -> None:
        reach, size = linear.reach, 3 * len(linear.patch.unit)
        self._reach, self._bloch, self._number = reach, linear.bloch, reach.number
        body = reach.body.anchored(reach.number - np.flatnonzero((reach.steps == 0).all(axis=1)))
        change, _ = slope_change(linear.patch.case, body, linear.dofs, amplitude)
        tangent = body.tangent(linear.dofs)
        self._tangent = tangent if change is None else sparse.csr_array(tangent + change)
        self._force = body.internal(linear.dofs)[:size].reshape(-1, 3)
        self.points = linear.patch.case.structure.nodes + linear.dofs[:size].reshape(-1, 3)
        self._cell = reach.number[:size:3]
        own = linear.patch.own_nodes
        self.mass = linear.patch.case.mass[own].sum(axis=1)
        self.center = self.mass @ self.points[own] / self.mass.sum()
        self._weight = np.zeros((reach.count, 1))
        self._weight[: 3 * len(own), 0] = np.repeat(self.mass / self.mass.sum(), 3)

    def displacements(self, strains: MeanStrains) -> NDArray:
        """Displacements (k, p) of all dofs of the patch that move with the cells alone."""
        hidden = self._number[self.points.size :]
        rotated = self._reach.body.sheet.rotated
        if rotated is None:
            rotated = np.zeros((len(hidden), 3))
        behind = np.einsum("hx,hpx->hp", rotated, strains.turn[hidden])
        return np.concatenate([by_dof(strains.at(self._cell, self.points)), behind])

    def rigid(self, turn: NDArray, move: NDArray) -> NDArray:
        """Motions (m, r) of cell 0 with rotations (r, 3), rad, and displacements at the origin."""
        cells = len(self._reach.steps)
        turn, move = (np.broadcast_to(each, (cells, *each.shape)) for each in (turn, move))
        whole = self.displacements(MeanStrains(turn, move, np.zeros((cells, 3))))
        return whole[self._reach.rows]

    def loads(self, strains: MeanStrains) -> NDArray[np.float64]:
        """Derivatives (p,) of the energy in the state, J, by mean strains."""
        return np.einsum("nx,npx->p", self._force, strains.at(self._cell, self.points))

    def stiffness(self, strains: MeanStrains, phase: NDArray, rigid: NDArray) -> NDArray:
        """Second derivatives (p, p), J, by mean strains under which the cell is relaxed.

        phase : phases (d,) of the displacements from cell to cell, in the axes of these.
        rigid : motions (m, r) of cell 0 that have these phases and strain nothing.
        """
        factors = self._bloch.factors(phase)
        copies = self._reach.copies(factors if phase.any() else factors.real)
        field = self.displacements(strains)
        pull = self._tangent @ field
        turned = pull.copy()  # with the forces in the state, which turn with the cells
        turned[: self.points.size] += by_dof(
            np.cross(self._force[:, None], strains.turn[self._cell])
        )
        push = copies.conj().T @ turned
        inner = sparse.csc_array(copies.conj().T @ self._tangent @ copies)
        eased = _solved(inner, push, self._weight * rigid)
        second = strains.second(self._cell, self.points, self._force)
        whole = field.conj().T @ pull + second + push.conj().T @ eased
        return 0.5 * (whole + whole.conj().T)


def by_dof(vectors: NDArray) -> NDArray:
    """Vectors (n, p, 3) as columns (3n, p)."""
    return vectors.transpose(0, 2, 1).reshape(-1, vectors.shape[1])


def _solved(matrix: sparse.csc_array, push: NDArray, rigid: NDArray) -> NDArray:
    """Displacements (m, p) that balance -push, with the means `rigid`' u = 0 (m, r)."""
    scale, count = float(abs(matrix.diagonal()).max()), rigid.shape[1]
    border = sparse.csc_array(scale * rigid)
    whole = sparse.csc_array(sparse.block_array([[matrix, border], [border.conj().T, None]]))
    load = -np.concatenate([push, np.zeros((count, push.shape[1]))]).astype(whole.dtype)
    try:
        found = splu(whole).solve(load)
    except RuntimeError:  # a zero pivot
        found = np.full_like(load, np.nan)
    left = np.abs(whole @ found - load).max(axis=0)
    if not (left <= LEFT * np.abs(load).max(axis=0) + ROUNDING * scale).all():
        raise InputError(
            ": parts of it can move without any force, as bends of the superlinear law can at "
            "rest, so that its stiffness is not defined; give creases and bends a stiffness, or "
            "superlinear ones a secant amplitude",
            "cell",
        )
    return found[: len(push)]
