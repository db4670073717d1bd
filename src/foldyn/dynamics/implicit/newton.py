"""Newton's method for the end of a step.

The matrix is made anew in each iteration, unless the residual falls fast with the last one: panels
that turn within a step move the directions of their stiff bars, and with the old directions the
iteration soon converges slowly or not at all. Iterations whose matrix is kept cost a force and a
substitution each.
"""

from __future__ import annotations

import numpy as np

from foldyn.algebra.superlu import SingularTangentError
from foldyn.dynamics.implicit.convergence import (
    GO_ON,
    NEW_MATRIX,
    NOT_CONVERGED,
    SOLVED,
    Goal,
    judge,
)
from foldyn.dynamics.implicit.matrix import StepMatrix
from foldyn.dynamics.implicit.scheme import Scheme

MOST = 25  # iterations
SAME_STEP = 1e-3  # relative difference of steps that may share a matrix


class Newton:
    """Newton's method with the matrix that it keeps from one step to the next."""

    def __init__(self, scheme: Scheme, matrix: StepMatrix) -> None:
        self.scheme, self.matrix = scheme, matrix
        self.iterations = 0
        self.evaluations = 0
        self._h = 0.0  # of the last factorization
        self._lasting = False  # whether a matrix served a whole step: the next one begins with it

    def prepare(self, h: float, t: float) -> None:
        """Have everything compiled that a step needs."""
        scheme, bench = self.scheme, self.scheme.bench
        bench.shift[:] = 0.0
        scheme.residual(h, t)
        scheme.tangent(self.matrix, bench.displacement(), False)
        scheme.works(h)

    def renew(self, h: float) -> bool:
        """Make the matrix of a step h (s) from its start; tells whether it could be factorized."""
        self.scheme.tangent(self.matrix, self.scheme.bench.displacement(), False)
        try:
            self.matrix.factorize(self.scheme.weights(h))
        except SingularTangentError:
            return False
        self._h = h
        return True

    def solve(self, h: float, t: float) -> int:
        """Move bench.shift from its prediction to equilibrium at the end t of a step h (s).

        Returns `SOLVED`, or why not.
        """
        scheme, bench, matrix = self.scheme, self.scheme.bench, self.matrix
        goal = Goal(scheme.tolerance, bench.hinge_forces(), bench.rounding)
        kept = self._lasting and abs(h - self._h) < SAME_STEP * h
        last, lowest, left, made = np.inf if kept else 0.0, np.inf, MOST, matrix.factorizations
        before, again = bench.displacement().copy(), False
        while left > 0:
            found, norm, steps = self._keep_on(goal, h, t, last, lowest, left)
            self.iterations += steps
            self.evaluations += steps + 1
            left, again = left - steps, again or steps > 0
            if found != NEW_MATRIX:
                self._lasting = found == SOLVED and matrix.factorizations <= made + 1
                return found
            lowest = min(lowest, norm)
            if again:
                before = bench.carried(bench.earlier, bench.new.factor)
            scheme.tangent(matrix, before, again)
            try:
                matrix.factorize(scheme.weights(h))
            except SingularTangentError:
                break
            self._h, last, again = h, norm, True
            bench.earlier[:] = bench.new.q
            bench.shift -= matrix.solve(bench.out, bench.step)
            self.iterations += 1
            left -= 1
        self._lasting = False
        return NOT_CONVERGED

    def _keep_on(
        self, goal: Goal, h: float, t: float, last: float, lowest: float, most: int
    ) -> tuple[int, float, int]:
        """Iterate with the matrix as it is; returns what was found, the residual, and how often."""
        scheme, bench = self.scheme, self.scheme.bench
        if self.matrix.band is not None:
            whole = scheme.keep_on(self.matrix, goal, h, t, last, lowest, most)
            if whole is not None:
                return whole
        norm = np.inf
        for steps in range(most):
            norm, reference = scheme.residual(h, t)
            found = judge(goal, norm, reference, last, lowest)
            if found != GO_ON:
                return found, norm, steps
            lowest, last = min(lowest, norm), norm
            bench.earlier[:] = bench.new.q
            bench.shift -= self.matrix.solve(bench.out, bench.step)
        return NOT_CONVERGED, norm, most
