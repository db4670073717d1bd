"""Where a step of a path ends whose load factor moves: in a plane, or on a cylinder.

Lengths are measured over all dofs; the load factor is left out.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray


class Plane:
    """Rule of the modified generalized displacement control, the method of MERLIN2, for one step.

    After the prediction c1 = df1 b1, with b1 the response to the load factor at the start of the
    step, every correction a + df b is orthogonal to b1: df = -(b1.a)/(b1.b). Predictions are as
    long as the first step of the path, |df1| = length/|b1|, which with the first response b0 is
    the square root of the generalized stiffness parameter |b0.b0/(b1.b1)| (Leon, Lages, de Araujo
    and Paulino, Comput. Mech. 53, 2014: "modified" is that the parameter and the plane take the
    present step's response twice instead of that of the step before).
    """

    def __init__(self, length: float, prediction: NDArray) -> None:
        self.prediction = prediction  # the plane stands at its end, whatever the length

    def __call__(self, moved: NDArray, step: NDArray, response: NDArray) -> float:
        """Change of the load factor; nan where the plane contains the response."""
        across = float(self.prediction @ response)
        # the motion reached is brought back into the plane where a step was taken in part only
        short = float(self.prediction @ (moved + step)) - float(self.prediction @ self.prediction)
        return -short / across if across != 0.0 else math.nan


class Cylinder:
    """Rule of the cylindrical arc length for one step: its end lies at a distance from its start.

    With c the motion since the start of the step, a the step of Newton's method at the present
    load factor and b the response to the factor, |c + a + df b| = length is a quadratic equation
    for df (Crisfield, Computers and Structures 13, 1981). Of its roots the one is taken that goes
    on in the direction of the step.
    """

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
