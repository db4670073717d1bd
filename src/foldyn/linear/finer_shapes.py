"""Small motions of superelements with the shapes for stresses, which follow those of their level.

With x the motion on the dofs of the level, embedded in those of the finer shapes, the finer motion
y is the static response to the loads and to the inertia and damping of x:

    K y = f + w^2 M x - i w C x .

So it has the resonances of x, and the shapes that the level lacks are in balance. Bodies that are
free to move take K - s M in place of K, and w^2 - s in place of w^2, with s below 0. In a motion
over time x'' is in place of -w^2 x, and x' in place of i w x.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.eigen import Pencil
from foldyn.cases import Case, History
from foldyn.dynamics.superposition import Superposition, matrices
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
        own: Any = self._coarse.case.structure
        edges, whole = self.case.held_edges, self._coarse.whole(motions)
        return own.embedded(self.case.structure, whole, edges=edges)[self._fine.free]

    def _solved(self, loads: NDArray) -> NDArray:
        if not np.iscomplexobj(loads):
            return self._factors.solve(np.ascontiguousarray(loads))
        return self._solved(np.real(loads)) + 1j * self._solved(np.imag(loads))


class FinerMotion:
    """The motion of a superposition on the dofs of the finer shapes, in balance with it."""

    def __init__(self, case: Case, equation: Superposition, varying: list[History]) -> None:
        self.case = for_stresses(case)
        own: Any = case.structure
        fine, self._equation = matrices(self.case, varying), equation
        both = own.embedded(self.case.structure, equation.both, edges=case.held_edges)
        ties = fine.ties
        stiffness, mass = (
            sparse.csc_array(ties.T @ one @ ties) for one in (fine.stiffness, fine.mass)
        )
        pencil = Pencil(stiffness, mass)
        shift = -BELOW * pencil.scale if len(equation.basis.rigid) else 0.0
        factors = pencil.factorize(shift)

        def moved(forces: NDArray) -> NDArray[np.float64]:
            """Static motions (m, k) under forces (m, k)."""
            return ties @ factors.solve(np.ascontiguousarray(ties.T @ forces))

        pulled = fine.load - fine.turned - fine.stiffness @ fine.support
        carried = moved(fine.mass @ both)
        self._acting = fine.support + moved(pulled)
        self._motion = np.hstack([-shift * carried, -moved(fine.damped(both)), -carried])

    def at(self, states: Iterator[NDArray]) -> Iterator[tuple[NDArray, NDArray]]:
        """All displacements (m,), m, and second derivatives (h,) of the histories, in states."""
        place_of_factors, count = self._equation.factors, self._acting.shape[1]
        for z in states:
            place, rate, gain = self._equation.amplitudes(z)
            y = self._acting @ z[place_of_factors]
            yield y + self._motion @ np.concatenate([place, rate, gain]), gain[-count - 1 : -1]
