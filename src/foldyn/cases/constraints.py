"""What ties the displacements of a case together: oblique supports, links and rigid panels.

All are linear equations G u = g with constant coefficients between the displacements u (3n,), in
which g is zero but for supports that move. They are met exactly, by elimination: solvers take the
vector x that `algebra.elimination` speaks of, u = E x, of which they solve for the free dofs. No
stiffness is added, and no unknown; what was symmetric and positive definite stays so.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.elimination import Elimination, eliminate
from foldyn.errors import InputError

STRUCTURE = "the rigid panels"  # owner of their equations
AGREES = 1e-9  # of displacements or lengths: how exactly equations must be met


class Equation(NamedTuple):
    """Sum of coefficients times dofs, the first dof being the one to solve for."""

    owner: str  # the support that asks for it, "supports[2]", or STRUCTURE
    dofs: Sequence[int]
    coefficients: Sequence[float] | NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Constraints:
    """Equations between the dofs of a case, m = 3 n of them; false if there are none.

    Vectors and matrices over all dofs may have more of them behind those of the nodes (those of a
    model's hidden dofs), which are left as they are.

    Parameters
    ----------
    equations : sequence of Equation
    held : ndarray of bool, shape (3n,)
        Dofs that supports hold along their axes.

    Attributes
    ----------
    free : ndarray of int
        Dofs that are neither held nor slaves, increasing: the unknowns.
    slaves : ndarray of int
        Dofs that the others determine.
    """

    equations: Sequence[Equation]
    held: NDArray

    def __bool__(self) -> bool:
        """Whether there are equations."""
        return len(self.equations) > 0

    @cached_property
    def owners(self) -> NDArray[np.str_]:
        """Who asks for each equation, (k,)."""
        return np.array([one.owner for one in self.equations], np.str_)

    @cached_property
    def rows(self) -> sparse.csr_array:
        """G, (k, 3n)."""
        starts = np.cumsum([0, *(len(one.dofs) for one in self.equations)])
        dofs = np.concatenate([np.zeros(0, np.int64), *(one.dofs for one in self.equations)])
        values = np.concatenate([np.zeros(0), *(one.coefficients for one in self.equations)])
        return sparse.csr_array(
            (values, dofs.astype(np.int64), starts), (len(self.equations), len(self.held))
        )

    @cached_property
    def _solved(self) -> Elimination:
        return eliminate(self.rows, self.held)

    @property
    def slaves(self) -> NDArray[np.int64]:
        """See the class."""
        return self._solved.slaves

    @cached_property
    def free(self) -> NDArray[np.int64]:
        """See the class."""
        taken = self.held.copy()
        if self:
            taken[self.slaves] = True
        return np.flatnonzero(~taken).astype(np.int64)

    @property
    def basis(self) -> sparse.csr_array:
        """E (3n, 3n)."""
        return self._solved.basis

    @cached_property
    def determined(self) -> NDArray[np.bool_]:
        """Whether each node (n, 3) is held along each axis, or follows others."""
        mask = np.ones(len(self.held), bool)
        mask[self.free] = False
        return mask.reshape(-1, 3)

    def with_held(self, dofs: NDArray) -> Constraints:
        """The same with further dofs held."""
        held = self.held.copy()
        held[dofs] = True
        return Constraints(self.equations, held) if len(dofs) else self

    def slaves_of(self, owners: Collection[str]) -> NDArray[np.int64]:
        """Slaves of the equations of some owners."""
        if not self:
            return np.zeros(0, np.int64)
        return self.slaves[np.isin(self.owners[self._solved.kept], list(owners))]

    # ------------------------------------------------------------------ vectors and matrices
    def displacement(self, x: NDArray) -> NDArray:
        """u = E x of vectors (m,) or (m, k)."""
        if not self:
            return x
        count = len(self.held)
        return np.concatenate([self.basis @ x[:count], x[count:]])

    def coordinates(self, u: NDArray) -> NDArray:
        """x of displacements u (m,): the values of their equations in place of the slaves."""
        if not self:
            return u
        x = u.copy()
        x[self.slaves] = self.rows[self._solved.kept] @ u[: len(self.held)]
        return x

    def rows_on_dofs(self, rows: NDArray) -> NDArray:
        """Rows (r, m) that multiply x, as they multiply the displacements u of that x."""
        if not self:
            return rows
        out, count = rows.copy(), len(self.held)
        out[:, self.slaves] = 0.0
        out[:, :count] += rows[:, self.slaves] @ self.rows[self._solved.kept]
        return out

    def force(self, force: NDArray) -> NDArray:
        """E' f of forces (m,) or (m, k), N."""
        if not self:
            return force
        count = len(self.held)
        return np.concatenate([self.basis.T @ force[:count], force[count:]])

    def largest(self, force: NDArray) -> NDArray:
        """E' f with all signs positive: how large forces of the sizes f (m,) may become, N."""
        if not self:
            return force
        count = len(self.held)
        return np.concatenate([abs(self.basis).T @ force[:count], force[count:]])

    def matrix(self, matrix: sparse.csr_array) -> sparse.csr_array:
        """E' K E of a matrix (m, m)."""
        if not self:
            return matrix
        basis = self.extended(matrix.shape[0])
        return sparse.csr_array(basis.T @ matrix @ basis)

    def extended(self, size: int) -> sparse.csr_array:
        """E of so many dofs (m, m)."""
        more = size - len(self.held)
        if not more:
            return self.basis
        return sparse.csr_array(sparse.block_diag([self.basis, sparse.eye_array(more)]))

    def values(self, u: NDArray) -> NDArray:
        """G u of displacements u (n, 3): the values (k,) of the equations, m."""
        return self.rows @ u.ravel()

    @cached_property
    def along(self) -> NDArray[np.bool_]:
        """Whether each equation (k,) is that of a support along a direction."""
        return np.array([_is_direction(one) for one in self.equations], bool)

    # ------------------------------------------------------------------ supports that move
    def moved(self, shape: NDArray, values: NDArray, place: str) -> NDArray:
        """Displacements (n, 3) while held dofs move as in `shape` (n, 3) and the others stand.

        Parameters
        ----------
        shape : ndarray, shape (n, 3)
        values : ndarray, shape (k,)
            Of the equations, m.
        place : str
            What moves, for messages.

        Raises
        ------
        InputError
            An equation that the others determine contradicts them.
        """
        if not self:
            return shape
        x = shape.ravel().copy()
        x[self.slaves] = values[self._solved.kept]
        u = self.basis @ x
        gap = np.abs(self.rows @ u - values)
        if gap.max() > AGREES * np.abs(u).max(initial=np.abs(values).max()):
            raise InputError(
                f"{place}: what it moves cannot follow, because of {self.owners[gap.argmax()]}; "
                "leave out one of the two"
            )
        return u.reshape(shape.shape)

    # ------------------------------------------------------------------ reactions
    @cached_property
    def supported(self) -> NDArray[np.int64]:
        """Dofs (s,) on which supports exert forces, increasing: held ones, those of directions."""
        return np.union1d(np.flatnonzero(self.held), self._along).astype(np.int64)

    @cached_property
    def _along(self) -> NDArray[np.int64]:
        """Dofs on which supports act along a direction."""
        return np.unique(
            [dof for one in self.equations if _is_direction(one) for dof in one.dofs]
        ).astype(np.int64)

    @cached_property
    def reactions(self) -> sparse.csr_array:
        """What supports exert (s, 3n) on `supported` dofs, from forces that act on all."""
        size = len(self.held)
        own = sparse.diags_array(self.held.astype(float))
        if not self:
            return sparse.csr_array(sparse.csr_array(own)[self.supported])
        kept = [self.equations[k] for k in self._solved.kept]
        straight = np.array([float(_is_direction(one)) for one in kept])
        put = sparse.csr_array(
            (straight, (np.arange(len(kept)), self.slaves)), (len(kept), size)
        )  # the multipliers of directions
        exerted = own + self.rows[self._solved.kept].T @ put
        return sparse.csr_array((sparse.csr_array(exerted) @ self.basis.T)[self.supported])


def _is_direction(equation: Equation) -> bool:
    """Whether an equation is of one node alone, which those of links and panels never are."""
    return len({dof // 3 for dof in equation.dofs}) == 1
