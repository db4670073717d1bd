"""Modified generalized displacement control, the method of MERLIN2.

After the prediction c1 = df1 b1 of a step, with b1 the response to the load factor at its start,
every correction a + df b is orthogonal to b1: df = -(b1.a)/(b1.b). Predictions are as long as the
first step of the path, |df1| = length/|b1|, which with the first response b0 is the square root of
the generalized stiffness parameter |b0.b0/(b1.b1)| (Leon, Lages, de Araujo and Paulino, Comput.
Mech. 53, 2014: "modified" is that the parameter and the plane take the current step's response
twice instead of that of the step before).
"""

from __future__ import annotations

import math

from numpy.typing import NDArray


class Plane:
    """Rule of the modified generalized displacement control for one step."""

    def __init__(self, length: float, prediction: NDArray) -> None:
        self.prediction = prediction  # the plane stands at its end, whatever the length

    def __call__(self, moved: NDArray, step: NDArray, response: NDArray) -> float:
        """Change of the load factor; nan where the plane contains the response."""
        across = float(self.prediction @ response)
        # the motion reached is brought back into the plane where a step was taken in part only
        short = float(self.prediction @ (moved + step)) - float(self.prediction @ self.prediction)
        return -short / across if across != 0.0 else math.nan
