"""The least energy near a shape, by damped Gauss-Newton steps (Levenberg and Marquardt)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.solvers import factorizer
from foldyn.algebra.superlu import Factorizer, SingularTangentError
from foldyn.statics.folding.energy import Aim, FoldEnergy, Shape, Stiffness

LARGEST_TURN = 0.5  # rad, of a hinge in a step
DAMPING = 1e-4  # at first, over the mean of the matrix's diagonal
LEAST, MOST = 1e-14, 1e8
LESS, MORE = 0.3, 5.0  # by which it changes after a good step, and after a bad one


def minimum(
    energy: FoldEnergy,
    shape: Shape,
    aim: Aim,
    stiffness: Stiffness,
    iterations: int = 150,
    settled: float = 1e-6,
) -> Shape:
    """Shape of least energy near `shape`; the best found where steps no longer lead down.

    settled : largest turn of a hinge (rad) in the last step.
    """
    now = energy.evaluated(shape, shape.x, aim, stiffness)
    size = shape.x.size
    identity = sparse.eye_array(size, format="csc")
    solver, damping = factorizer("auto", size)[1], DAMPING
    for _ in range(iterations):
        scale = float(now.matrix.diagonal().mean())
        while True:
            step = _step(solver, now.matrix + damping * scale * identity, now.gradient)
            if step is not None:
                x = now.shape.x + step.reshape(-1, 3)
                after = energy.evaluated(now.shape, x, aim, stiffness)
                turn = float(np.abs(after.shape.turns - now.shape.turns).max(initial=0.0))
                rounding = 1e-14 * now.shape.energy
                if turn < LARGEST_TURN and after.shape.energy <= now.shape.energy + rounding:
                    break
            damping *= MORE
            if damping > MOST:
                return now.shape
        now, damping = after, max(LESS * damping, LEAST)
        if turn < settled:
            break
    return now.shape


def _step(solver: Factorizer, matrix: sparse.csc_array, gradient: NDArray) -> NDArray | None:
    """Step (m,) of a damped matrix; None where it is singular to rounding."""
    try:
        step = solver(sparse.csc_array(matrix)).solve(-gradient)
    except SingularTangentError:
        return None
    return step if np.isfinite(step).all() else None
