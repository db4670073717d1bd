"""How long the next step of an implicit method is: by its error, and by where loads jump."""

from __future__ import annotations

import math

import numpy as np

from foldyn.dynamics.course import StepPlan

SAME_TIME = 1e-9  # of a step: times as near as that are one
# the control of the step by its error
SAFETY = 0.9
GROWTH = 2.0  # of a step at most
WORTHWHILE = 1.25  # growth below which the step, and with it the matrix, is kept
NEAR, CUT = 0.95, 0.85  # below which the error is about to be too large, and what is done then
LEAST = 0.2  # share of a refused step that is tried next, at least


def next_step(h: float, error: float) -> float:
    """Step after an accepted one of h (s) with the error, relative to the tolerance."""
    factor = GROWTH if error <= 0.0 else min(GROWTH, SAFETY * error ** (-1.0 / 3.0))
    if factor < NEAR:
        return h * CUT
    return h if factor < WORTHWHILE else h * factor


def smaller_step(h: float, error: float) -> float:
    """Step after a refused one."""
    return h * min(0.9, max(LEAST, SAFETY * error ** (-1.0 / 3.0)))


def next_stop(plan: StepPlan, t: float, end: float, near: float) -> float:
    """Where a step from t has to end at the latest, for the knots of the histories."""
    k = int(np.searchsorted(plan.stops, t + near, side="right"))
    return plan.stops[k] if k < len(plan.stops) and plan.stops[k] < end - near else end


def divide(
    t: float, goal: float, wanted: float, jump: float | None
) -> tuple[float, float, float | None]:
    """Step from t, the first of equal ones to the goal, its end, and the jump if it is there."""
    parts = max(1, math.ceil((goal - t) / wanted * (1.0 - SAME_TIME)))
    h = (goal - t) / parts
    return (h, goal, jump) if parts == 1 else (h, t + h, None)
