"""Newton's method for one equilibrium, with line search and an optional moving load factor.

Let u (m,) be the vector of all dofs and f the load factor. A path is the set of solutions of

    residual(u, f) = internal force - external force = 0  on the free dofs,
    u = prescribed(f)                                     on the held dofs,

so a von Mises truss, a sheet of origami and a shell all look the same to a solver.

Each iteration solves K a = -residual with the held dofs at their prescribed values. If a rule lets
the load factor f move too, it also solves K b = -d residual/df (the response to the factor): the
step is a + df b, with df from the rule (Batoz and Dhatt, Int. J. Numer. Meth. Eng. 14, 1979).
Without a rule the factor is fixed.

Steps are cut if a part would turn by more than `MOST_TURN` or run into another. With `search`, they
are also cut until the residual along the step is at most half its initial value, as in Crisfield's
line search. Plain steps are tried first: the residual of a sheet often grows once before it
vanishes, because bars stretch to second order as panels turn.

A state counts as an equilibrium if both conditions hold, with the fraction `tolerance` (1e-9 by
default):

- the residual's norm on the free dofs is below tolerance times the forces at play. These are
  measured by the largest of three norms: of the external forces, of the support forces, and of the
  hinge forces (in a sheet that unfolds without loads, only the bars balance the hinge forces);
- the last step is below tolerance times the displacements.

Neither condition can be met below round-off. A residual below the rounding errors of the bar forces
(eps times the bars' EA) counts as zero; the last step is then noise too, and also counts as zero.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.reduction import Reduction
from foldyn.algebra.solvers import factorizer
from foldyn.algebra.superlu import Factorization, SingularTangentError, Solution, unsymmetric
from foldyn.arguments import Check, Checked, Flag
from foldyn.errors import InputError
from foldyn.values import choice, number, whole

COLLIDES = "panel would pass through panel"
MOST_TURN = 0.2  # rad, largest turn of any part within one iteration
HALVINGS = 40  # most halvings of a step to avoid collisions
TRIALS = 10  # most trials of a line search
STALL = 10  # iterations without progress of the residual after which an attempt is given up
SLACK = 0.5  # a line search ends below this fraction of the initial residual along the step
SHIFT = 1e-13  # shift of a tangent singular to round-off, as a fraction of its mean diagonal

S = TypeVar("S", bound=Solution)
# function of (motion since the start of the step, a, b) that returns df; nan if it cannot be met
Rule = Callable[[NDArray, NDArray, NDArray], float]
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
        """Sparse (m, m) derivative of the residual, with vanishing slopes raised to a floor.

        Symmetric, except for loads without potential. Used only for steps, and its symmetric part
        to count negative eigenvalues; the residual has no such floor. Given `before`, the state
        from which the last step came, it may return another matrix that serves the next step
        better; without `before` it returns the derivative.
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

    # The following are for problems with contact, friction, memory and time.

    def clear(self, u: NDArray, step: NDArray) -> float:
        """Share of a step (m,) that can be taken before anything crosses."""
        return 1.0

    def slips(self, u: NDArray) -> bool:
        """Whether anything slips in a state (m,); negative eigenvalues then mean nothing."""
        return False

    def opens(self, u: NDArray, factor: float) -> bool:
        """Whether a latch opens on the way to a state (m,), so that what it held jumps there."""
        return False

    def keep(self, u: NDArray, factor: float) -> Any:
        """Accept a state (m,) and return what has yielded and slipped, for `recall`."""

    def recall(self, kept: Any) -> None:
        """Go back to an accepted state."""

    def elapse(self, seconds: float) -> None:
        """Set the time (s) from the last accepted state to the next one."""


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


@dataclass(frozen=True)
class Settings(Checked):
    """How equilibria are solved for and steps are chosen.

    Parameters
    ----------
    tolerance : float
        A state is accepted when the residual is below this fraction of the forces at play and
        the last step below this fraction of the displacements (both; see the module docstring).
    iterations : int
        Newton iterations after which an attempt is given up and the step is cut.
    target : int
        Iterations per point at which the step control aims: more shrink the step, fewer enlarge it.
    cuts : int
        A path ends if a step is shorter than the interval between two given load factors halved
        this many times or, if the factor is free, after this many halvings since the last accepted
        step.
    largest_turn : float
        Degrees by which a hinge (or, without hinges, a bar) may turn within one step of
        "mgdcm" and "arc_length".
    jump : float
        A step longer than this number times its linear prediction has left the path (snapped) and
        is cut.
    stability : bool
        Count the negative eigenvalues of the tangent at every point.
    locate : bool
        Find the limit and bifurcation points between the points of a path ("newton" returns only
        the given factors and locates none).
    solver : str
        "auto", or one of `statics.SOLVERS`.
    """

    tolerance: Annotated[float, Check(number, least=1e-14, most=1e-2)] = 1e-9
    iterations: Annotated[int, Check(whole, least=1)] = 25
    target: Annotated[int, Check(whole, least=1)] = 6
    cuts: Annotated[int, Check(whole, least=1)] = 15
    largest_turn: Annotated[float, Check(number, above=0.0)] = 10.0
    jump: Annotated[float, Check(number, above=1.0)] = 3.0
    stability: Flag = True
    locate: Flag = True
    solver: str = "auto"

    place = "settings: "


def settings_of(given: Any) -> Settings:
    """Settings as given, or from a mapping of some of their values."""
    if isinstance(given, Settings):
        return given
    if given is not None and not isinstance(given, Mapping):
        raise InputError(
            f": got {type(given).__name__}, give statics.Settings(...) or a mapping such as "
            '{"largest_turn": 3.0}',
            "settings",
        )
    for name in given or ():
        choice("settings", name, Settings.__dataclass_fields__)
    return Settings(**(given or {}))


def plane(normal: NDArray, reach: float) -> Rule:
    """Rule of a step that ends in the plane in which normal times the motion equals `reach`.

    It gives nan where the plane contains the response.
    """

    def change(moved: NDArray, step: NDArray, response: NDArray) -> float:
        across = float(normal @ response)
        return (reach - float(normal @ (moved + step))) / across if across != 0.0 else math.nan

    return change


class Attempt(NamedTuple):
    """Outcome of a correction: an equilibrium, or a `failure` that says why not."""

    u: NDArray
    factor: float
    iterations: int
    balance: Balance
    failure: str = ""


@dataclass
class Tally:
    """Work done so far."""

    iterations: int = 0
    factorizations: int = 0
    cuts: int = 0


class Stiffness:
    """The factorized tangent at one state.

    Parameters
    ----------
    problem : Problem
    matrix : csr_array, shape (m, m)
    factors : Solution
        Factors of the block of the free dofs.
    symmetric : callable
        Returns factors of the block's symmetric part, in which negative eigenvalues are counted.
    """

    def __init__(
        self, problem: Problem, matrix: sparse.csr_array, factors: Solution,
        symmetric: Callable[[], Factorization],
    ) -> None:  # fmt: skip
        self.problem, self.matrix, self._factors = problem, matrix, factors
        self._symmetric = symmetric

    @cached_property
    def symmetric(self) -> Factorization:
        """Factors of the symmetric part of the free dofs' block."""
        return self._symmetric()

    def solve(self, force: NDArray, motion: NDArray) -> NDArray:
        """Motion (m,) of all dofs under a force (m,) on free dofs and a motion of held dofs."""
        problem = self.problem
        full = np.zeros(len(force))
        full[problem.held] = motion
        load = force[problem.free]
        if motion.any():
            load = load - (self.matrix @ full)[problem.free]
        full[problem.free] = self._factors.solve(load)
        return full

    def response(self, u: NDArray, factor: float) -> NDArray:
        """Motion (m,) per unit of the load factor along the path."""
        problem = self.problem
        motion = problem.prescribed(1.0) - problem.prescribed(0.0)
        return self.solve(-problem.rate(u, factor), motion)


class Solver:
    """Finds equilibria of a problem under given settings."""

    def __init__(self, problem: Problem, settings: Settings | None = None) -> None:
        self.problem = problem
        self.settings = settings or Settings()
        self.tally = Tally()
        self.reduce = Reduction(problem.free)  # the block of the free dofs
        self.backend, self._factorize = factorizer(self.settings.solver, len(problem.free))

    def stiffness(self, u: NDArray, factor: float, before: NDArray | None = None) -> Stiffness:
        """Factorize the tangent at a state; the step before came from the state `before`.

        If the tangent is singular to round-off (exactly at a critical point), a shift of the
        diagonal far below any stiffness lets the iteration continue.
        """
        matrix = sparse.csr_array(self.problem.tangent(u, factor, before))
        block = self.reduce(matrix)
        self.tally.factorizations += 1
        if block.is_symmetric:
            own = _factorized(block.exact, self._factorize)
            return Stiffness(self.problem, matrix, own, lambda: own)
        factors = _factorized(block.exact, unsymmetric)

        def symmetric() -> Factorization:
            self.tally.factorizations += 1
            return _factorized(block.symmetric, self._factorize)

        return Stiffness(self.problem, matrix, factors, symmetric)

    def correct(
        self, u: NDArray, factor: float, rule: Rule | None = None,
        stiffness: Stiffness | None = None, search: bool = False, origin: NDArray | None = None,
    ) -> Attempt:  # fmt: skip
        """Iterate from a state (m,) to an equilibrium.

        stiffness : stiffness for the first iteration, if known already.
        origin : start of the step that the rule restricts; `u` by default.
        """
        problem, settings = self.problem, self.settings
        before = origin
        u, origin = u.copy(), u.copy() if origin is None else origin
        residual = problem.residual(u, factor)
        reached = balance(problem, u, factor, residual)
        least, since = np.inf, 0
        for iteration in range(1, settings.iterations + 1):
            if not np.isfinite(reached.residual):
                return Attempt(u, factor, iteration - 1, reached, "the forces are no longer finite")
            self.tally.iterations += 1
            try:
                tangent = stiffness or self.stiffness(u, factor, before)
            except SingularTangentError as error:
                return Attempt(u, factor, iteration, reached, str(error))
            stiffness = None
            gap = problem.prescribed(factor) - u[problem.held]
            step, climb = tangent.solve(-residual, gap), 0.0
            if rule is not None:
                response = tangent.response(u, factor)
                climb = rule(u - origin, step, response)
                step = step + climb * response
            del tangent  # frees its memory for the next one
            if not np.isfinite(step).all():
                return Attempt(u, factor, iteration, reached, "no step meets the path")
            share = self._share(u, step)
            if share == 0.0:
                return Attempt(u, factor, iteration, reached, COLLIDES)
            if search and rule is None and share == 1.0 and not gap.any():
                share = self._search(u, factor, step, residual)
            before, u = u, u + share * step
            factor += share * climb
            if share == 1.0:
                u[problem.held] = problem.prescribed(factor)
            residual = problem.residual(u, factor)
            reached = balance(problem, u, factor, residual)
            length = float(np.linalg.norm(step))
            least, since = (reached.residual, 0) if reached.residual < least else (least, since + 1)
            if share == 1.0 and converged(problem, reached, u, length, settings.tolerance):
                return Attempt(u, factor, iteration, reached)
            if since == STALL:
                return Attempt(u, factor, iteration, reached, "no progress of the iteration")
        failure = f"no convergence in {settings.iterations} iterations"
        return Attempt(u, factor, settings.iterations, reached, failure)

    def _share(self, u: NDArray, step: NDArray) -> float:
        """Share of a step within which nothing turns too far, collides or crosses."""
        share = 1.0
        for _ in range(HALVINGS):
            turn = self.problem.turn(u, u + share * step)
            if turn <= MOST_TURN:
                return share * self.problem.clear(u, share * step)
            share *= MOST_TURN / turn if np.isfinite(turn) else 0.5
        return 0.0

    def _search(self, u: NDArray, factor: float, step: NDArray, residual: NDArray) -> float:
        """Share of a step at which the residual along the step is well below its initial value."""
        start = float(step @ residual)
        low, high, share = 0.0, 1.0, 1.0
        for _ in range(TRIALS):
            along = float(step @ self.problem.residual(u + share * step, factor))
            if abs(along) <= SLACK * abs(start):
                return share
            if along * start > 0.0 and share == 1.0:
                return share  # still descending at the full step
            low, high = (share, high) if along * start > 0.0 else (low, share)
            share = 0.5 * (low + high)
        return share


def _factorized(block: sparse.csc_array, factorize: Callable[[sparse.csc_array], S]) -> S:
    """Factors of a block, shifted if it is singular to round-off."""
    try:
        return factorize(block)
    except SingularTangentError:
        diagonal = np.abs(block.diagonal())
        if not np.isfinite(diagonal).all():
            raise
        shift = SHIFT * float(diagonal.mean()) or 1.0
        shifted = block + shift * sparse.eye_array(block.shape[0], format="csc")
        return factorize(sparse.csc_array(shifted))
