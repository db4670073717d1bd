"""Why no further step of a motion can be taken, where it is no single hinge's doing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.dynamics.course import Outcome, StepPlan
from foldyn.dynamics.methods import Integrator


def reason_for(
    code: int, case: Case, plan: StepPlan, method: Integrator, critical: float, wanted: float
) -> str:
    """What has happened, and what helps.

    code : an `Outcome`.
    critical, wanted : the critical step at the start, and the one that the error asks for (s).
    """
    if code == Outcome.STUCK:
        return (
            f"the error asks for a step of {wanted:.3g} s: a load jumps too often, or the motion "
            "is too violent; raise the tolerance, or use rk4"
        )
    if code == Outcome.NOT_CONVERGED:
        why = "a mass or a stiffness may be missing, or the motion is too violent"
        if case.contact is not None:
            why = 'panels meet too hard for an implicit method: use method = "dormand_prince"'
        return f"no equilibrium was found at the end of a step, however small the step: {why}"
    reason = "a load is not finite"
    if plan.steps and not method.implicit:
        reason = (
            f"the step of {plan.dt:.3g} s is too large (critical at the start: {critical:.3g} s) "
            f"or {reason}"
        )
    return f"the motion is no longer finite: {reason}"


def from_closed(angle: NDArray) -> NDArray:
    """How far (rad) dihedrals are from 0 and 2 pi."""
    return np.minimum(angle, 2.0 * np.pi - angle)
