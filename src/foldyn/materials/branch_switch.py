"""The one compiled switch from the code of a branch of a law with memory to its formulas."""

from __future__ import annotations

import numpy as np

from foldyn.jit.compiled import kernel, scalar
from foldyn.materials import crease_damper, eyring, plastic, prony

MEMORY_LAWS = (prony.Prony, plastic.Plastic, eyring.Eyring)


@scalar
def update(code, p, before, after, dt, one, other):
    """State (two numbers), moment, slope, energy and loss of a branch, per unit stiffness.

    Parameters
    ----------
    code : int
    p : (4,) its parameters.
    before, after : turn from the rest angle at the last accepted step, and now, rad.
    dt : time since then, s; the slope is the derivative of the moment with respect to `after`.
    one, other : the state at that step.

    What has not moved in no time stays as it is, bit by bit.
    """
    if code == prony.CODE:
        return prony.update(before, after, dt, one, p[0], p[1])
    if code == plastic.CODE:
        return plastic.update(before, after, one, other, p[0], p[1], p[2])
    if code == eyring.CODE:
        return eyring.update(before, after, dt, one, p[0], p[1])
    if code == crease_damper.CODE:
        return crease_damper.update(before, after, dt, one, p[0], p[1])
    return np.nan, np.nan, np.nan, np.nan, np.nan, np.nan


@scalar
def mean_moment(code, p, before, after, dt, one, other):
    """Mean moment of a branch in a step, its derivative by `after`, and what is not lost.

    The work along the turn is the change of the energy and the loss of `update` less the last one.
    """
    if code == prony.CODE:
        return prony.mean_moment(before, after, dt, one, p[0], p[1])
    if code == plastic.CODE:
        return plastic.mean_moment(before, after, one, other, p[0], p[1], p[2])
    if code == eyring.CODE:
        return eyring.mean_moment(before, after, dt, one, p[0], p[1])
    return np.nan, np.nan, np.nan


@kernel
def branch_table(code, p, after, dt, start, out):
    """`update` and mean moments along turns (m,) with times dt (m,) between them, to `out` (m, 9).

    start : (3,) turn and state before the first.
    """
    before, one, other = start[0], start[1], start[2]
    for i in range(after.size):
        found = update(code, p, before, after[i], dt[i], one, other)
        for c in range(6):
            out[i, c] = found[c]
        mean = mean_moment(code, p, before, after[i], dt[i], one, other)
        for c in range(3):
            out[i, 6 + c] = mean[c]
        before, one, other = after[i], found[0], found[1]
