"""Steps and samples: makes duration, time step, output interval and loads fit together.

A pulse between the ends of steps would be lost silently. Adaptive methods therefore end steps at
the knots of the histories and check between knots. With a fixed step, the user is warned
beforehand of the share of a history that the method misses.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case, History
from foldyn.cases.history import CALLED
from foldyn.dynamics.motion_state import StepPlan
from foldyn.errors import InputError, warn
from foldyn.ram_limit import GIB, check_memory
from foldyn.values import number, whole

MOST_STEPS = 1e13  # largest number of steps; takes years for any structure
SHARPEST = 1e-9  # steps below this share of the start time are lost in rounding
DEFAULT_FRACTION = 0.5  # default step relative to the critical step
SAME_TIME = 1e-12  # stops closer than this share of the largest time count as one
NOTICED = 0.01  # share of a load that is missed, above which to warn
MOST_LOOKS = 20_000  # evaluations; longer motions are checked near knots and at some places
MOST_CALLS = 500  # largest number of evaluations of a user function, which is slow
MOST_PLACES = 100
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(4)
MEMORY, IMPLICIT_MEMORY = 200, 20  # number of steps for which a vibration remembers a load
LARGEST_STEP = 1e-3  # share of the largest step: short compared to loads that steps resolve
SPAN = 0.05  # distance of points that differentiate user histories, relative to a step


def apart(plan: StepPlan, critical: float) -> float:
    """Distance (s) of the points for differentiating user histories."""
    return SPAN * min(plan.dt, critical) * (1.0 if plan.steps else LARGEST_STEP)


class SampleSpacing(NamedTuple):
    """Sampling rule of a motion: a step count or a time interval."""

    steps: int  # number of steps between samples; 0 to use `interval`
    interval: float  # time between samples, s; 0.0 to use `steps`


def sampling(duration: float, every_steps: int | None, interval: float | None) -> SampleSpacing:
    """Sampling rule for the arguments of `simulate`; every step by default."""
    if interval is None:
        steps = 1 if every_steps is None else every_steps
        return SampleSpacing(whole("every_steps", steps, least=1, what="steps"), 0.0)
    if every_steps is not None:
        raise InputError(": give either every_steps or interval, not both", "every_steps")
    interval = float(number("interval", interval, above=0.0, unit="s"))
    if interval > duration * (1.0 + 1e-9):
        raise InputError(
            f" = {interval:g} s: longer than the duration of {duration:g} s", "interval"
        )
    return SampleSpacing(0, interval)


def fixed_steps(
    duration: float, dt: float | None, sampling: SampleSpacing, critical: float, start: float
) -> StepPlan:
    """Fit a time step and the sampling to a duration.

    Without `dt` the step is half the critical step, shortened so that it divides the sampling
    interval and the duration.
    """
    per_sample, interval = sampling
    if dt is None:
        target = DEFAULT_FRACTION * critical
        if not math.isfinite(target):
            raise InputError(": nothing limits the step of this case (no stiffness); give dt", "dt")
        span = interval or duration
        _check_count(duration, min(target, span))
        count = max(1, math.ceil(span / target * (1.0 - 1e-12)))
        dt = span / count
        per_sample = per_sample or count
    else:
        dt = _given_step(duration, dt)
        per_sample = per_sample or max(1, round(interval / dt))
        if abs(per_sample * dt - interval) > 1e-9 * interval > 0.0:
            near = interval / max(1, math.ceil(interval / dt))
            raise InputError(
                f" = {interval:g} s is not a whole number of steps of dt = {dt:g} s; "
                f"use dt = {near:.6g}, or leave dt out",
                "interval",
            )
    steps = math.floor(duration / dt * (1.0 + 1e-12) + 1e-9)
    if per_sample > steps:
        raise InputError(f" = {per_sample}: longer than the motion of {steps} steps", "every_steps")
    end = start + steps * dt
    return StepPlan(start, end, dt, steps, per_sample, per_sample * dt, 0.0, 0.0, np.zeros(0))


def variable_steps(
    duration: float, dt: float | None, sampling: SampleSpacing, largest: float, start: float,
    tolerance: float, floor: float, knots: NDArray,
) -> StepPlan:  # fmt: skip
    """Plan of a motion with error-controlled steps; `dt` is the largest step.

    Without `dt`, the largest step is `largest`, but at most a tenth of the motion. Knots outside
    the motion are dropped, and so are knots that rounding cannot separate from the previous one.
    """
    dt = min(largest, 0.1 * duration) if dt is None else _given_step(duration, dt)
    _check_count(duration, dt)
    end = start + duration
    within = np.sort(knots[(knots > start) & (knots <= end)])
    apart = np.diff(within, prepend=start) > SAME_TIME * max(abs(start), abs(end))
    return StepPlan(start, end, dt, 0, *sampling, tolerance, floor, within[apart])


def expected_samples(plan: StepPlan) -> int:
    """Number of samples including the start; a lower bound if variable steps are counted."""
    if plan.steps:
        return plan.steps // plan.every + 1
    if plan.every:
        return int((plan.end - plan.start) / plan.dt / plan.every) + 2
    return math.floor((plan.end - plan.start) / plan.interval * (1.0 + 1e-12) + 1e-9) + 1


def steps_taken(plan: StepPlan, tally: np.record) -> dict[str, float]:
    """Steps and samples of a motion, for its result."""
    facts = {"start": plan.start, "duration": plan.end - plan.start}
    if plan.steps:
        return facts | {"dt": plan.dt, "steps": plan.steps, "every_steps": plan.every}
    steps = int(tally.steps)
    return facts | {
        "dt": float(tally.time - plan.start) / max(steps, 1),
        "steps": steps,
        **({"every_steps": plan.every} if plan.every else {"interval": plan.interval}),
        "tolerance": plan.tolerance,
        "refused_steps": int(tally.refused),
        "smallest_step": float(tally.shortest) if steps else 0.0,
        "largest_step": float(tally.longest),
    }


def _given_step(duration: float, dt: float) -> float:
    dt = number("dt", dt, above=0.0)
    _check_count(duration, dt)
    if dt > duration * (1.0 + 1e-9):
        raise InputError(f" = {dt:g} s: longer than the duration of {duration:g} s", "dt")
    return dt


def _check_count(duration: float, dt: float) -> None:
    """Refuse a motion with more steps than a machine can finish or integers can count."""
    if duration / dt > MOST_STEPS:
        raise InputError(
            f" = {duration:g} s: takes {duration / dt:.3g} steps of {dt:.3g} s; shorten it",
            "duration",
        )


def check_rounding(plan: StepPlan) -> None:
    """Refuse steps that rounding of the time removes."""
    if plan.dt < SHARPEST * abs(plan.start):
        raise InputError(
            f" = {plan.start:g} s: steps of {plan.dt:.3g} s are lost in its rounding; start "
            "nearer to 0",
            "start",
        )


def check_samples(samples: int, nodes: int, supported: int, motions: int = 1) -> None:
    """Refuse an output that exceeds memory, before anything is computed."""
    together = f" of {motions} mass rules" if motions > 1 else ""
    check_memory(
        "interval", f"{samples:.3g} samples of {nodes} nodes{together}",
        8.0 * samples * (6 * nodes + supported + 6), "keep fewer samples, or shorten the duration",
    )  # fmt: skip


def check_room(samples: int, nodes: int, supported: int, room: float) -> None:
    """Refuse an output that exceeds the free disk space (bytes), before anything is computed."""
    needed = 8.0 * samples * (6 * nodes + supported + 6)
    if needed > room:
        raise InputError(
            f": {samples:.3g} samples of {nodes} nodes needs about {needed / GIB:.3g} GiB, more "
            f"than the {room / GIB:.3g} GiB that are free on the disk: keep fewer samples, or "
            "shorten the duration",
            "interval",
        )


def histories(case: Case) -> Iterator[tuple[str, History]]:
    """Varying histories of a case, each with the name of what it drives."""
    # moments of creases are loads
    rest = len(case.body.sheet.rest_angles) - case.body.sheet.offsets
    driven = {
        "a load": (*case.load_terms, *case.following_terms),
        "an imposed displacement": case.imposed_terms,
        "a base motion": case.base_terms,
        "the wind": case.wind_terms,
        "a plane": case.obstacle_terms,
        "a spring or cable": [(None, history) for history in case.elastic_body.histories],
        "an actuation": [(turn, history) for turn, history in case.rest_terms if turn[:rest].any()],
    }
    for what, terms in driven.items():
        yield from ((what, history) for _, history in terms if history.kind != "constant")


def knots(case: Case) -> NDArray[np.float64]:
    """Times (s) of jumps or corners of loads, supports, planes, wind and rest angles."""
    return np.unique([time for _, history in histories(case) for time in history.knots() or ()])


def jumps(case: Case) -> tuple[float, ...]:
    """Times (s) at which loads or wind jump; for user functions, the declared times."""
    times: set[float] = set()
    for _, history in (*case.load_terms, *case.following_terms, *case.wind_terms):
        called = history.code == CALLED
        times.update((history.knots() or ()) if called else history.jumps())
    return tuple(sorted(times))


def warn_of_functions(case: Case) -> None:
    """Warn of user functions of time, which variable steps sample at few points only."""
    for what, history in histories(case):
        if history.knots() is None:
            warn(
                f"the history of {what} is a function whose jumps and corners are unknown: each "
                "step evaluates it at a few points and may miss shorter pulses; "
                "give their times: fd.Function(f, at=[0.2, 0.25]), or at=[] if it is smooth",
                "integrators.md#steps",
            )
            return


def warn_of_coarse_steps(
    case: Case, plan: StepPlan, looks: tuple[float, ...], implicit: bool
) -> None:
    """Warn if steps of dt do not resolve a history.

    looks : fractions of a step, from 0 to 1, at which the method evaluates loads.
    """
    memory = IMPLICIT_MEMORY if implicit else MEMORY
    for what, history in histories(case):
        share = overlooked(history, plan, looks, memory, implicit)
        if share > NOTICED:
            warn(
                f"steps of {plan.dt:.3g} s do not resolve the history {history.kind} of {what}: "
                f"the values they use are off by {share:.0%}; take a smaller dt, or a method that "
                'chooses its steps: "dormand_prince", or an implicit one without dt',
                "integrators.md#steps",
            )


def overlooked(
    history: History, plan: StepPlan, looks: tuple[float, ...], memory: int, jumps: bool
) -> float:
    """Share of a history that fixed steps miss; see `warn_of_coarse_steps`.

    It is the largest integral over `memory` steps of the distance between the history and the
    polynomial through the evaluated points, relative to the largest integral of the history.

    jumps : whether steps are divided where loads jump.
    """
    unseen, whole = 0.0, 0.0
    try:
        for first, last in _stretches(history, plan, memory):
            ends = plan.start + plan.dt * np.arange(first, last + 1)
            if jumps:
                ends = np.union1d(ends, [t for t in history.jumps() if ends[0] < t < ends[-1]])
            gap, size = _integrals(history, ends, looks, jumps)
            unseen = max(unseen, _largest_sum(gap, memory))
            whole = max(whole, _largest_sum(size, memory))
    except InputError:  # a failing function: the motion will stop there, with the reason
        return 0.0
    return unseen / whole if whole > 0.0 else 0.0


def unfollowed(history: History, ends: NDArray, looks: tuple[float, ...]) -> NDArray:
    """Share (k,) of the integral of a history that each step between `ends` misses.

    Steps are divided where the history jumps; see `overlooked`.
    """
    divided = np.union1d(ends, [t for t in history.jumps() if ends[0] < t < ends[-1]])
    gap, size = _integrals(history, divided, looks, True)
    step = np.searchsorted(ends, divided[:-1], side="right") - 1
    whole = float(size.sum())
    return np.bincount(step, gap, len(ends) - 1) / whole if whole else np.zeros(len(ends) - 1)


def _stretches(history: History, plan: StepPlan, memory: int) -> list[tuple[int, int]]:
    """Stretches of steps (first, last) to check: all, or those likely to matter most."""
    turns = history.knots()
    most = MOST_CALLS if turns is None else MOST_LOOKS
    if plan.steps <= most:
        return [(0, plan.steps)]
    length = min(2 * memory, most)
    places = np.linspace(0, plan.steps, max(2, most // length))
    if turns:
        at = (np.array(turns) - plan.start) / plan.dt
        at = at[(at > -1.0) & (at < plan.steps + 1.0)]
        places = np.append(places, at[:: max(1, len(at) // MOST_PLACES)])
    firsts = np.clip(places - 0.5 * length, 0, plan.steps - length).astype(np.int64)
    return [(int(first), int(first) + length) for first in np.unique(firsts)]


def _integrals(
    history: History, ends: NDArray, looks: tuple[float, ...], jumps: bool
) -> tuple[NDArray, NDArray]:
    """Integrals, for each step between `ends`, of the missed part of a history and of its size."""
    turns = np.array([t for t in history.knots() or () if ends[0] < t < ends[-1]])
    pieces = np.union1d(ends, turns)
    length = 0.5 * np.diff(pieces)
    times = pieces[:-1, None] + length[:, None] * (1.0 + POINTS)
    step = np.searchsorted(ends, times[:, 0], side="right") - 1
    h = np.diff(ends)
    looked = ends[:-1, None] + h[:, None] * np.array(looks)
    if jumps:  # steps end before a jump
        looked[:, -1] = np.nextafter(ends[1:], -np.inf)
    values, seen = history(times), history(looked)
    place = (times - ends[step, None]) / h[step, None]
    line = np.zeros_like(values)
    for k, at in enumerate(looks):  # Lagrange polynomials
        others = [x for x in looks if x != at]
        basis = np.prod([(place - x) / (at - x) for x in others], axis=0)
        line += seen[step, k, None] * basis
    return tuple(
        np.bincount(step, (np.abs(each) @ WEIGHTS) * length, len(h))
        for each in (values - line, values)
    )  # type: ignore[return-value]


def _largest_sum(values: NDArray, count: int) -> float:
    """Largest sum of `count` consecutive values."""
    sums = np.concatenate([[0.0], np.cumsum(values)])
    count = min(count, len(values))
    return float((sums[count:] - sums[:-count]).max())
