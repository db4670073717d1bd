"""When the equations of a step are solved, and when its matrix has to be made anew."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from foldyn.jit.compiled import kernel

FAST = 0.3  # share of the residual that an iteration leaves, below which its matrix is kept
GROWTH = 1e8  # of the residual, at which the iteration has lost its way
# what is left where the residual no longer falls: rounding, if it is below one of these
ENOUGH = 1e-8  # of the forces at play
ROUNDING = 8.0  # times the rounding of the bars' forces
STALL = 0.5  # share of the residual that an iteration leaves, above which it does not fall

SOLVED, GO_ON, NEW_MATRIX, NOT_CONVERGED, NOT_FINITE = range(5)


class Goal(NamedTuple):
    """What the residual is judged by, N."""

    tolerance: float  # relative to the forces at play
    least: float  # forces at play at least
    rounding: float  # of the bars' forces


@kernel
def judge(goal, norm, reference, last, lowest):
    """What to do next: the residual (N) is `norm`, it was `last`, and `lowest` at its best.

    reference : forces at play, N.
    last : 0 where there is no matrix yet, inf before the first iteration with an old one.
    """
    if not norm < np.inf:
        return NOT_FINITE
    forces = max(reference, goal.least)
    if norm <= goal.tolerance * forces:
        return SOLVED
    if norm > STALL * last and norm <= max(ENOUGH * forces, ROUNDING * goal.rounding) and last > 0:
        return SOLVED
    if norm > GROWTH * lowest:
        return NOT_CONVERGED
    return NEW_MATRIX if norm > FAST * last else GO_ON
