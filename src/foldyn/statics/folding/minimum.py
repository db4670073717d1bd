"""The least energy near a shape.

Far away damped steps lead there (Levenberg and Marquardt). Near by Newton's take over: where
springs are weak a step along a mechanism strains bars by its square, which pull so much that the
energy rises and that their share of the second derivatives misleads. What bars and hinges pull
with is therefore what the last step expected, and the next step lets go what strains it has left
(mixed Newton, Magisano and others, Int. J. Numer. Meth. Eng. 109, 2017).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.statics.folding.energy import Aim, Evaluated, FoldEnergy, Shape, Stiffness

LARGEST_TURN = 0.5  # rad, of a hinge in a step
NEAR = 0.1  # rad, turn in a damped step after which Newton's are tried
CLOSER = 0.1  # times as near they are tried again, where they have failed
TRIES, MORE_DAMPED = 12, 3  # of Newton's steps, and of their matrix
DAMPING = 1e-4  # at first, over the mean of the matrix's diagonal
LEAST, MOST = 1e-14, 1e8
LESS, MORE = 0.3, 5.0  # by which it changes after a good step, and after a bad one
FIRM, SOFT = 1e-12, 0.01  # damping of Newton's: at least, and for each rad of the last turn
ROUNDING = 1e-14  # of an energy
UNSTRAINED = 1e-24  # energy of strains that are rounding


def lowest(energy: FoldEnergy, shape: Shape, x: NDArray, aim: Aim, stiffness: Stiffness) -> Shape:
    """The shape, or that at positions x (n, 3) if its energy is less."""
    one, other = (energy.evaluated(shape, at, aim, stiffness).shape for at in (shape.x, x))
    return other if other.energy < one.energy else one


def minimum(
    energy: FoldEnergy,
    shape: Shape,
    aim: Aim,
    stiffness: Stiffness,
    iterations: int = 150,
    least: float = 1e-6,
) -> Shape:
    """Shape of least energy near `shape`; the best found where steps no longer lead down.

    least : largest turn of a hinge (rad) in the last step.
    """
    now, damping = energy.evaluated(shape, shape.x, aim, stiffness), DAMPING
    turn, near = 0.0, NEAR
    for _ in range(iterations):
        if turn < near:
            found = settled(energy, now.shape, aim, stiffness, least)
            if found is not None:
                return found
            near = CLOSER * (turn or near)
        matrix, force = energy.matrix(now), -energy.gradient(now)
        while True:
            step = energy.curvature.solution(matrix, damping, force)
            if step is not None:
                after = energy.evaluated(now.shape, now.shape.x + step, aim, stiffness)
                turn = _turn(now, after)
                highest = (1.0 + ROUNDING) * now.shape.energy
                if turn < LARGEST_TURN and after.shape.energy <= highest:
                    break
            damping *= MORE
            if damping > MOST:
                return now.shape
        now, damping = after, max(LESS * damping, LEAST)
        if turn < least:
            break
    return now.shape


def settled(
    energy: FoldEnergy, shape: Shape, aim: Aim, stiffness: Stiffness, least: float
) -> Shape | None:
    """Where Newton's steps from a shape settle; None where they do not, or where it is higher.

    Arguments as of `minimum`.
    """
    now = energy.evaluated(shape, shape.x, aim, stiffness)
    highest = (1.0 + ROUNDING) * now.shape.energy + UNSTRAINED
    pulls, turn = None, NEAR
    for _ in range(TRIES):
        matrix, force = energy.matrix(now, pulls), -energy.gradient(now)
        damping, step = FIRM + SOFT * stiffness.creases * turn, None
        for _ in range(MORE_DAMPED):
            step = energy.curvature.solution(matrix, damping, force)
            if step is not None:
                break
            damping *= 10.0
        if step is None:
            return None
        before, pulls = now, energy.expected(now, step)
        now = energy.evaluated(before.shape, before.shape.x + step, aim, stiffness)
        turn = _turn(before, now)
        if not turn < LARGEST_TURN:
            return None
        if turn < least:
            return now.shape if now.shape.energy <= highest else None
    return None


def _turn(one: Evaluated, other: Evaluated) -> float:
    """Largest turn (rad) of a hinge from one shape to another."""
    return float(np.abs(other.shape.turns - one.shape.turns).max(initial=0.0))
