"""Basins of attraction: which motion each start in a plane of starts ends in."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.cases import Case, State
from foldyn.dynamics import critical_step, simulate_many
from foldyn.errors import InputError
from foldyn.periodic.drive import Drive
from foldyn.periodic.sections import strobe_of
from foldyn.results.periodic_dataset import basins_dataset
from foldyn.values import number, numbers, of_kind, whole

if TYPE_CHECKING:
    import xarray

UNSETTLED = -1
LOOKS = 50  # starts, about, whose critical steps are looked at


def basins(
    case: Case,
    first: Sequence[ArrayLike],
    second: Sequence[ArrayLike],
    ranges: Sequence[Sequence[float]],
    counts: Sequence[int] = (32, 32),
    *,
    duration: float,
    dt: float | None = None,
    tolerance: float = 1e-2,
    threads: int | None = None,
) -> xarray.Dataset:
    """Attractor that each start on a grid ends in.

    Starts are a times the first direction plus b times the second, of displacement and velocity
    together: for a bistable cell a is a displacement towards the other well, b a velocity.

    Parameters
    ----------
    case : Case
        With damping; without drive, or driven by `Harmonic` histories.
    first, second : (ndarray of shape (n, 3), ndarray of shape (n, 3))
        Displacement (m) and velocity (m/s) at a = 1, and at b = 1.
    ranges : ((float, float), (float, float))
        Of a, and of b.
    counts : (int, int)
        Points along each, both ends among them.
    duration : float
        Of each motion, s; of a driven one rounded up to whole periods.
    dt : float, optional
        Step at most, s; half the least critical step at some of the starts by default.
    tolerance : float
        Distance of ends that count as one, over the largest distance of two ends. A motion that
        moves further than that in its last period (or last tenth, without drive) is unsettled.
    threads : int, optional
        As of `simulate_many`, which computes the motions by central differences.

    Returns
    -------
    xarray.Dataset
        `basin` (a, b): number of the attractor, the one of most starts first, -1 where a motion is
        unsettled or fails; `share` (attractor) of the starts; `displacement` and `velocity`
        (attractor, node, axis) of an end.

    Raises
    ------
    InputError
        An argument out of range; directions that do not fit; what `simulate_many` refuses.
    """
    of_kind("case", case, Case)
    directions = [
        _direction(case, name, one) for name, one in (("first", first), ("second", second))
    ]
    limits = numbers("ranges", ranges)
    if limits.shape != (2, 2) or (limits[:, 0] >= limits[:, 1]).any():
        raise InputError(f" = {ranges!r}: must be two increasing pairs", "ranges")
    if not isinstance(counts, Sequence) or len(counts) != 2:
        raise InputError(f" = {counts!r}: must be two whole numbers", "counts")
    sizes = [whole(f"counts[{k}]", count, least=2) for k, count in enumerate(counts)]
    duration = number("duration", duration, above=0.0, unit="s")
    tolerance = number("tolerance", tolerance, above=0.0, below=1.0)
    a, b = (np.linspace(limits[k, 0], limits[k, 1], sizes[k]) for k in range(2))
    states = [_start(directions, one, other) for one in a for other in b]
    if dt is None:
        dt = _half_critical(case, states[:: max(1, len(states) // LOOKS)])
    last, dt, total = _timing(case, duration, number("dt", dt, above=0.0, unit="s"))
    run = simulate_many(
        [case] * len(states), total, dt=dt, every=last, initial=states, threads=threads
    )
    pair = [run[name].values[:, -2:] for name in ("displacement", "velocity")]
    number_of, ends = _sorted(pair, dt * last, tolerance)
    shape = len(a), len(b)
    facts = {"duration": total, "tolerance": tolerance, "dt": dt}
    kept = [values[ends, 1] for values in pair]
    return basins_dataset(case, a, b, number_of.reshape(shape), kept[0], kept[1], facts)


def _direction(case: Case, name: str, given: Sequence[ArrayLike]) -> tuple[NDArray, NDArray]:
    if not isinstance(given, Sequence) or len(given) != 2:
        raise InputError(": must be a displacement and a velocity", name)
    both = [numbers(f"{name}[{k}]", one) for k, one in enumerate(given)]
    for k, one in enumerate(both):
        if one.shape != case.structure.nodes.shape:
            raise InputError(
                f": shape {one.shape}; the case has {case.structure.nodes.shape}", f"{name}[{k}]"
            )
    return both[0], both[1]


def _start(directions: list[tuple[NDArray, NDArray]], a: float, b: float) -> State:
    return State(*(a * one + b * other for one, other in zip(*directions, strict=True)))


def _half_critical(case: Case, states: list[State]) -> float:
    """Half the least critical step (s) in some states."""
    shape = case.structure.nodes.shape
    starts = [state.of_nodes("displacement", shape) for state in states]
    return 0.5 * min(critical_step(case, "central_difference", u) for u in starts)


def _timing(case: Case, duration: float, most: float) -> tuple[int, float, float]:
    """Steps between the last two samples, the step (s), at most so long, and the whole duration."""
    if Drive(case).varies:
        strobe = strobe_of(case, "basins")
        steps = max(strobe.per_period, math.ceil(strobe.period / most))
        periods = max(2, math.ceil(duration / strobe.period))
        return steps, strobe.period / steps, periods * strobe.period
    steps = 10 * math.ceil(duration / (10.0 * most))
    return steps // 10, duration / steps, duration


def _sorted(pair: list[NDArray], apart: float, tolerance: float) -> tuple[NDArray, NDArray]:
    """Attractor (m,) of each motion, and the number of a motion that ends in each.

    pair : displacement and velocity (m, 2, n, 3) at two samples `apart` s from each other.
    """
    count = len(pair[0])
    states = np.concatenate(
        [pair[0].reshape(count, 2, -1), apart * pair[1].reshape(count, 2, -1)], 2
    )
    ends = states[:, 1]
    sound = np.isfinite(states).all(axis=(1, 2))
    span = np.linalg.norm(np.ptp(ends[sound], axis=0)) if sound.any() else 0.0
    settled = sound & (np.linalg.norm(ends - states[:, 0], axis=1) <= tolerance * span)
    found = np.full(count, UNSETTLED)
    examples: list[int] = []
    for k in np.flatnonzero(settled):
        distance = [np.linalg.norm(ends[k] - ends[one]) for one in examples]
        near = int(np.argmin(distance)) if distance else 0
        if not distance or distance[near] > tolerance * span:
            examples.append(int(k))
            near = len(examples) - 1
        found[k] = near
    sizes = np.array([(found == j).sum() for j in range(len(examples))], int)
    order = np.argsort(-sizes, kind="stable")
    rank = np.empty(len(order) + 1, int)
    rank[order], rank[-1] = np.arange(len(order)), UNSETTLED  # and found = -1 takes the last
    return rank[found], np.array(examples, int)[order]
