"""Newton's method for the end of a step.

The matrix is made anew in each iteration, unless the residual falls fast with the last one: panels
that turn within a step move the directions of their stiff bars, and with the old directions the
iteration soon converges slowly or not at all. Increments of a step whose matrix is kept cost a
force and a substitution each.
"""

from __future__ import annotations

from enum import Enum

import numpy as np

from foldyn.dynamics.implicit.matrix import StepMatrix
from foldyn.dynamics.implicit.scheme import Scheme
from foldyn.statics.linear_solver import SingularTangentError

MOST = 25  # iterations
FAST = 0.3  # share of the residual that an iteration leaves, below which its matrix is kept
SAME_STEP = 1e-3  # relative difference of steps that may share a matrix
GROWTH = 1e8  # of the residual, at which the iteration has lost its way
# what is left where the residual no longer falls: rounding, if it is below one of these
ENOUGH = 1e-8  # of the forces at play
ROUNDING = 8.0  # times the rounding of the bars' forces
STALL = 0.5  # share of the residual that an iteration leaves, above which it does not fall


class Found(Enum):
    """What became of a step."""

    YES = 0
    NOT_CONVERGED = 1
    NOT_FINITE = 2


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

    def solve(self, h: float, t: float) -> Found:
        """Move bench.shift from its prediction to equilibrium at the end t of a step h (s)."""
        scheme, bench = self.scheme, self.scheme.bench
        u0 = bench.displacement()
        least_force = bench.hinge_forces()
        before, last, fresh, started = u0, np.inf, False, np.inf
        kept = self._lasting and abs(h - self._h) < SAME_STEP * h
        made = self.matrix.factorizations
        for iteration in range(MOST):
            norm, reference = scheme.residual(h, t)
            self.evaluations += 1
            if not norm < np.inf:
                return Found.NOT_FINITE
            reference = max(reference, least_force)
            enough = max(ENOUGH * reference, ROUNDING * bench.rounding)
            if norm <= scheme.tolerance * reference or (norm <= enough and norm > STALL * last):
                self._lasting = self.matrix.factorizations <= made + 1
                return Found.YES
            started = norm if iteration == 0 else started
            if norm > GROWTH * started:
                return Found.NOT_CONVERGED
            if iteration > 0 and norm > FAST * last:
                kept = False
            if not kept:
                scheme.tangent(self.matrix, before, fresh)
                try:
                    self.matrix.factorize(scheme.weights(h))
                except SingularTangentError:
                    return Found.NOT_CONVERGED
                self._h, kept = h, True
            before, fresh, last = bench.moved().copy(), True, norm
            bench.shift -= self.matrix.solve(bench.out, bench.step)
            self.iterations += 1
        return Found.NOT_CONVERGED
