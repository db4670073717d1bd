"""Steps and samples: how duration, time step and output interval fit together."""

from __future__ import annotations

import math
from numbers import Integral, Real

import numpy as np
from numpy.typing import NDArray

from foldyn.dynamics.course import StepPlan
from foldyn.errors import InputError
from foldyn.memory import check_memory
from foldyn.values import number, show, whole

MOST_STEPS = 1e13  # years of computing, whatever the structure
DEFAULT_FRACTION = 0.5  # of the critical step, where the user leaves the choice to us
SAME_TIME = 1e-12  # of the largest time: stops as near as that are one
NO_STOPS = np.zeros(0)


def fixed_steps(
    duration: float, dt: float | None, every: int | float, critical: float, start: float = 0.0
) -> StepPlan:
    """Fit a time step and the sampling to a duration.

    `every` counts steps if it is an int and seconds if it is a float. Without `dt` the step is
    half the critical one, shortened so that it divides the sampling interval and the duration.
    """
    duration = number("duration", duration, above=0.0)
    in_seconds = counted_in_seconds(duration, every)
    if dt is None:
        target = DEFAULT_FRACTION * critical
        if not math.isfinite(target):
            raise InputError(": nothing limits the step of this case (no stiffness); give dt", "dt")
        span = float(every) if in_seconds else duration
        _check_count(duration, min(target, span))
        count = max(1, math.ceil(span / target * (1.0 - 1e-12)))
        dt = span / count
        per_sample = count if in_seconds else int(every)
    else:
        dt = _given_step(duration, dt)
        per_sample = max(1, round(every / dt)) if in_seconds else int(every)
        if in_seconds and abs(per_sample * dt - every) > 1e-9 * every:
            near = every / max(1, math.ceil(every / dt))
            raise InputError(
                f" = {every:g} s is not a whole number of steps of dt = {dt:g} s; "
                f"use dt = {near:.6g}, or leave dt out",
                "every",
            )
    steps = math.floor(duration / dt * (1.0 + 1e-12) + 1e-9)
    if per_sample > steps:
        raise InputError(f" = {every}: longer than the motion of {steps} steps", "every")
    interval = per_sample * dt
    return StepPlan(start, start + steps * dt, dt, steps, per_sample, interval, 0.0, 0.0, NO_STOPS)


def variable_steps(
    duration: float, dt: float | None, every: int | float, largest: float, start: float,
    tolerance: float, floor: float = 0.0, knots: NDArray = NO_STOPS,
) -> StepPlan:  # fmt: skip
    """StepPlan of a motion whose steps follow their error; `dt` is the largest step.

    Without `dt` it is `largest`, at most a tenth of the motion. Of the knots those are kept that
    lie within the motion and that time can tell apart.
    """
    duration = number("duration", duration, above=0.0)
    in_seconds = counted_in_seconds(duration, every)
    dt = min(largest, 0.1 * duration) if dt is None else _given_step(duration, dt)
    _check_count(duration, dt)
    interval = float(every) if in_seconds else 0.0
    end = start + duration
    within = np.sort(knots[(knots > start) & (knots < end)])
    apart = np.diff(within, prepend=start) > SAME_TIME * max(abs(start), abs(end))
    per_sample = 0 if in_seconds else int(every)
    return StepPlan(start, end, dt, 0, per_sample, interval, tolerance, floor, within[apart])


def expected_samples(plan: StepPlan) -> int:
    """Number of samples, the first at the start; where steps vary and are counted, the least."""
    if plan.steps:
        return plan.steps // plan.every + 1
    if plan.every:
        return int((plan.end - plan.start) / plan.dt / plan.every) + 2
    return math.floor((plan.end - plan.start) / plan.interval * (1.0 + 1e-12) + 1e-9) + 1


def counted_in_seconds(duration: float, every: int | float) -> bool:
    """Whether a sampling interval is in seconds; refuses one that fits no motion."""
    if isinstance(every, bool) or not isinstance(every, Real):
        raise InputError(f" = {show(every)}: an int counts steps, a float is seconds", "every")
    if isinstance(every, Integral):
        whole("every", every, least=1, what="steps")
        return False
    if number("every", every, above=0.0) > duration * (1.0 + 1e-9):
        raise InputError(f" = {every:g} s: longer than the duration of {duration:g} s", "every")
    return True


def _given_step(duration: float, dt: float) -> float:
    dt = number("dt", dt, above=0.0)
    _check_count(duration, dt)
    if dt > duration * (1.0 + 1e-9):
        raise InputError(f" = {dt:g} s: longer than the duration of {duration:g} s", "dt")
    return dt


def _check_count(duration: float, dt: float) -> None:
    """Refuse a motion that no machine can finish, and that integers could not count."""
    if duration / dt > MOST_STEPS:
        raise InputError(
            f" = {duration:g} s: takes {duration / dt:.3g} steps of {dt:.3g} s; shorten it",
            "duration",
        )


def check_samples(samples: int, nodes: int, supported: int, motions: int = 1) -> None:
    """Refuse an output that memory cannot hold, before anything is computed."""
    together = f" of {motions} mass rules" if motions > 1 else ""
    check_memory(
        "every", f"{samples:.3g} samples of {nodes} nodes{together}",
        8.0 * samples * (6 * nodes + supported + 6), "raise it, or shorten the duration",
    )  # fmt: skip
