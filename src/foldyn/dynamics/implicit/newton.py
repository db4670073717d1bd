"""Newton's method for the end of a step.

The matrix is updated in each iteration unless the residual falls fast with the last matrix. Panels
that turn within a step change the directions of their stiff bars; with outdated directions the
iteration converges slowly or not at all. An iteration that reuses the matrix costs one force
evaluation and one substitution.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from foldyn.algebra.superlu import SingularTangentError
from foldyn.dynamics.implicit.matrix import StepMatrix
from foldyn.dynamics.implicit.scheme import NEW_MATRIX, NOT_CONVERGED, SOLVED, Scheme

MOST = 25  # largest number of iterations
SAME_STEP = 1e-3  # relative difference of steps that may share a matrix


class Newton:
    """Newton's method with a matrix that may be reused in later steps.

    Attributes
    ----------
    origin : tuple of ndarray
        State in which the matrix was made: the step h, and the arguments of `Scheme.back`. Empty
        without a matrix.
    """

    def __init__(self, scheme: Scheme, matrix: StepMatrix) -> None:
        self.scheme, self.matrix = scheme, matrix
        self.iterations = 0
        self.evaluations = 0
        self._h = 0.0  # step of the last factorization, s
        self.origin: tuple[NDArray, ...] = ()
        self._lasting = False  # whether one matrix served a whole step; the next step reuses it

    def prepare(self, h: float, t: float) -> None:
        """Compile everything that a step needs."""
        scheme = self.scheme
        offset = scheme.packed.system.actuators.offset
        before = offset[:, 2:].copy()  # offsets at the last accepted step
        scheme.shift[:] = 0.0
        scheme.residual(h, t)
        scheme.tangent(self.matrix, scheme.displacement(), False)
        scheme.works(h)
        offset[:, 2:] = before

    def renew(self, h: float) -> bool:
        """Make the matrix of a step h (s) at its start; return whether it could be factorized."""
        try:
            self._make(h, self.scheme.displacement(), False)
        except SingularTangentError:
            return False
        return True

    def _make(self, h: float, before: NDArray, again: bool) -> None:
        """Make the matrix of a step h (s); see `Scheme.tangent`."""
        self.origin = ()
        self.scheme.tangent(self.matrix, before, again)
        self.matrix.factorize(self.scheme.weights(h))
        self._h, self.origin = h, (np.array([h, again]), before.copy(), *self.scheme.origin())

    def remake(self) -> None:
        """Factorize the matrix again, from the blocks of the last update."""
        self.matrix.factorize(self.scheme.weights(self._h))

    def numbers(self) -> list[NDArray]:
        """Numbers that the next step depends on: the origin of its first matrix, if reused."""
        kept = self._lasting and len(self.origin) > 0
        rest = (np.zeros(2), self.scheme.shift, *self.scheme.origin())
        origin = self.origin if kept else [np.zeros_like(array) for array in rest]
        return [np.array([float(kept)]), *origin]

    def resume(self, numbers: Sequence[NDArray]) -> None:
        """Move the scheme to the state that `numbers` describe, and make the matrix again."""
        (kept,), (h, again), before, *origin = numbers
        if kept:
            self.scheme.back(h, origin)
            self._make(h, before, bool(again))
        self._lasting = bool(kept)

    def solve(self, h: float, t: float) -> int:
        """Move scheme.shift from the prediction to equilibrium at the end t (s) of a step h (s).

        Returns `SOLVED`, or the code of the reason for failure.
        """
        scheme, matrix = self.scheme, self.matrix
        goal = scheme.goal(h)
        kept = self._lasting and abs(h - self._h) < SAME_STEP * h
        last, lowest, left, made = np.inf if kept else 0.0, np.inf, MOST, matrix.factorizations
        before, again = scheme.displacement().copy(), False
        while left > 0:
            verdict, norm, steps = scheme.iterate(matrix, goal, h, t, last, lowest, left)
            self.iterations += steps
            self.evaluations += steps + 1
            left, again = left - steps, again or steps > 0
            if verdict != NEW_MATRIX:
                self._lasting = verdict == SOLVED and matrix.factorizations <= made + 1
                return verdict
            lowest = min(lowest, norm)
            if again:
                before = scheme.carried(scheme.earlier, scheme.new.factor)
            try:
                self._make(h, before, again)
            except SingularTangentError:
                break
            last, again = norm, True
            scheme.earlier[:] = scheme.new.q
            scheme.shift -= matrix.solve(scheme.out, scheme.step)
            self.iterations += 1
            left -= 1
        self._lasting = False
        return NOT_CONVERGED
