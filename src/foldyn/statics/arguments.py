"""What `trace` is given, checked and completed."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from numbers import Integral
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case, Gravity, State
from foldyn.errors import InputError
from foldyn.memory import check_memory
from foldyn.statics.methods import PathMethod
from foldyn.statics.origami import OrigamiProblem, drives, is_actuated
from foldyn.values import number, numbers, show, whole

STEPS_DRIVEN = 10
STEPS_FREE = 100
SHORTEST = 1e-3  # of a bar's length, that is left of it where a path starts
COPIES = 8  # of a point's dofs, while forces, work and the dataset are made of it
FIRST_STEP = 0.05  # of the load, or of the way to the last load factor


class PathPlan(NamedTuple):
    """Where a path begins and goes."""

    begin: float
    factors: list[float]  # that drive it; empty where the factor is free
    end: float | None  # of a free factor
    steps: int
    first_step: float


def plan(
    method: PathMethod, load_factors: Any, steps: int | None, first_step: float | None
) -> PathPlan:
    """Check the arguments that say where a path goes."""
    factors = None if load_factors is None else _factors(load_factors)
    if first_step is not None and method.rule is None:
        raise InputError(
            f": method {method.name!r} goes by load_factors or steps; leave it out", "first_step"
        )
    if method.rule is None:
        return _driven(method, factors, steps)
    if factors is not None and len(factors) != 2:
        raise InputError(
            f": method {method.name!r} chooses its own; give two numbers, where the "
            f"path begins and ends, instead of {len(factors)}, or leave them out",
            "load_factors",
        )
    begin, end = (0.0, None) if factors is None else factors
    if end == begin:
        raise InputError(f" = {factors}: begin and end must differ", "load_factors")
    way = 1.0 if end is None else end - begin
    step = FIRST_STEP * way if first_step is None else first_step
    if not number("first_step", step):
        raise InputError(f" = {show(first_step)}: give a number that is not zero", "first_step")
    if end is not None and step * way < 0.0:
        raise InputError(f" = {step:g} leads away from the last load factor {end:g}", "first_step")
    if end is not None and abs(step) > abs(way):
        step = way
    return PathPlan(begin, [], end, int(steps or STEPS_FREE), float(step))


def check_steps(steps: Any, dofs: int) -> None:
    """Refuse a count of steps that is none, or whose points memory cannot hold."""
    count = whole("steps", steps, least=1)
    check_memory(
        "steps", f"a path of {float(count):.3g} points", 8.0 * COPIES * count * dofs, "take fewer"
    )


def _driven(method: PathMethod, factors: list[float] | None, steps: int | None) -> PathPlan:
    if factors is not None and steps is not None:
        raise InputError(
            " and steps: give one of them; steps counts equal steps from 0 to 1", "load_factors"
        )
    if factors is None:
        count = int(steps or STEPS_DRIVEN)
        factors = [k / count for k in range(count + 1)]
    for i, (one, other) in enumerate(pairwise(factors)):
        if one == other:
            raise InputError(f": number {i + 1} repeats the one before, {one:g}", "load_factors")
    return PathPlan(factors[0], factors[1:], None, len(factors) - 1, 0.0)


def _factors(given: Any) -> list[float]:
    array = numbers("load_factors", given)
    if array.ndim != 1 or not array.size:
        raise InputError(f" = {show(given)}: give a list of numbers, at least one", "load_factors")
    return array.tolist()


def constant_loads(case: Case, constant: Any) -> tuple[int, ...]:
    """Numbers of the loads that do not grow with the load factor."""
    if isinstance(constant, str):
        if constant != "gravity":
            raise InputError(
                f' = {show(constant)}: give "gravity", or numbers of loads, as in [0]', "constant"
            )
        chosen = tuple(i for i, load in enumerate(case.loads) if isinstance(load, Gravity))
        if not chosen:
            raise InputError(' = "gravity": the case has no Gravity among its loads', "constant")
        return chosen
    if not isinstance(constant, Sequence | np.ndarray):
        raise InputError(f' = {show(constant)}: give "gravity", or numbers of loads', "constant")
    for which in constant:
        if isinstance(which, bool) or not isinstance(which, Integral):
            raise InputError(
                f" = {show(constant)}: give whole numbers of loads, as in [0]", "constant"
            )
        if not 0 <= int(which) < len(case.loads):
            raise InputError(
                f": the case has no load {show(which)}; it has {len(case.loads)}, counted from 0",
                "constant",
            )
    return tuple(sorted({int(which) for which in constant}))


def initial_state(case: Case, initial: Any) -> NDArray | None:
    """Displacements (n, 3) to start from, or None."""
    if initial is None:
        return None
    if not isinstance(initial, State):
        raise InputError(
            f": got {type(initial).__name__}; give a State, as fd.initial_state(path, at=-1)",
            "initial",
        )
    shape = case.structure.nodes.shape
    if initial.displacement is None:
        return np.zeros(shape)
    array = np.array(initial.displacement, float)
    if array.shape != shape:
        raise InputError(f": displacement of shape {array.shape}: the case has {shape}", "initial")
    return array


def check_case(
    case: Case, method: PathMethod, constant: Sequence[int], route: PathPlan, adaptive: bool
) -> None:
    """Refuse a case in which nothing happens along the path."""
    if not len(case.free_dofs):
        raise InputError(
            "supports: hold every node along x, y and z, so that nothing can move: free one"
        )
    moves = bool(case.imposed.any()) or is_actuated(case)
    if method.name == "displacement" and not moves:
        raise InputError(
            " 'displacement' needs something that moves: an Impose among the supports or an "
            "Actuate among the loads; paths under forces take 'newton' or 'arc_length'",
            "method",
        )
    if not route.factors and route.begin == 0.0 and method.rule is None:
        return  # one point, of what is constant
    if not (drives(case, constant) or adaptive):
        raise InputError(
            "nothing grows along the path: give a Force, Gravity, Actuate or Impose that is not "
            "among the constant loads (load_factors = [0] finds the state under these alone)"
        )


def check_start(problem: OrigamiProblem) -> None:
    """Refuse a state in which a bar has no length left."""
    structure = problem.structure
    x = structure.nodes + problem.displacement(problem.start())
    length = np.linalg.norm(x[structure.bars[:, 1]] - x[structure.bars[:, 0]], axis=1)
    short = np.flatnonzero(~(length > SHORTEST * structure.bar_length))
    if short.size:
        one, other = structure.bars[short[0]]
        raise InputError(f": the neighboring nodes {one} and {other} fall together", "initial")


def check_actuation(problem: OrigamiProblem, route: PathPlan) -> None:
    """Refuse load factors at which a rest angle would leave 0 to 360 degrees."""
    if not problem.actuation.acts:
        return
    for factor in (route.begin, *route.factors, *([] if route.end is None else [route.end])):
        beyond = np.flatnonzero(np.isnan(problem.actuation.rest(factor)))
        if beyond.size:
            raise InputError(
                f": at {factor:g} the rest angle of crease {beyond[0]} would leave 0 "
                "to 360 degrees; actuated folds reach their angle at the factor 1",
                "load_factors",
            )
