"""Small motions of superelements with the shapes for stresses, which follow those of their level.

With x the motion on the dofs of the level, embedded in those of the finer shapes, the finer motion
y is the static response to the loads and to the inertia and damping of x:

    K y = f + w^2 M x - i w C x .

So it has the resonances of x, and the shapes that the level lacks are in balance. Bodies that are
free to move take K - s M in place of K, and w^2 - s in place of w^2, with s below 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.algebra.eigen import Pencil
from foldyn.condensation import Superelements
from foldyn.linear.excitation import Drive, drive_terms
from foldyn.linear.frequency_domain import damped
from foldyn.linear.linearized import Linearized, linearize
from foldyn.linear.modes import rigid_space, unresisted
from foldyn.strength.resultants import for_stresses

BELOW = 1e-6  # shift of a free body, relative to the scale of its squared frequencies


class FinerShapes:
    """A linearized case of superelements beside the one with the shapes for stresses."""

    def __init__(self, system: Linearized) -> None:
        self._coarse, self.case = system, for_stresses(system.case)
        self._fine = fine = linearize(self.case)
        pencil = Pencil(fine.stiffness, fine.mass)
        free = unresisted(fine, rigid_space(fine)).shape[1] > 0
        self._shift = -BELOW * pencil.scale if free else 0.0
        self._factors = pencil.factorize(self._shift)

    def modes(self, values: NDArray, shapes: NDArray) -> NDArray[np.float64]:
        """Motions (m, k) of modes with eigenvalues (k,) and shapes (nf, k) of the level."""
        inertia = self._fine.mass @ self._embedded(shapes)
        return self._fine.whole(self._solved((values - self._shift) * inertia))

    def driven(self, drive: Drive, frequency: NDArray, response: NDArray) -> NDArray:
        """Motions (m, k) of responses (nf, k) of the level, per unit of a drive."""
        moved, terms = self._embedded(response), drive_terms(self._fine, drive)
        loads = np.zeros(moved.shape, complex)
        for k, omega in enumerate(2.0 * np.pi * frequency):
            loads[:, k] = sum(term.shape * term.factor(omega) for term in terms)
            loads[:, k] += (omega**2 - self._shift) * (self._fine.mass @ moved[:, k])
            loads[:, k] -= damped(self._fine, omega, moved[:, k])
        return self._fine.whole(self._solved(loads))

    def _embedded(self, motions: NDArray) -> NDArray:
        """Motions (nf, k) of the level on the free dofs of the finer shapes."""
        own, finer = self._coarse.case.structure, self.case.structure
        assert isinstance(own, Superelements)
        assert isinstance(finer, Superelements)
        whole = own.embedded(finer, self._coarse.whole(motions), edges=self.case.held_edges)
        return whole[self._fine.free]

    def _solved(self, loads: NDArray) -> NDArray:
        if not np.iscomplexobj(loads):
            return self._factors.solve(np.ascontiguousarray(loads))
        return self._solved(np.real(loads)) + 1j * self._solved(np.imag(loads))
