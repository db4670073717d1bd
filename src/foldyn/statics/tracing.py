"""`trace`: the equilibrium path of a case."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.algebra.solvers import check_fill
from foldyn.cases import Case, State
from foldyn.errors import ComputationError, FoldynWarning, InputError, MotionInterrupted
from foldyn.results import path_dataset
from foldyn.statics import stability_changes
from foldyn.statics.arguments import (
    PathPlan,
    check_actuation,
    check_case,
    check_start,
    check_steps,
    constant_loads,
    initial_state,
    plan,
)
from foldyn.statics.course import Until, driven, free
from foldyn.statics.mechanism import refuse_mechanisms
from foldyn.statics.methods import PathMethod, method_of
from foldyn.statics.newton import Solver
from foldyn.statics.origami import AdaptiveLoad, OrigamiProblem
from foldyn.statics.settings import Settings
from foldyn.statics.settle import settle
from foldyn.statics.station import PathStoppedError, Point, Station, Walk
from foldyn.statics.stepping import walk
from foldyn.structures.structure import hinge_angles

if TYPE_CHECKING:
    import xarray

CLOSED = 179.0  # degrees from flat beyond which a fold counts as closed


def trace(
    case: Case,
    method: str = "newton",
    load_factors: Sequence[float] | None = None,
    steps: int | None = None,
    *,
    constant: str | Sequence[int] = (),
    initial: State | None = None,
    first_step: float | None = None,
    until: Callable[[NDArray, float], bool] | None = None,
    adaptive_load: AdaptiveLoad | None = None,
    inertia_relief: bool = False,
    settings: Settings | None = None,
    progress: Callable[[Point], None] | None = None,
) -> xarray.Dataset:
    """Follow the equilibria of a case along a load factor.

    The factor multiplies the case's forces, gravity, imposed displacements and actuations;
    histories and motions of the base play no part.

    Parameters
    ----------
    case : Case
    method : {"newton", "displacement", "mgdcm", "arc_length"}
        "newton" goes by the load factor and returns the given factors, nothing else;
        "displacement" does so where supports or folds are moved, and returns every point on the
        way; "mgdcm" and "arc_length" let the factor move freely, through limit points.
    load_factors : sequence of float, optional
        For "newton" and "displacement" the factors to reach, in this order. For the others two
        numbers, where the path begins and ends; without them it begins at 0 and ends after
        `steps`.
    steps : int, optional
        Instead of load_factors: equal steps from 0 to 1 (default 10). For "mgdcm" and
        "arc_length": steps after which the path ends (default 100).
    constant : "gravity" or sequence of int
        Loads, by their numbers in `case.loads`, that act in full at every factor.
    initial : State, optional
        Displacements near which the first point is sought; fixed supports hold their nodes where
        it puts them. Without it the path is sought from rest at the factor 0.
    first_step : float, optional
        Change of the factor in the first step of "mgdcm" and "arc_length" (default 0.05, or that
        part of the way to the last factor); the next steps are about as long.
    until : callable, optional
        Function of displacements (n, 3) and load factor; the path ends at the first point where
        it is true.
    adaptive_load : callable, optional
        Further forces (n, 3), N, as a function of displacements (n, 3) and load factor.
    inertia_relief : bool
        Balance the loads of a body that is free to move by its inertia.
    settings : Settings, optional
        Tolerance, step control, stability, linear solver.
    progress : callable, optional
        Called with each point found.

    Returns
    -------
    xarray.Dataset
        `displacement` (m) with dimensions step, node, axis and the coordinate `load_factor`;
        `reaction` (N) at supported dofs; energies (J) `strain_bars`, `strain_folds`,
        `strain_bends` and `work`; `negative_eigenvalues`, `point` ("regular", "limit",
        "bifurcation"), `iterations`, `residual`. Attributes hold `status` ("complete" or
        "stopped", then with `stopped_because` and `remedy`), `unstable_points` (how many) and
        `stability_changes` (in words), and the facts about the run.

    Raises
    ------
    InputError
        An argument out of range; supports that leave a mechanism; nothing that loads the case.
    ComputationError
        The path cannot go on; the exception's `partial` has it up to its last point.

    Warns
    -----
    FoldynWarning
        The count of negative eigenvalues changes along the path, but for limit points that
        "mgdcm" and "arc_length" have located.

    Examples
    --------
    >>> import foldyn as fd
    >>> pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    >>> s = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01))
    >>> supports = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")]
    >>> case = fd.Case(s, supports, [fd.Force([0, 1], (-1e-3, 0, 0))])
    >>> path = trace(case, load_factors=[0.5, 1.0])
    >>> path.displacement.sel(node=0, axis="x").values.round(4).tolist()
    [-0.0166, -0.0312]
    """
    if not isinstance(case, Case):
        raise InputError(f"case: got {type(case).__name__}, give a Case")
    way = method_of(method)
    if steps is not None:
        check_steps(steps, case.structure.nodes.size)
    route = plan(way, load_factors, steps, first_step)
    held = constant_loads(case, constant)
    state = initial_state(case, initial)
    check_case(case, way, held, route, adaptive_load is not None)
    if settings is not None and not isinstance(settings, Settings):
        raise InputError(f"settings: got {type(settings).__name__}, give statics.Settings(...)")
    if not isinstance(inertia_relief, bool):
        raise InputError(f" = {inertia_relief!r}: give True or False", "inertia_relief")
    check_fill(case.structure.fill, case.structure.body.size)
    problem = OrigamiProblem(case, held, state, adaptive_load, inertia_relief)
    check_start(problem)
    check_actuation(problem, route)
    refuse_mechanisms(problem)
    solver = Solver(problem, settings)
    facts = {
        "method": way.name,
        "steps": route.steps,
        "load_factors": load_factors,
        "first_step": route.first_step if way.rule is not None else None,
        "constant": held or None,
        "inertia_relief": inertia_relief,
        "started_from": "rest" if state is None else "state",
    }
    recorder = Recorder(problem, solver, facts, adaptive_load is not None)

    def course() -> Walk:
        first = _first(solver, problem, route, state)
        yield first
        yield from _onward(solver, way, route, first, on_nodes(until, problem))

    return recorder.record(course(), progress)


def _first(
    solver: Solver, problem: OrigamiProblem, route: PathPlan, state: NDArray | None
) -> Station:
    """The point where the path begins."""
    if state is not None:
        return settle(solver, problem.start(), route.begin)
    first = settle(solver, problem.start(), 0.0)
    if route.begin != 0.0:
        *_, first = walk(solver, first, [route.begin], False)
    return first


def _onward(
    solver: Solver, way: PathMethod, route: PathPlan, first: Station, until: Until | None
) -> Walk:
    if way.rule is None:
        return driven(solver, first, route.factors, way.between, until)
    return free(solver, first, way.rule, route.first_step, route.steps, route.end, until)


def on_nodes(until: Callable[[NDArray, float], bool] | None, problem: OrigamiProblem) -> Any:
    """A user's function of displacements (n, 3) as one of flat dofs."""
    if until is None:
        return None
    return lambda u, factor: bool(until(problem.displacement(u).copy(), factor))


class Recorder:
    """Keeps the points of a path as they are found, and makes its dataset."""

    def __init__(
        self, problem: OrigamiProblem, solver: Solver, facts: dict[str, Any], adaptive: bool
    ) -> None:
        self.problem, self.solver, self.facts = problem, solver, facts
        self.points: list[Point] = []
        self._adaptive = adaptive

    def record(self, course: Walk, progress: Callable[[Point], None] | None) -> xarray.Dataset:
        """Run a course to its end; raises where it cannot go on, with what there is."""
        began = time.perf_counter()
        end: dict[str, Any] = {"status": "complete"}
        try:
            for station in course:
                self.points.append(station.point)
                if progress is not None:
                    progress(station.point)
        except PathStoppedError as stop:
            remedy = self._closed() or stop.remedy
            end = {"status": "stopped", "stopped_because": stop.reason, "remedy": remedy}
            message = f"{stop.reason}; {remedy}"
            raise ComputationError(message, self._partial(began, end)) from None
        except KeyboardInterrupt:
            end = {"status": "stopped", "stopped_because": "interrupted"}
            raise MotionInterrupted(
                f"interrupted after {len(self.points)} points", self._partial(began, end)
            ) from None
        return self.dataset(time.perf_counter() - began, end)

    def _closed(self) -> str:
        """A remedy where the path ends because a fold is closed; empty otherwise."""
        structure = self.problem.structure
        if not self.points or not len(structure.folds):
            return ""
        state = structure.nodes + self.problem.displacement(self.points[-1].u)
        folds = np.degrees(hinge_angles(state, structure.folds))
        crease = int(np.argmax(np.abs(folds - 180.0)))
        if abs(folds[crease] - 180.0) < CLOSED:
            return ""
        return (
            f"crease {crease} is closed ({folds[crease]:.5g} degrees): a fold law that locks "
            "before panels meet ('enhanced') lets the path go on"
        )

    def _partial(self, began: float, end: dict[str, Any]) -> xarray.Dataset | None:
        return self.dataset(time.perf_counter() - began, end) if self.points else None

    def dataset(self, seconds: float, end: dict[str, Any]) -> xarray.Dataset:
        """The points so far, with the case and the facts about the run."""
        problem, points, tally = self.problem, self.points, self.solver.tally
        from_rest = self.facts["started_from"] == "rest"
        free = method_of(self.facts["method"]).rule is not None
        told = stability_changes.warning(points, from_rest, free)
        if told:
            warnings.warn(told, FoldynWarning, stacklevel=4)
        residuals = [problem.residual(p.u, p.factor) for p in points]
        energies = np.array([problem.energies(p.u, p.factor) for p in points])
        columns = dict(zip(problem.groups, energies.T, strict=True))
        statistics = {
            **end,
            **self.facts,
            **asdict(self.solver.settings),
            "solver": self.solver.backend,
            "newton_iterations": tally.iterations,
            "factorizations": tally.factorizations,
            "step_cuts": tally.cuts,
            "wall_seconds": seconds,
            **stability_changes.facts(points, from_rest),
        }
        own = "an adaptive load, a function of the user's own, acted on it"
        return path_dataset(
            problem.case,
            [p.factor for p in points],
            [problem.displacement(p.u) for p in points],
            np.reshape([r[problem.supported] for r in residuals], (len(points), -1)),
            {**columns, "work": self._work(residuals)},
            {
                "negative_eigenvalues": [p.negative for p in points],
                "point": [p.kind for p in points],
                "iterations": [p.iterations for p in points],
                "residual": [p.residual for p in points],
            },
            statistics,
            (own,) if self._adaptive else (),
        )

    def _work(self, residuals: list[NDArray]) -> NDArray:
        """Work (J) of loads, supports and actuators since the first point, by trapezoids."""
        problem, points = self.problem, self.points
        forces = []
        for point, residual in zip(points, residuals, strict=True):
            force = problem.external(point.u, point.factor)
            force[problem.held] += residual[problem.held]
            forces.append(force)
        rates = [problem.actuation_rate(p.u, p.factor) for p in points]
        work = np.zeros(len(points))
        for k in range(1, len(points)):
            one, other = points[k - 1], points[k]
            done = 0.5 * (forces[k - 1] + forces[k]) @ (other.u - one.u)
            done += 0.5 * (rates[k - 1] + rates[k]) * (other.factor - one.factor)
            work[k] = work[k - 1] + done
        return work
