"""The record of a path: its dataset, and the changes of its stability in words.

A limit point located by a method with a free load factor is expected, and is marked in the result.
If negative eigenvalues appear anywhere else, a warning says so: a real structure leaves the path
at this point, although the points that follow are equilibria like all others.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import NDArray
from scipy import sparse

from foldyn.errors import (
    ComputationError,
    CrossingWarning,
    ModelRangeWarning,
    MotionInterrupted,
    warn,
)
from foldyn.mechanics.following import ASYMMETRIC, NO_POTENTIAL, asymmetry
from foldyn.results import path_dataset
from foldyn.results.crossings import crossings_of
from foldyn.statics.equilibrium import OrigamiProblem
from foldyn.statics.newton import Solver
from foldyn.statics.path_methods import METHODS
from foldyn.statics.stepping import REMEDY_COLLISION, REMEDY_LOCKED, PathStoppedError, Point, Walk
from foldyn.structures.beyond_range import TURN, far_turn, kept_apart, locks, panel_turns
from foldyn.structures.mesh import hinge_angles, lengths
from foldyn.structures.stretching import warn_of_stretching

MOST_STRETCH = 2.0  # stretch of a bar: no sheet can be followed beyond it
CLOSED = 179.0  # degrees from flat beyond which a fold counts as closed
MOST_LISTED = 20  # most stability changes listed in the attribute


def place_of(point: Point) -> str:
    """Location of a critical point, in words."""
    low, high = (f"{factor:.4g}" for factor in point.interval or (point.factor, point.factor))
    return f"the load factor {low}" if low == high else f"a load factor between {low} and {high}"


class Change(NamedTuple):
    """Two neighboring points with different counts; `before` is None at the start of the path."""

    before: Point | None
    after: Point

    @property
    def critical(self) -> Point | None:
        """Whichever of the two points is a located critical point; None if neither is."""
        both = sorted(filter(None, (self.before, self.after)), key=lambda point: point.negative)
        return next((point for point in both if point.kind != "regular"), None)

    @property
    def loses(self) -> bool:
        """Whether negative eigenvalues appear."""
        return self.before is None or self.after.negative > self.before.negative

    def __str__(self) -> str:
        """Counts and load factors."""
        end, at = self.after, self.critical
        if self.before is None:
            return f"{end.negative} from the start, the load factor {end.factor:.4g}"
        start = self.before
        if at is not None:
            what = "limit point" if at.kind == "limit" else at.kind
            return f"{start.negative} up to {place_of(at)} ({what}), then {end.negative}"
        return (
            f"{start.negative} at the load factor {start.factor:.4g}, {end.negative} at "
            f"{end.factor:.4g}"
        )


def stability_changes(points: Sequence[Point], from_rest: bool) -> list[Change]:
    """Changes of the count along a path; with `from_rest`, the count is zero before the path."""
    counted = [point for point in points if point.negative >= 0]
    changes = [Change(a, b) for a, b in pairwise(counted) if a.negative != b.negative]
    if from_rest and counted and counted[0].negative:
        changes.insert(0, Change(None, counted[0]))
    return changes


def stability_facts(points: Sequence[Point], from_rest: bool) -> dict[str, Any]:
    """Attributes of a path: number of unstable points, and where the count changes."""
    counts = [point.negative for point in points]
    if max(counts, default=-1) < 0:
        return {"unstable_points": -1, "stability_changes": "not counted"}
    listed = [str(change) for change in stability_changes(points, from_rest)]
    more = [f"and {len(listed) - MOST_LISTED} more"] if len(listed) > MOST_LISTED else []
    return {
        "unstable_points": sum(count > 0 for count in counts),
        "stability_changes": "; ".join([*listed[:MOST_LISTED], *more]) or "none",
    }


def stability_warning(
    points: Sequence[Point], from_rest: bool, free: bool, timed: bool = False
) -> str:
    """Warning where a path loses stability; empty if it does not.

    free : whether the load factor is free, so that the path passes limit points.
    timed : whether the steps of the path take time.
    """
    losses = [
        change
        for change in stability_changes(points, from_rest)
        if change.loses and not (free and change.critical and change.critical.kind == "limit")
    ]
    if not losses:
        return ""
    most = max(point.negative for point in points)
    more = f", and at {len(losses) - 1} more places (up to {most})" if len(losses) > 1 else ""
    remedy = "switch_branch follows the path that crosses there"
    if losses[0].before is None:
        remedy = "start from a stable state"
    elif timed:
        remedy = "shorter steps show when this happens, and whether creep causes it"
    elif not any(change.critical for change in losses):
        remedy = f"method 'arc_length' locates the point, and {remedy}"
    return (
        f"the path loses stability: the count of negative eigenvalues is {losses[0]}{more}. A real "
        f"structure buckles or snaps there and leaves the path; {remedy}"
    )


def record(
    stations: Walk, progress: Callable[[Point], None] | None, solver: Solver,
    problem: OrigamiProblem, facts: dict[str, Any],
    until: Callable[[NDArray, float], bool] | None = None, adaptive: bool = False,
    watch: Callable[[NDArray, float], Any] | None = None,
) -> xarray.Dataset:  # fmt: skip
    """Follow a path and make its dataset; if it stops early, raise with the part computed.

    facts : the arguments of the run, stored as attributes.
    until : whether the path ends, given displacements (n, 3) and load factor.
    adaptive : whether an adaptive load acts.
    watch : as `until`, from the first point on; nothing is told of what it does not see.
    """
    began = time.perf_counter()
    points: list[Point] = []

    def dataset(status: str, **end: str) -> xarray.Dataset | None:
        effort = {"wall_seconds": time.perf_counter() - began}
        outcome = {"status": status, **end, **facts}
        return _dataset(points, solver, problem, outcome, effort, adaptive) if points else None

    try:
        for station in stations:
            _check_stretch(problem, station.point)
            points.append(station.point)
            if progress is not None:
                progress(station.point)
            if until is None and watch is None:
                continue
            at = problem.displacement(station.point.u).copy(), station.point.factor
            if until is not None and len(points) > 1 and until(*at):
                until = None
                break
            if watch is not None and watch(*at):
                return dataset("complete")  # type: ignore[return-value]
    except PathStoppedError as stop:
        remedy = _closed(problem, points) or stop.remedy
        if remedy == REMEDY_COLLISION and locks(problem.structure.fold_law):
            remedy = REMEDY_LOCKED
        partial = dataset("stopped", stopped_because=stop.reason, remedy=remedy)
        raise ComputationError(f"{stop.reason}; {remedy}", partial) from None
    except KeyboardInterrupt:
        partial = dataset("stopped", stopped_because="interrupted")
        raise MotionInterrupted(f"interrupted after {len(points)} points", partial) from None
    if until is not None:
        warn(
            f"the path ends at the load factor {points[-1].factor:.4g}, after {len(points)} "
            "points, and has not reached `until`: take more steps, or load factors that lead "
            "farther",
            "statics.md#methods",
        )
    path = dataset("complete" if until is None else "until not reached")
    assert path is not None, "every path has a first point"
    return path


def _check_stretch(problem: OrigamiProblem, point: Point) -> None:
    """Stop the path once a bar is twice as long as at rest, beyond any sensible range."""
    structure = problem.structure
    longer = lengths(structure.nodes + problem.displacement(point.u), structure.bars)
    longer /= structure.bar_length
    if not (longer > MOST_STRETCH).any():
        return
    bar = int(longer.argmax())
    one, other = structure.bars[bar]
    raise PathStoppedError(
        f"the path has left any sensible range: at the load factor {point.factor:.6g} the nodes "
        f"{one} and {other} are {longer[bar]:.3g} times as far apart as at rest",
        "end it before (until, load_factors or steps), or check the units of loads and modulus",
    )


def _closed(problem: OrigamiProblem, points: Sequence[Point]) -> str:
    """Remedy if the path ends because a fold is closed; empty otherwise."""
    structure = problem.structure
    if not points or not len(structure.folds) or problem.case.contact is not None:
        return ""
    state = structure.nodes + problem.displacement(points[-1].u)
    folds = np.degrees(hinge_angles(state, structure.folds))
    crease = int(np.argmax(np.abs(folds - 180.0)))
    if abs(folds[crease] - 180.0) < CLOSED:
        return ""
    apart = kept_apart(structure, *structure.folds[crease, :2].tolist())
    return f"crease {crease} is closed ({folds[crease]:.5g} degrees): {apart}"


def _dataset(
    points: Sequence[Point], solver: Solver, problem: OrigamiProblem, facts: dict[str, Any],
    effort: dict[str, float], adaptive: bool,
) -> xarray.Dataset:  # fmt: skip
    """Dataset of the points, with the case and the facts about the run."""
    from_rest = facts["started_from"] == "rest"
    free, timed = METHODS[facts["method"]].rule is not None, problem.memories.timed
    message = stability_warning(points, from_rest, free, timed)
    if message:
        warn(message, "statics.md#stability")
    if message := _asymmetry_warning(points[-1], problem):
        warn(message, "loads.md#pressure")
    residuals, energies, reactions, touches = [], [], [], []
    for point in points:
        problem.recall(point.memory)
        residuals.append(problem.residual(point.u, point.factor))
        energies.append(problem.energies(point.u, point.factor))
        reactions.append(problem.reactions(point.u, point.factor))
        touches.append(problem.touch(point.u, point.factor))
    begun = 0.0  # J, stored or dissipated from rest to the first point
    if from_rest:
        begun = float(energies[0].sum()) - problem.energy_at_rest
        begun += problem.memories.lost(points[0].memory)
    displacement = np.array([problem.displacement(p.u) for p in points])

    def named(at: int) -> str:
        return f"point {at} (load factor {points[at].factor:.6g})"

    crossings = crossings_of(problem.case, displacement)
    if len(crossings.first):
        text = crossings.text(named(int(crossings.first[0])), len(points))
        warn(text, "results.md#panels-that-cross", CrossingWarning)
    by_group = dict(zip(problem.groups, np.transpose(energies), strict=True))
    warn_of_stretching(problem.structure, by_group, displacement, named)
    if message := _turn_warning(problem, points, displacement):
        warn(message, "superelements.md#what-it-takes", ModelRangeWarning)
    if "tension" in touches[0]:
        tension = np.array([touch["tension"] for touch in touches])
        problem.case.pressed(tension, lambda at: f"the load factor {points[at].factor:.6g}")
    intervals = {}
    if any(point.interval for point in points):  # some critical points could not be located
        intervals["interval"] = [p.interval or (p.factor, p.factor) for p in points]
    own = "an adaptive load, a function of the user's own, acted on it"
    result = path_dataset(
        problem.case,
        [p.factor for p in points],
        displacement,
        np.reshape(reactions, (len(points), -1)),
        {**by_group, "work": _work(problem, points, residuals) + begun},
        {
            "negative_eigenvalues": [p.negative for p in points],
            "point": [p.kind for p in points],
            "iterations": [p.iterations for p in points],
            "residual": [p.residual for p in points],
            **intervals,
            **_memory(problem, points, from_rest),
            **{name: [touch[name] for touch in touches] for name in touches[0]},
        },
        {
            **facts,
            **asdict(solver.settings),
            "solver": solver.backend,
            "newton_iterations": solver.tally.iterations,
            "factorizations": solver.tally.factorizations,
            "step_cuts": solver.tally.cuts,
            **effort,
            **stability_facts(points, from_rest),
        },
        (own,) if adaptive else (),
    )
    return crossings.recorded(result)


def _turn_warning(problem: OrigamiProblem, points: Sequence[Point], displacement: NDArray) -> str:
    """Warning if panels of a linear model turn far; empty otherwise."""
    structure = problem.structure
    if not structure.linear:
        return ""
    turns = panel_turns(structure, displacement)
    at = int(np.argmax(turns > TURN))
    if turns[at] <= TURN:
        return ""
    return far_turn(structure, turns[at], f"point {at} (load factor {points[at].factor:.6g})")


def _memory(problem: OrigamiProblem, points: Sequence[Point], from_rest: bool) -> dict[str, Any]:
    """States of branches with memory, and the energy (J) dissipated by them and friction."""
    own, out = problem.memories, {}
    if problem.case.remembering:
        out["memory"] = [own.branches(point.memory) for point in points]
    if problem.case.remembering or own.rubs:
        lost = np.array([own.lost(point.memory) for point in points])
        out["dissipated"] = lost if from_rest else lost - lost[0]
    if own.timed:
        times = np.array([point.memory.time for point in points])
        out["elapsed"] = times - times[0]
    return out


def _asymmetry_warning(point: Point, problem: OrigamiProblem) -> str:
    """Warning if stability is judged without a large antisymmetric part of the load stiffness."""
    if point.negative < 0 or not problem.following.acts:
        return ""
    loads = problem.load_stiffness(point.u, point.factor)
    share = asymmetry(sparse.csr_array(loads[problem.free][:, problem.free]))
    if share <= ASYMMETRIC:
        return ""
    return (
        f"{NO_POTENTIAL.format(share)} the equilibria are exact, but negative eigenvalues are "
        "counted in the symmetric part of the tangent, which does not show flutter"
    )


def _work(
    problem: OrigamiProblem, points: Sequence[Point], residuals: Sequence[NDArray]
) -> NDArray:
    """Work (J) of loads, supports and actuators since the first point, by trapezoids."""
    forces = []
    for point, residual in zip(points, residuals, strict=True):
        force = problem.working(point.u, point.factor)
        force[problem.held] += residual[problem.held]
        forces.append(force)
    rates = [problem.actuation_rate(p.u, p.factor) for p in points]
    work = np.zeros(len(points))
    for k, (one, other) in enumerate(pairwise(points)):
        done = 0.5 * (forces[k] + forces[k + 1]) @ (other.u - one.u)
        done += 0.5 * (rates[k] + rates[k + 1]) * (other.factor - one.factor)
        work[k + 1] = work[k] + done
    return work
