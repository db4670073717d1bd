"""The pencil K - s M: factorized at shifts, its eigenvalues counted.

A factorization at s has as many negative eigenvalues as K phi = lambda M phi has eigenvalues below
s (Sylvester's law of inertia). Two counts, below and above a set of computed modes, prove that
none between was missed. M is positive definite, but for dofs without mass that follow the others
(edge rotations of shells): they have no modes, and, K being positive definite on them, no count.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.solvers import factorizer
from foldyn.algebra.superlu import Factorization, SingularTangentError

EPS = float(np.finfo(float).eps)
ROUNDING = 5.0 * EPS  # of |phi|' |K| |phi|: how far from zero rounding may move an eigenvalue
NUDGES = 4  # of a shift that hits an eigenvalue
NUDGE = 1e-7


class Pencil:
    """Stiffness and mass (n, n) of free dofs, with the solver that factorizes K - s M."""

    def __init__(
        self, stiffness: sparse.csc_array, mass: sparse.csc_array, solver: str = "auto"
    ) -> None:
        self.stiffness, self.mass = stiffness, mass
        self.size = stiffness.shape[0]
        self.backend, self._factorize = factorizer(solver, self.size)
        self.factorizations = 0
        self.heavy = mass.diagonal() > 0.0
        self.finite = int(self.heavy.sum())  # number of modes
        self._sizes = abs(stiffness)

    @property
    def scale(self) -> float:
        """Mean of the diagonal of K over that of M, rad2/s2: large against the lowest modes."""
        stiffness = np.abs(self.stiffness.diagonal())[self.heavy]
        return float(stiffness.sum() / self.mass.diagonal().sum())

    def factorize(self, shift: float) -> Factorization:
        """Factors of K - s M; s is moved a little where that is singular."""
        for attempt in range(NUDGES):
            moved = shift + NUDGE * attempt * (abs(shift) or self.scale * EPS)
            self.factorizations += 1
            try:
                found = self._factorize(sparse.csc_array(self.stiffness - moved * self.mass))
                found.negative()
            except SingularTangentError:
                if attempt == NUDGES - 1:
                    raise
            else:
                return found
        raise AssertionError("unreachable")

    def below(self, shift: float) -> int:
        """How many eigenvalues lie below s."""
        return self.factorize(shift).negative()

    def noise(self, shapes: NDArray) -> NDArray:
        """What rounding leaves undetermined (k,) in the eigenvalues of shapes (n, k)."""
        size = np.abs(shapes)
        modal = np.einsum("ik,ik->k", shapes, self.mass @ shapes)
        return ROUNDING * np.einsum("ik,ik->k", size, self._sizes @ size) / modal

    def quotients(self, shapes: NDArray) -> NDArray:
        """Rayleigh quotients (k,) of shapes (n, k)."""
        modal = np.einsum("ik,ik->k", shapes, self.mass @ shapes)
        return np.einsum("ik,ik->k", shapes, self.stiffness @ shapes) / modal

    def residuals(self, values: NDArray, shapes: NDArray) -> NDArray:
        """|K phi - lambda M phi| over what its terms amount to (k,); nan for shapes of zeros."""
        inertia = (self.mass @ shapes) * values
        terms = np.linalg.norm(self._sizes @ np.abs(shapes), axis=0)
        return np.linalg.norm(self.stiffness @ shapes - inertia, axis=0) / terms
