"""The first point of a path: equilibrium near a given state.

A state that is not in equilibrium (under loads that are constant along the path, with folds that
have a moment at rest, or simply a guess) is held by its own out-of-balance force, which is then
let go little by little: the same load stepping as along a path leads to the equilibrium that
belongs to the state, instead of wherever one big step of Newton's method lands.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.statics.newton import Attempt, Solver
from foldyn.statics.problem import Problem
from foldyn.statics.station import PathStoppedError, Station, arrive
from foldyn.statics.stepping import walk
from foldyn.statics.tolerance import balance


class Released:
    """A problem at one load factor; its out-of-balance force fades as this one's factor grows."""

    def __init__(self, problem: Problem, u: NDArray, factor: float) -> None:
        self.problem, self.factor = problem, factor
        self.free, self.held = problem.free, problem.held
        self.force_rounding, self.length = problem.force_rounding, problem.length
        self._from = u[problem.held]
        self._to = problem.prescribed(factor)
        self._out = problem.residual(u, factor)
        self._out[problem.held] = 0.0

    def prescribed(self, factor: float) -> NDArray:
        """From where the held dofs stood to where they belong."""
        return self._from + factor * (self._to - self._from)

    def residual(self, u: NDArray, factor: float) -> NDArray:
        """Residual less what is still held."""
        return self.problem.residual(u, self.factor) - (1.0 - factor) * self._out

    def tangent(self, u: NDArray, factor: float, before: NDArray | None = None) -> Any:
        """Tangent of the problem."""
        return self.problem.tangent(u, self.factor, before)

    def rate(self, u: NDArray, factor: float) -> NDArray:
        """Derivative of the residual."""
        return self._out

    def reference(self, u: NDArray, factor: float) -> float:
        """Forces at play in the problem."""
        return self.problem.reference(u, self.factor)

    def turn(self, u: NDArray, v: NDArray) -> float:
        """Turn in the problem."""
        return self.problem.turn(u, v)


def settle(solver: Solver, u: NDArray, factor: float) -> Station:
    """Station at the equilibrium at a load factor that belongs to a state (m,).

    Raises
    ------
    PathStoppedError
        None was found.
    """
    problem = solver.problem
    moved = not np.array_equal(u[problem.held], problem.prescribed(factor))
    found = balance(problem, u, factor, problem.residual(u, factor))
    still = found.residual <= max(
        problem.force_rounding, solver.settings.tolerance * found.reference
    )
    if still and not moved:
        return arrive(solver, Attempt(u, factor, 0, found))
    released = Solver(Released(problem, u, factor), solver.settings)
    released.tally = solver.tally
    at_rest = balance(released.problem, u, 0.0, released.problem.residual(u, 0.0))
    try:
        *_, last = walk(released, arrive(released, Attempt(u, 0.0, 0, at_rest)), [1.0], False)
    except PathStoppedError as stop:
        raise PathStoppedError(
            f"no equilibrium was found at the load factor {factor:.6g} from the state given",
            "start from a state nearer to it, or apply what is constant along the path in "
            f"smaller steps ({stop.reason})",
        ) from None
    attempt = solver.correct(last.point.u, factor)
    if attempt.failure:
        raise PathStoppedError(
            f"the first point at the load factor {factor:.6g} did not settle ({attempt.failure})",
            "start from another state",
        )
    return arrive(solver, attempt)
