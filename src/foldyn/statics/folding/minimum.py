"""Minimization of the folding energy near a shape.

Far from the minimum, damped steps lead toward it (Levenberg and Marquardt). Close to it Newton's
method takes over: where springs are weak, a step along a mechanism strains bars by its square.
Their forces then raise the energy, and make their second-derivative terms misleading. The forces of
bars and moments of hinges are therefore the ones that the last step predicted, and the next step
removes the strains that it left (mixed Newton, Magisano and others, Int. J. Numer. Meth. Eng. 109,
2017).

A factorization takes ten times as long as the rest of a step, and is kept as long as steps get
shorter. The remaining strains are then removed along the gradients of the factorized matrix: along
current gradients they would push creases, whose springs are far weaker than bars.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from foldyn.statics.folding.energy import Aim, Evaluated, FoldEnergy, Shape, Stiffness

LARGEST_TURN = 0.5  # rad, of a hinge in a step
NEAR = 0.1  # rad, turn in a damped step below which Newton's method is tried
CLOSER = 0.1  # factor on `NEAR` after each failure
TRIES, MORE_DAMPED = 12, 3  # Newton matrices, and dampings tried for an indefinite one
SHORTER = 0.3  # the matrix is kept if a step turns less than this share of the last turn
CLOSE = 0.01  # with a kept matrix: largest turn that may remain, as a share of `least`
DAMPING = 1e-4  # initial damping, relative to the mean of the matrix diagonal
LEAST, MOST = 1e-14, 1e8
LESS, MORE = 0.3, 5.0  # factors on the damping after a good and after a bad step
FIRM, SOFT = 1e-12, 0.01  # damping of Newton's method: least, and increase per rad of last turn
ROUNDING = 1e-14  # relative rounding error of an energy
UNSTRAINED = 1e-24  # energy of strains at round-off


def lowest(energy: FoldEnergy, shape: Shape, x: NDArray, aim: Aim, stiffness: Stiffness) -> Shape:
    """The shape itself, or the shape at positions x (n, 3) if its energy is lower."""
    one, other = (energy.evaluated(shape, at, aim, stiffness).shape for at in (shape.x, x))
    return other if other.energy < one.energy else one


def minimum(
    energy: FoldEnergy, shape: Shape, aim: Aim, stiffness: Stiffness, iterations: int = 150,
    least: float = 1e-6,
) -> Shape:  # fmt: skip
    """Shape of least energy near `shape`; the best one found if steps stop descending.

    least : largest turn (rad) of a hinge in the last step.
    """
    now, damping = energy.evaluated(shape, shape.x, aim, stiffness), DAMPING
    turn, near, again = 0.0, NEAR, 0
    for k in range(iterations):
        if turn < near or k == again:
            found = settled(energy, now.shape, aim, stiffness, least)
            if found is not None:
                return found
            near, again = min(near, CLOSER * (turn or near)), 3 * k // 2 + TRIES
        matrix, force = energy.matrix(now), -energy.gradient(now)
        while True:
            solution = energy.curvature.factorized(matrix, damping)
            if solution is not None:
                after = energy.evaluated(now.shape, now.shape.x + solution(force), aim, stiffness)
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
    """Shape to which Newton's method converges; None if it diverges or ends at a higher energy.

    Arguments as in `minimum`.
    """
    now = energy.evaluated(shape, shape.x, aim, stiffness)
    highest = (1.0 + ROUNDING) * now.shape.energy + UNSTRAINED
    pulls, solution, first, tries, turn = None, None, now, 0, NEAR
    while True:
        if solution is None:
            tries += 1
            if tries > TRIES:
                return None
            first, solution = now, _factorized(energy, now, pulls, stiffness.creases * turn)
            if solution is None:
                return None
        before, last = now, turn
        step = solution(-energy.gradient(now, first, pulls))
        pulls = energy.expected(now, first, step)
        now = energy.evaluated(before.shape, before.shape.x + step, aim, stiffness)
        turn = _turn(before, now)
        if not turn < LARGEST_TURN:
            return None
        if turn < least and (first is before or turn**2 < CLOSE * least * last):
            return now.shape if now.shape.energy <= highest else None
        if turn > SHORTER * last:
            solution = None


def _factorized(
    energy: FoldEnergy, at: Evaluated, pulls: tuple[NDArray, NDArray] | None, soft: float
) -> Callable[[NDArray], NDArray] | None:
    """Solver for Newton steps with the matrix at a shape; None if it is indefinite."""
    matrix, damping = energy.matrix(at, pulls), FIRM + SOFT * soft
    for _ in range(MORE_DAMPED):
        solution = energy.curvature.factorized(matrix, damping)
        if solution is not None:
            return solution
        damping *= 10.0
    return None


def _turn(one: Evaluated, other: Evaluated) -> float:
    """Largest turn (rad) of a hinge from one shape to another."""
    return float(np.abs(other.shape.turns - one.shape.turns).max(initial=0.0))
