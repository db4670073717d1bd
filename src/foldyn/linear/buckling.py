"""`buckling`: load factors at which a case's tangent becomes singular, and the shapes.

Linear buckling about a base state: u1 = K0^-1 p is the displacement per unit of the load factor
there, and K1 the derivative of the exact tangent along (u1, 1), as the loads and u1 grow together.
The factors f and shapes phi satisfy (K0 + f K1) phi = 0 on the free dofs, hidden dofs among them.
K1 comes from a central difference of two exact tangents, so that it has every effect of the
structure: stress, turned panels, following loads, actuated folds, temperature.

The factors are exact where u1 strains the structure, but hardly turns it, as in plates and columns
pressed in their plane. `departure` says how far the tangent is from singular at the lowest factor
once the displacement is corrected to second order: about the relative error of this factor.

Brendel and Ramm, Linear and nonlinear stability analysis of cylindrical shells, Computers and
Structures 12, 1980.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
import xarray
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.load_factors import LoadFactors, Softening
from foldyn.algebra.reduction import Reduction
from foldyn.algebra.solvers import check_fill, factorizer
from foldyn.algebra.superlu import SingularTangentError, Solution, Unsymmetric
from foldyn.cases import LOADS, Case, Load
from foldyn.cases.air import refuse_air
from foldyn.dynamics.modal_damping import soft_at_rest
from foldyn.errors import ComputationError, InputError, warn
from foldyn.mechanics.following import ASYMMETRIC, NO_POTENTIAL, asymmetry
from foldyn.ram_limit import check_memory
from foldyn.results.dataset import buckling_dataset
from foldyn.statics import OrigamiProblem
from foldyn.statics.equilibrium import drives
from foldyn.statics.newton import Solver
from foldyn.statics.stability import oriented
from foldyn.statics.stepping import PathStoppedError, settle
from foldyn.statics.tracing import refuse_mechanisms
from foldyn.values import objects, of_kind, whole

COPIES = 8  # copies of the shapes in memory, while they are found and stored
STEP = 1e-5  # largest strain or turn in the difference of tangents: errors of 1e-10 and rounding
FARTHEST = 0.1  # strain or turn along the linear path beyond which no factor means anything
DEPARTS = 0.05  # departure from which the lowest factor is doubtful
TURNS = np.radians(10.0)  # turn of a hinge from which displacements are not small


def buckling(
    case: Case, count: int = 6, *, preload: Load | Sequence[Load] | None = None
) -> xarray.Dataset:
    """Load factors at which a case buckles, and the shapes, by linear buckling.

    All loads, imposed displacements, actuated creases and temperatures of the case are scaled
    together by the factor; histories and base motions are ignored. Relaxing laws with memory count
    as relaxed, with their elastic part.

    Parameters
    ----------
    case : Case
        Bars and hinges, or a shell.
    count : int
        Number of factors of each sign, from the one nearest to zero on.
    preload : Load or sequence of Load, optional
        Loads that act in full at every factor, in addition to those of the case. The base state is
        the equilibrium under them; by default rest.

    Returns
    -------
    xarray.Dataset
        Dimensions mode, node, axis; `mode` counts from 1. `load_factor`: first the positive ones,
        increasing, then the negative ones (loads reversed), from zero on; without those that take
        strains or turns of more than 10 % and are more than ten times as far from zero as the
        nearest. `shape`: the largest displacement of a node is 1, the largest component positive.
        `displacement` (m) of the base state, and `prebuckling` (m), the displacement from there per
        unit of the factor. The case of the result has the preloads first among its loads.
        Attributes: `positive` and `negative` (numbers of factors), `complete` (number of factors
        that counts prove to be complete), `constant` (numbers of the preloads), and for the first
        factor `departure`, an estimate of its relative error, and `turn` (rad), the largest turn of
        a hinge or bar up to it; facts about the computation.

    Raises
    ------
    InputError
        Nothing loads the case; it can move freely; it is unstable in the base state; contact, air,
        creases that yield or creep, superelements; superlinear hinges without a slope.
    ComputationError
        No equilibrium is found under the preload; the factors do not converge.

    Warns
    -----
    FoldynWarning
        Displacements are not small at the lowest factor, or the tangent is far from singular there;
        the load stiffness is not symmetric; no load factor is found.

    Examples
    --------
    >>> import foldyn as fd
    >>> pattern = fd.Pattern([(0, 0), (1, 0), (1, 0.1), (0, 0.1)], [(0, 1, 2, 3)])
    >>> strip = fd.shell(pattern, fd.Sheet(1e9, 0.0, 1e-3), divisions=16)
    >>> held = [fd.Fix("xmin", "xz", along=True), fd.Fix("xmax", "z", along=True), fd.Fix([0], "y")]
    >>> case = fd.Case(strip, held, [fd.LineLoad("xmax", (-1.0, 0, 0))])
    >>> round(float(buckling(case, 1).load_factor[0]), 3)  # Euler: pi^2 E t^3 / 12 L^2 = 0.822
    0.82
    """
    of_kind("case", case, Case)
    count = whole("count", count, least=1)
    check_memory(
        "count", f"{float(count):.3g} modes",
        8.0 * COPIES * count * case.structure.nodes.size, "take fewer",
    )  # fmt: skip
    began = time.perf_counter()
    given = [] if preload is None else [preload] if isinstance(preload, LOADS) else preload
    steady = objects("preload", given, LOADS)
    _check(case)
    base = _Base(case, steady)
    positive, negative = base.softening.nearest(count)
    values = np.concatenate([positive.values, negative.values])
    shapes = _nodal(base, np.hstack([positive.shapes, negative.shapes]))
    departure, turn = _departure(base, positive, negative)
    _warn(values, departure, turn)
    found = {
        "load_factor": values,
        "shape": shapes,
        "displacement": base.problem.displacement(base.u),
        "prebuckling": base.problem.displacement(base.slope),
    }
    statistics = {
        "count": count,
        "state": "equilibrium" if found["displacement"].any() else "rest",
        "constant": list(range(len(steady))) or None,
        "free_dofs": len(base.problem.free),
        "positive": len(positive.values),
        "negative": len(negative.values),
        "complete": positive.complete + negative.complete,
        "departure": departure,
        "turn": turn,
        "step": base.step,
        "solver": base.backend,
        "wall_seconds": time.perf_counter() - began,
    }
    return buckling_dataset(base.problem.case, found, statistics)


class _Base:
    """The base state, the tangent there, and its change along the path.

    Attributes
    ----------
    problem : OrigamiProblem
        The case, with its preloads constant.
    u, slope : (m,)
        The base state, and its derivative with respect to the load factor.
    step : float
        Load factor of the central difference.
    softening : Softening
        Symmetric parts of the tangent and of its derivative, on the free dofs.
    """

    def __init__(self, case: Case, preloads: Sequence[Load]) -> None:
        whole = case.altered(loads=(*preloads, *case.loads)) if preloads else case
        problem = OrigamiProblem(whole, range(len(preloads)))
        refuse_mechanisms(problem)
        try:
            self.u = settle(Solver(problem), problem.start(), 0.0).point.u
        except PathStoppedError as stop:
            raise ComputationError(f"buckling: {stop}") from None
        self.problem, self._reduce = problem, Reduction(problem.free)
        self._refuse_soft()
        self.backend, self._factorize = factorizer("auto", len(problem.free))
        matrix = self.tangent(self.u, 0.0)
        block = self._reduce(matrix)
        try:
            factors = self._factorize(block.symmetric)
            negative = factors.negative()
            exact = factors if block.is_symmetric else Unsymmetric(block.exact)
        except SingularTangentError:
            raise _unstable("is singular", bool(preloads)) from None
        if negative:
            raise _unstable(f"has {negative} negative eigenvalues", bool(preloads))
        self._exact: Solution = exact
        self.slope = self._slope(matrix)
        self.step = STEP / self._stretch()
        ahead, behind = (
            self.tangent(self.u + way * self.slope, way) for way in (self.step, -self.step)
        )
        change = self._reduce(sparse.csr_array((ahead - behind) / (2.0 * self.step)))
        if not change.is_symmetric:
            loads = problem.case.constraints.matrix(
                problem.load_stiffness(problem.dofs(self.u), 1.0)
            )
            _warn_of_asymmetry(asymmetry(Reduction(problem.free)(sparse.csr_array(loads)).exact))
        self.softening = Softening(
            block.symmetric, change.symmetric, factors, self._factorize,
            rounding=1.0 / self.step, farthest=FARTHEST * self.step / STEP,
        )  # fmt: skip

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
        return given + self.moved(-problem.rate(self.u, 0.0) - matrix @ given)

    def _stretch(self) -> float:
        """Largest strain or turn per unit of the load factor, about.

        Loads on held dofs move nothing, but stress the structure: their forces over those at unit
        strain count, too.
        """
        problem, structure = self.problem, self.problem.structure
        body = problem.body(self.u, 0.0)
        moved, q = problem.dofs(self.slope), problem.dofs(self.u)
        nodes = structure.nodes.size
        x, v = structure.nodes + q[:nodes].reshape(-1, 3), moved[:nodes].reshape(-1, 3)
        a, b = structure.bars.T
        apart = np.linalg.norm(v[b] - v[a], axis=1) / np.linalg.norm(x[b] - x[a], axis=1)
        turned = body.sheet.per_hidden * np.abs(moved[body.hidden])
        scale = body.scale()
        held = np.abs(problem.rate(self.u, 0.0))[: len(scale)]
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
        case, problem = self.problem.case, self.problem
        soft = int(soft_at_rest(case, problem.body(self.u, 0.0), problem.dofs(self.u))[0].sum())
        if soft:
            raise InputError(
                f": {soft} hinges of the superlinear law stand at their rest angle, where their "
                'slope vanishes and has no derivative; take preset = "plate" or "n5b8e", or a '
                "preload that turns these hinges",
                "bend_law",
            )


def _check(case: Case) -> None:
    """Refuse what has no tangent that changes linearly."""
    if case.structure.linear:
        raise InputError(
            f": {case.structure.linear} are linear and have no geometric stiffness; take fd.shell "
            "or fd.discretize (bars and hinges)",
            "structure",
        )
    if case.contact is not None:
        raise InputError(
            ": closes and opens, so that the tangent jumps; take the case without contact, or "
            "follow the path with fd.trace",
            "contact",
        )
    refuse_air(case, "buckling")
    case.check_movable()
    check_fill(case.structure.fill, case.body.size)
    if not drives(case, ()):
        raise InputError(
            ": nothing to scale by a factor; give the case a Force, Pressure, Gravity, Actuate, "
            "Temperature or Impose (a preload is not scaled)",
            "loads",
        )


def _unstable(how: str, preloaded: bool) -> InputError:
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


def _nodal(base: _Base, free: NDArray) -> NDArray:
    """Shapes (k, n, 3) of the nodes, the largest displacement 1, from motions of the free dofs."""
    case = base.problem.case
    shapes = base.problem.dofs(base.all_dofs(free))[: case.structure.nodes.size]
    if not shapes.shape[1]:
        return np.zeros((0, *case.structure.nodes.shape))
    shapes = oriented(shapes).T.reshape(-1, *case.structure.nodes.shape)
    sizes = np.linalg.norm(shapes, axis=2).max(axis=1)
    return shapes / np.where(sizes > 0.0, sizes, 1.0)[:, None, None]


def _departure(base: _Base, positive: LoadFactors, negative: LoadFactors) -> tuple[float, float]:
    """Departure and turn (rad) at the first factor; nan without one.

    The state there is corrected to second order in the factor, with the tangent in the base state.
    """
    first = positive if len(positive.values) else negative
    if not len(first.values):
        return float("nan"), float("nan")
    factor, shape, problem = float(first.values[0]), first.shapes[:, 0], base.problem
    linear = base.u + factor * base.slope
    turn = problem.turn(base.u, linear)
    there = linear - base.moved(problem.residual(linear, factor))
    with np.errstate(all="ignore"):
        tangent = base.tangent(there, factor)[problem.free][:, problem.free]
        left = float(shape @ (tangent @ shape))  # shape' K0 shape is 1
    return left if np.isfinite(left) else float("inf"), turn


def _warn(values: NDArray, departure: float, turn: float) -> None:
    if not len(values):
        warn(
            "no load factor was found: the tangent does not soften along the linear path, whether "
            "loads are reversed or not",
            "buckling.md#when-the-factors-hold",
        )
    elif abs(departure) > DEPARTS or turn > TURNS:
        warn(
            f"at the load factor {values[0]:.4g} displacements are not small: hinges or bars turn "
            f"by up to {np.degrees(turn):.3g} degrees, and {departure:.2g} of the shape's "
            "stiffness is left where the linear path is corrected to second order: this factor may "
            "be off by as much, or mean nothing. fd.trace finds the critical points of the path",
            "buckling.md#when-the-factors-hold",
        )


def _warn_of_asymmetry(share: float) -> None:
    if share > ASYMMETRIC:
        warn(
            f"{NO_POTENTIAL.format(share)} load factors take its symmetric part, which misses "
            "flutter: simulated motions include it",
            "loads.md#pressure",
        )
