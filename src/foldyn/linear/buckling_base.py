"""The base state of linear buckling, and the change of the tangent along the path from there."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.load_factors import LoadFactors, Softening
from foldyn.algebra.reduction import Reduction
from foldyn.algebra.solvers import factorizer
from foldyn.algebra.superlu import SingularTangentError, Solution, unsymmetric
from foldyn.cases import Case, Load
from foldyn.dynamics.modal_damping import soft_at_rest
from foldyn.errors import ComputationError, InputError, warn
from foldyn.mechanics.following import ASYMMETRIC, NO_POTENTIAL, asymmetry
from foldyn.statics import OrigamiProblem
from foldyn.statics.newton import Solver
from foldyn.statics.stepping import PathStoppedError, arrive, settle, step_to
from foldyn.statics.tracing import refuse_mechanisms

STEP = 1e-5  # largest strain or turn in the difference of tangents: errors of 1e-10 and rounding
FARTHEST = 0.1  # strain or turn along the linear path beyond which no factor means anything


class Base:
    """The base state, the tangent there, and its change along the path.

    Attributes
    ----------
    problem : OrigamiProblem
        The case, with its preloads constant.
    case : Case
        The case of results.
    factor : float
        Load factor of the base state.
    u, slope : (m,)
        The base state, and its derivative with respect to the load factor.
    step : float
        Load factor of the central difference.
    softening : Softening
        Symmetric parts of the tangent and of its derivative, on the free dofs.
    """

    factor = 0.0

    def __init__(self, case: Case, preloads: Sequence[Load]) -> None:
        whole = case.altered(loads=(*preloads, *case.loads)) if preloads else case
        problem = OrigamiProblem(whole, range(len(preloads)))
        refuse_mechanisms(problem)
        self._solver, self._preloaded = Solver(problem), bool(preloads)
        try:
            self._station = settle(self._solver, problem.start(), 0.0)
        except PathStoppedError as stop:
            raise ComputationError(f"buckling: {stop}") from None
        self.problem, self.case, self._reduce = problem, problem.case, Reduction(problem.free)
        self.backend, self._factorize = factorizer("auto", len(problem.free))
        self._linearize()

    def closer(self, factor: float) -> Base | None:
        """The state at another load factor of the path; None if it is lost or unstable there."""
        other, attempt = copy(self), step_to(self._solver, self._station, factor)
        if attempt.failure:
            return None
        other._station = arrive(self._solver, attempt)
        try:
            other._linearize()
        except InputError:
            return None
        return other

    def _linearize(self) -> None:
        """Find the tangent and its change at the station."""
        problem, point = self.problem, self._station.point
        self.u, self.factor = point.u, point.factor
        self._refuse_soft()
        matrix = self.tangent(self.u, self.factor)
        block = self._reduce(matrix)
        try:
            factors = self._factorize(block.symmetric)
            negative = factors.negative()
            exact = factors if block.is_symmetric else unsymmetric(block.exact)
        except SingularTangentError:
            raise unstable("is singular", self._preloaded) from None
        if negative:
            raise unstable(f"has {negative} negative eigenvalues", self._preloaded)
        self._exact: Solution = exact
        self.slope = self._slope(matrix)
        self.step = STEP / self.stretch()
        ahead, behind = (
            self.tangent(self.u + way * self.slope, self.factor + way)
            for way in (self.step, -self.step)
        )
        change = self._reduce(sparse.csr_array((ahead - behind) / (2.0 * self.step)))
        if not change.is_symmetric:
            loads = problem.case.constraints.matrix(
                problem.load_stiffness(problem.dofs(self.u), 1.0)
            )
            warn_of_asymmetry(asymmetry(Reduction(problem.free)(sparse.csr_array(loads)).exact))
        self.softening = Softening(
            block.symmetric, change.symmetric, factors, self._factorize,
            rounding=1.0 / self.step, farthest=FARTHEST * self.step / STEP,
        )  # fmt: skip

    def nearest(self, count: int) -> tuple[LoadFactors, LoadFactors]:
        """Positive and negative factors, with shapes on the free dofs of the problem."""
        return self.softening.nearest(count)

    def tangent(self, u: NDArray, factor: float) -> sparse.csr_array:
        """Exact tangent (m, m) of a state, N/m, with the load stiffness."""
        problem, q = self.problem, self.problem.dofs(u)
        matrix = problem.body(u, factor).tangent(q)
        if problem.following.acts:
            matrix = sparse.csr_array(matrix + problem.load_stiffness(q, factor))
        return sparse.csr_array(problem.case.constraints.matrix(matrix))

    def all_dofs(self, free: NDArray) -> NDArray:
        """Motions (m, k) of all dofs in motions of the free dofs."""
        full = np.zeros((len(self.u), free.shape[1]))
        full[self.problem.free] = free
        return full

    def moved(self, force: NDArray) -> NDArray:
        """Motion (m,) under a force (m,) on the free dofs."""
        motion = np.zeros(len(self.u))
        motion[self.problem.free] = self._exact.solve(force[self.problem.free])
        return motion

    def _slope(self, matrix: sparse.csr_array) -> NDArray:
        problem, given = self.problem, np.zeros(len(self.u))
        given[problem.held] = problem.prescribed(1.0) - problem.prescribed(0.0)
        return given + self.moved(-problem.rate(self.u, self.factor) - matrix @ given)

    def stretch(self) -> float:
        """Largest strain or turn per unit of the load factor, about.

        Loads on held dofs move nothing, but stress the structure: their forces over those at unit
        strain count, too.
        """
        problem, structure = self.problem, self.problem.structure
        body = problem.body(self.u, self.factor)
        moved, q = problem.dofs(self.slope), problem.dofs(self.u)
        nodes = structure.nodes.size
        x, v = structure.nodes + q[:nodes].reshape(-1, 3), moved[:nodes].reshape(-1, 3)
        a, b = structure.bars.T
        apart = np.linalg.norm(v[b] - v[a], axis=1) / np.linalg.norm(x[b] - x[a], axis=1)
        turned = body.sheet.per_hidden * np.abs(moved[body.hidden])
        scale = body.scale()
        held = np.abs(problem.rate(self.u, self.factor))[: len(scale)]
        stressed = np.divide(held, scale, out=np.zeros_like(scale), where=scale > 0.0)
        most = max(float(each.max(initial=0.0)) for each in (apart, turned, stressed))
        if most == 0.0:  # springs alone resist the loads
            most = float(np.linalg.norm(v)) / problem.length
        if most == 0.0:
            raise InputError(
                ": they load nothing, so that no load factor exists; give loads that deform the "
                "case",
                "loads",
            )
        return most

    def _refuse_soft(self) -> None:
        problem, body = self.problem, self.problem.body(self.u, self.factor)
        soft = int(soft_at_rest(problem.case, body, problem.dofs(self.u))[0].sum())
        if soft:
            raise InputError(
                f": {soft} hinges of the superlinear law stand at their rest angle, where their "
                'slope vanishes and has no derivative; take preset = "plate" or "n5b8e", or a '
                "preload that turns these hinges",
                "bend_law",
            )


def unstable(how: str, preloaded: bool) -> InputError:
    """Error for a base state in which the tangent is not positive definite."""
    if preloaded:
        return InputError(
            f": the tangent {how} in the equilibrium under it: the case has buckled already; give "
            "a smaller one",
            "preload",
        )
    return InputError(
        f"the tangent {how} at rest, before any load acts; hold what moves, or give folds a "
        "stiffness, or a preload under which the case is stable"
    )


def warn_of_asymmetry(share: float) -> None:
    """Warn if the antisymmetric share of the load stiffness counts."""
    if share > ASYMMETRIC:
        warn(
            f"{NO_POTENTIAL.format(share)} load factors take its symmetric part, which misses "
            "flutter: simulated motions include it",
            "loads.md#pressure",
        )
