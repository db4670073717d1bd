"""The protocol of an equilibrium problem, on flat vectors of dofs.

With u (m,) all dofs and a load factor f, a path is the set of solutions of

    residual(u, f) = internal force - external force = 0  on the free dofs,
    u = prescribed(f)                                     on the held ones,

so a von Mises truss, a sheet of origami and a shell all look the same to a solver.

A state counts as an equilibrium if both conditions hold, with the fraction `tolerance` (1e-9 by
default):

- the residual's norm over the free dofs is below tolerance times the forces at play: the largest
  of the norms of the external forces, the support forces and the hinge forces alone (which bars
  balance if nothing is loaded, as in a sheet that unfolds without loads);
- the last step is below tolerance times the displacements.

Neither can be met below round-off. A residual below the rounding errors of the bar forces (eps
times the bars' EA) counts as zero, and so does the step, which is then noise as well.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

EPS = float(np.finfo(float).eps)


class Problem(Protocol):
    """Equilibrium of m dofs along a load factor.

    Attributes
    ----------
    free, held : ndarray of int
        The dofs solved for and the others, each in increasing order; together they are all dofs.
    force_rounding : float
        Norm (N) of the residual's rounding errors on the free dofs.
    length : float
        Norm (m) of the dofs' rest positions: the scale for rounding errors of displacements.
    """

    free: NDArray
    held: NDArray
    force_rounding: float
    length: float

    def prescribed(self, factor: float) -> NDArray:
        """Values of the held dofs; linear in the factor."""
        ...

    def residual(self, u: NDArray, factor: float) -> NDArray:
        """Internal minus external force (m,), N; on held dofs the support force."""
        ...

    def tangent(self, u: NDArray, factor: float, before: NDArray | None = None) -> Any:
        """Sparse (m, m) derivative of the residual, with vanishing slopes floored.

        Symmetric, except for loads without potential. Used only for steps and, its symmetric part,
        for the count of negative eigenvalues; the residual has no floor. With `before`, the
        state from which the last step came, it may be another matrix that serves the next step
        better; without, it is the derivative.
        """
        ...

    def rate(self, u: NDArray, factor: float) -> NDArray:
        """Derivative (m,) of the residual with respect to the factor at fixed u."""
        ...

    def reference(self, u: NDArray, factor: float) -> float:
        """Force (N) that residuals are compared with, besides the support forces."""
        ...

    def turn(self, u: NDArray, v: NDArray) -> float:
        """Largest turn (rad) of a part of the structure from u to v; inf if parts collide."""
        ...


def clear_share(problem: Problem, u: NDArray, step: NDArray) -> float:
    """Share of a step (m,) that can be taken before anything crosses; 1 without contact."""
    clear = getattr(problem, "clear", None)  # problems without contact have none
    return clear(u, step) if clear else 1.0


def is_counted(problem: Problem, u: NDArray) -> bool:
    """Whether negative eigenvalues in a state (m,) are meaningful: not if a node slips."""
    slips = getattr(problem, "slips", None)  # problems without friction have none
    return not (slips and slips(u))


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


def converged(problem: Problem, forces: Balance, u: NDArray, step: float, tolerance: float) -> bool:
    """Whether a state u, reached by a last step of norm `step`, is an equilibrium."""
    if not forces.residual < np.inf:  # false for nan
        return False
    if forces.residual <= problem.force_rounding:
        return True
    size = max(float(np.linalg.norm(u)), EPS * problem.length / tolerance)
    return forces.residual <= tolerance * forces.reference and step <= tolerance * size
