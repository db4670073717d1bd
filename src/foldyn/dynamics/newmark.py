"""Newmark's method with constant average acceleration, the trapezoidal rule.

N. M. Newmark, A method of computation for structural dynamics, J. Eng. Mech. Div. 85, 1959, with
beta = 1/4 and gamma = 1/2: unconditionally stable for linear systems, of order 2, without numerical
damping. A linear system keeps its energy; one that is not linear may gain some with large steps.
"""

from __future__ import annotations

from foldyn.dynamics.implicit.alpha import Alpha, Parameters
from foldyn.dynamics.implicit.scheme import Bench

ORDER = 2


def scheme(bench: Bench) -> Alpha:
    """Steps of the method."""
    return Alpha(bench, Parameters(am=0.0, af=0.0, beta=0.25, gamma=0.5))
