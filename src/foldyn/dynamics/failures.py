"""Reasons why a motion cannot continue, and remedies."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.dynamics.methods import Integrator
from foldyn.dynamics.motion_state import MotionState, Outcome, StepPlan
from foldyn.dynamics.system import PackedCase
from foldyn.errors import InstabilityError, PenetrationError
from foldyn.structures.beyond_range import kept_apart

SWING = 0.5  # turn (rad) of a hinge per step, too large for any law
MET = 1e-3  # panels touch if they are closer than this to closed, rad


class Failed(Protocol):
    """What `failure` needs of a motion whose last step failed."""

    case: Case
    method: Integrator
    plan: StepPlan
    critical: float
    packed: PackedCase
    state: MotionState


def failure(
    motion: Failed, code: int, hinge: int
) -> tuple[type[InstabilityError | PenetrationError], str]:
    """Exception class and message for a motion whose last step failed.

    code : a value of `Outcome`.
    hinge : index of the hinge whose dihedral jumped.
    """
    plan, tally, order = motion.plan, motion.state.tally, motion.packed.numbering.order
    hinges = motion.packed.body.hinges
    moment = f"at t = {tally.time:.6g} s (step {tally.steps})"
    rest, rows = motion.packed.body.sheet.turned()
    turned = rows[np.isnan(rest)]
    if len(turned):
        j, k = order[hinges[turned[0], :2]].tolist()
        return InstabilityError, (
            f"{moment} the rest dihedral of the crease between nodes {j} and {k} leaves 0 to "
            "360 degrees: change the angle or the history that actuates it"
        )
    if plan.dt > motion.critical:
        moment += f", with a step above the critical one of {motion.critical:.3g} s,"
    if code == Outcome.PENETRATION:
        j, k, i, l = (int(order[v]) if 0 <= v < len(order) else None for v in hinges[hinge])  # noqa: E741
        wings = f"wings {i}, {l}" if l is not None else f"wing {i}, the edge is clamped"
        if motion.case.contact is not None:
            return PenetrationError, (
                f"{moment} contact was overrun: the dihedral about nodes {j}-{k} ({wings}) "
                'jumped by more than pi; use method = "dormand_prince", or a larger '
                "contact.stiffness"
            )
        return PenetrationError, (
            f"{moment} panel passed through panel: the dihedral about nodes {j}-{k} ({wings}) "
            f"jumped by more than pi; {_apart(motion, hinge)}"
        )
    if code == Outcome.STUCK and len(hinges):
        closed = _from_closed(motion.state.angle)
        hinge = int(closed.argmin())
        if closed[hinge] < MET:
            j, k = order[hinges[hinge, :2]].tolist()
            return InstabilityError, (
                f"{moment} the error requires a step of {tally.wanted:.3g} s: panels meet "
                f"about nodes {j}-{k}; {_apart(motion, hinge)}"
            )
    return InstabilityError, f"{moment} {_reason(motion, code)}"


def smaller_step(motion: Failed) -> str:
    """Remedy text: how to make the motion more accurate."""
    plan = motion.plan
    if not plan.steps:
        return f"use a tolerance below {plan.tolerance:.3g}"
    if motion.method.implicit:
        return f"use a step below {plan.dt:.3g} s, or leave dt out"
    return f"use a step below {plan.dt:.3g} s (critical at the start: {motion.critical:.3g} s)"


def _apart(motion: Failed, hinge: int) -> str:
    """Remedy text: how to keep the panels at a hinge apart, given its dihedral at the last step."""
    angle = motion.state.angle[hinge]
    if motion.plan.dt > motion.critical or _from_closed(angle) > SWING:
        return f"the hinge has turned too far within a step: {smaller_step(motion)}"
    j, k = motion.packed.numbering.order[motion.packed.body.hinges[hinge, :2]].tolist()
    return kept_apart(motion.case.structure, j, k)


def _reason(motion: Failed, code: int) -> str:
    """Reason for a failure that is not due to a single hinge."""
    plan, method = motion.plan, motion.method
    if code == Outcome.STUCK:
        return (
            f"the error requires a step of {float(motion.state.tally.wanted):.3g} s: a load jumps "
            "too often, or the motion is too violent; raise the tolerance, or use rk4"
        )
    if code == Outcome.NOT_CONVERGED:
        why = "a mass or a stiffness may be missing, or the motion is too violent"
        if motion.case.contact is not None:
            why = 'panels meet too hard for an implicit method: use method = "dormand_prince"'
        return f"no equilibrium was found at the end of a step, however small the step: {why}"
    reason = "a load is not finite"
    if plan.steps and not method.implicit:
        reason = (
            f"the step of {plan.dt:.3g} s is too large (critical at the start: "
            f"{motion.critical:.3g} s) or {reason}"
        )
    return f"the motion is no longer finite: {reason}"


def _from_closed(angle: NDArray) -> NDArray:
    """Distance (rad) of dihedrals from 0 and 2 pi."""
    return np.minimum(angle, 2.0 * np.pi - angle)
