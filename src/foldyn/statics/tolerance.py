"""When a state counts as an equilibrium.

Both must hold, with `tolerance` the same fraction (1e-9 unless set otherwise):

- the residual's norm over the free dofs is below tolerance times the forces at play: the largest
  of the norms of the external forces, of the supports' forces and of the hinges' forces alone
  (which bars balance where nothing is loaded, as in a sheet that unfolds by itself);
- the last step is below tolerance times the displacements.

Neither can be met below rounding. A residual below the rounding errors of the bars' forces (eps
times the bars' EA) counts as zero, and with it the step, which then is noise as well.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.statics.problem import Problem

EPS = float(np.finfo(float).eps)


class Balance(NamedTuple):
    """How far a state is from equilibrium."""

    residual: float  # norm on the free dofs, N
    reference: float  # norm of the forces at play, N

    @property
    def relative(self) -> float:
        """Residual as a fraction of the forces at play; 0 where both vanish."""
        return self.residual / self.reference if self.reference > 0.0 else 0.0


UNKNOWN = Balance(float("nan"), float("nan"))


def balance(problem: Problem, u: NDArray, factor: float, residual: NDArray) -> Balance:
    """Measure a residual (m,) against the forces at play."""
    reference = max(problem.reference(u, factor), float(np.linalg.norm(residual[problem.held])))
    return Balance(float(np.linalg.norm(residual[problem.free])), reference)


def converged(problem: Problem, found: Balance, u: NDArray, step: float, tolerance: float) -> bool:
    """Whether a state u reached by a last step of norm `step` is an equilibrium."""
    if not found.residual < np.inf:  # false for nan
        return False
    if found.residual <= problem.force_rounding:
        return True
    size = max(float(np.linalg.norm(u)), EPS * problem.length / tolerance)
    return found.residual <= tolerance * found.reference and step <= tolerance * size
