"""A branch of a law: a damper parallel to a crease that turns in balance with edge angles.

The moment is c times the rate r of the turn d. Per unit stiffness of the adjacent panels it is
r / q, with q the rate at which these panels would return the crease. In a step h the rate goes from
r0 to r1 as a + b exp(-q t):

    d = h ((1 - w) r0 + w r1),    w = 1 / (1 - exp(-q h)) - 1 / (q h),

which is the trapezoidal rule for short steps, and the backward Euler method for long ones (W.
Liniger and R. A. Willoughby, SIAM J. Numer. Anal. 7, 1970).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import scalar
from foldyn.materials.formulas import BranchFormulas
from foldyn.materials.inelastic_law import Branch
from foldyn.materials.law import columns

CODE = 3  # code of the branch
FEW = 1e-3  # series avoid cancellation if q h is below this
NO_TIME = 1e-6  # time in which a jump of loads turns a crease, relative to 1 / q


@scalar
def update(p, before, after, dt, rate, turned):
    """Rate, turn, moment, slope, 0 and loss, divided by k, after a turn in a time dt."""
    time, pace = p[0], p[1]
    if dt == 0.0:
        now = rate + (after - before) * pace / NO_TIME
        return now, after, time * now, time * pace / NO_TIME, 0.0, 0.0
    x = pace * dt
    left = -math.expm1(-x)
    if x < FEW:
        w, square = 0.5 + x / 12.0, 1.0 / 3.0 - x / 12.0
    else:
        w, rest = 1.0 / left - 1.0 / x, 1.0 - left
        square = (0.5 * (1.0 + rest) - 2.0 * rest) / (x * left) + rest * rest / (left * left)
    now = ((after - before) / dt - (1.0 - w) * rate) / w
    change = rate - now
    lost = dt * (now * now + 2.0 * (1.0 - w) * now * change + square * change * change)
    return now, after, time * now, time / (w * dt), 0.0, time * lost


FORMULAS = BranchFormulas(CODE, update, None)


def damper_branch(panels: NDArray, damping: NDArray) -> Branch:
    """Branch of dampers (n,), N m s/rad, on creases of panels with stiffnesses (n,), N m/rad."""
    there = damping > 0.0
    pace = np.divide(panels, damping, out=np.ones(len(there)), where=there)
    return Branch(CODE, columns(len(pace), there / pace, pace), 0.0, there * 1.0, pace)
