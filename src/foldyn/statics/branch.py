"""Switching to the path that crosses a path at a bifurcation.

At a bifurcation the tangent has a mode that no load drives. A small amplitude of this mode is
prescribed, and an equilibrium is sought with the load factor free: it lies on the other path, which
is then followed away from the crossing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.results import case_of, check_result
from foldyn.statics.equilibrium import OrigamiProblem
from foldyn.statics.newton import Attempt, Settings, Solver, balance, plane, settings_of
from foldyn.statics.path_methods import METHODS, PathPlan, along
from foldyn.statics.recording import record
from foldyn.statics.stability import critical_modes
from foldyn.statics.stepping import PathStoppedError, Point, Station, Walk, arrive
from foldyn.statics.tracing import check_steps, until_of
from foldyn.values import choice, function, of_kind, whole

FIRST_TURN = np.radians(1.0)  # largest turn of a hinge in the first step onto the branch
TRIES = 6  # amplitudes tried, each half of the previous one
FAR = 10.0  # an equilibrium more than this many amplitudes away is not on the branch


def switch_branch(
    path: xarray.Dataset,
    at: int | None = None,
    *,
    direction: int = 1,
    case: Case | None = None,
    mode: int = 0,
    method: str = "arc_length",
    steps: int = 50,
    until: Callable[[NDArray, float], bool] | Mapping[str, Any] | None = None,
    settings: Settings | Mapping[str, Any] | None = None,
    progress: Callable[[Point], None] | None = None,
) -> xarray.Dataset:
    """Follow the path that crosses a path at a bifurcation.

    Parameters
    ----------
    path : xarray.Dataset
        A path from `trace` with a located bifurcation.
    at : int, optional
        Step of the bifurcation; by default the first one of the path.
    direction : {1, -1}
        Direction along the branch; in a symmetric structure the two are mirror images.
    case : Case, optional
        The case of the path; needed if the path cannot rebuild it (`foldyn.case_of`).
    mode : int
        Number of the tangent's mode to follow, counted from the eigenvalue nearest to zero; a
        multiple bifurcation has several modes.
    method : {"arc_length", "mgdcm"}
    steps, until, settings, progress
        As in `trace`.

    Returns
    -------
    xarray.Dataset
        As from `trace`; its first point is the bifurcation.

    Raises
    ------
    InputError
        The path has no bifurcation at this step, or was computed with an adaptive load.
    ComputationError
        The branch cannot be followed; `partial` holds the branch up to its last point.
    """
    check_result(path, "path: ")
    at = _bifurcation(path, at)
    if whole("direction", direction) not in (1, -1):
        raise InputError(f" = {direction}: give 1 or -1", "direction")
    mode = whole("mode", mode, least=0)
    function("progress", progress)
    check_steps(steps, path["displacement"][0].size)
    way = METHODS[choice("method", method, METHODS)]
    if way.rule is None:
        raise InputError(f" = {method!r}: a branch takes 'arc_length' or 'mgdcm'", "method")
    problem = problem_of(path, case, at)
    until = until_of(until, problem.case)
    solver = Solver(problem, settings_of(settings))
    crossing = station_of(solver, problem, path, at)
    facts = {
        "method": method,
        "steps": steps,
        "constant": path.attrs.get("constant"),
        "inertia_relief": bool(path.attrs.get("inertia_relief", 0)),
        "branch_at": at,
        "branch_direction": direction,
        "branch_mode": mode,
        "started_from": "state",
    }

    # number of eigenvalues that vanish at the bifurcation: the jump in the number of negative ones
    counts = path["negative_eigenvalues"].values[max(at - 1, 0) : at + 2]
    multiplicity = max(int(np.ptp(counts)), 1)
    plan = PathPlan(way, crossing.point.factor, [], None, steps - 1, 0.0)

    def stations() -> Walk:
        yield crossing
        first = _onto_branch(solver, crossing, mode, multiplicity, direction)
        yield first
        yield from along(solver, first, plan, first.point.u - crossing.point.u)

    return record(stations(), progress, solver, problem, facts, until)


def _bifurcation(path: xarray.Dataset, at: int | None) -> int:
    """Step of a bifurcation of a path: the given one, checked, or the first."""
    if "point" not in path:
        raise InputError("path: is not a path from trace")
    steps = np.flatnonzero(path["point"].values == "bifurcation")
    if not len(steps):
        raise InputError(
            "path: has no bifurcation; trace it with settings that locate them (locate = True, "
            "and a method other than 'newton')"
        )
    if at is None:
        return int(steps[0])
    if whole("at", at) not in steps:
        raise InputError(f" = {at}: the bifurcations of the path are steps {steps.tolist()}", "at")
    return int(at)


def problem_of(path: xarray.Dataset, case: Case | None, at: int) -> OrigamiProblem:
    """The problem that a path solved, with the supports where they are at a step."""
    if "adaptive load" in str(path.attrs.get("not_rerunnable_because", "")):
        raise InputError("path: was traced with an adaptive load, which a path does not keep")
    case = case_of(path) if case is None else of_kind("case", case, Case)
    if "elapsed" in path and case.remembering:
        raise InputError("path: its creases have relaxed in part; trace it without a duration")
    if path.attrs.get("releases"):
        raise InputError("path: has released parts of its case; trace it without those")
    displacement = path["displacement"].values[at]
    if displacement.shape != case.structure.nodes.shape:
        raise InputError(
            f"case: has {len(case.structure.nodes)} nodes, the path {len(displacement)}"
        )
    constant = np.atleast_1d(path.attrs.get("constant", [])).astype(int).tolist()
    relief = bool(path.attrs.get("inertia_relief", 0))
    return OrigamiProblem(case, constant, displacement, None, relief)


def station_of(solver: Solver, problem: OrigamiProblem, path: xarray.Dataset, at: int) -> Station:
    """Station at a step of a stored path."""
    factor = float(path["load_factor"].values[at])
    u = problem.state(path["displacement"].values[at], factor)
    reached = balance(problem, u, factor, problem.residual(u, factor))
    station = arrive(solver, Attempt(u, factor, int(path["iterations"].values[at]), reached))
    negative = int(path["negative_eigenvalues"].values[at])
    kind = str(path["point"].values[at])
    return station._replace(point=replace(station.point, negative=negative, kind=kind))


def _onto_branch(
    solver: Solver, crossing: Station, mode: int, multiplicity: int, direction: int
) -> Station:
    """The first station on the branch."""
    _, shapes = critical_modes(solver, crossing, max(mode + 1, multiplicity))
    if mode >= shapes.shape[1]:
        raise InputError(f"mode = {mode}: the structure has only {shapes.shape[1]} modes")
    failure = ""
    for amplitude in FIRST_TURN * 0.5 ** np.arange(TRIES):
        for shape in _directions(shapes, mode, multiplicity):
            attempt = _aside(solver, crossing, direction * shape, amplitude)
            if not attempt.failure:
                return arrive(solver, attempt)
            failure = attempt.failure
    raise PathStoppedError(
        f"no equilibrium on a branch was found near the load factor {crossing.point.factor:.6g} "
        f"({failure})",
        "try another mode, or trace the path with a tighter tolerance",
    )


def _aside(solver: Solver, crossing: Station, shape: NDArray, turn: float) -> Attempt:
    """Equilibrium displaced along a shape until one hinge has turned by `turn` (rad)."""
    point, probe = crossing.point, 1e-6 * solver.problem.length
    amplitude = probe * turn / solver.problem.turn(point.u, point.u + probe * shape)
    start, rule = point.u + amplitude * shape, plane(shape, amplitude)
    attempt = solver.correct(start, point.factor, rule, origin=point.u)
    if not attempt.failure and np.linalg.norm(attempt.u - point.u) > FAR * amplitude:
        return attempt._replace(failure="it led far away")
    return attempt


def _directions(shapes: NDArray, mode: int, multiplicity: int) -> list[NDArray]:
    """Shapes (m,) along which a branch may leave.

    If several eigenvalues vanish together, branches leave only along some combinations of shapes.
    """
    first = shapes[:, mode]
    others = [k for k in range(multiplicity) if k != mode and mode < multiplicity]
    turned = [
        np.cos(angle) * first + np.sin(angle) * shapes[:, k]
        for k in others
        for angle in np.radians([15, -15, 30, -30, 45, -45, 60, -60, 75, -75])
    ]
    return [first, *turned]
