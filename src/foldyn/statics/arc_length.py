"""Cylindrical arc length: the end of a step lies at a given distance from its start.

With c the motion since the start of the step, a the step of Newton's method at the present load
factor and b the response to the factor, |c + a + df b| = length is a quadratic equation for df
(Crisfield, Computers and Structures 13, 1981). Of its roots the one is taken that goes on in the
direction of the step. The length is measured over all dofs, the load factor is left out.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray


class Cylinder:
    """Rule of the cylindrical arc length for one step."""

    def __init__(self, length: float, prediction: NDArray) -> None:
        self.length, self.prediction = length, prediction

    def __call__(self, moved: NDArray, step: NDArray, response: NDArray) -> float:
        """Change of the load factor; nan where the arc does not meet the linearized path."""
        reached = moved + step
        a = float(response @ response)
        b = float(response @ reached)
        c = float(reached @ reached) - self.length**2
        root = b * b - a * c
        if not root >= 0.0 or a == 0.0:
            return math.nan
        root = math.sqrt(root)
        # without cancellation: one root by the sum of two terms of one sign, one by Vieta
        far = -(b + math.copysign(root, b))
        roots = (far / a, c / far if far != 0.0 else 0.0)
        along = [float((reached + root * response) @ self.prediction) for root in roots]
        return roots[int(np.argmax(along))]
