"""Warnings about motions that finished but may be inaccurate."""

from __future__ import annotations

from foldyn.dynamics.audit import EnergyBalance, Rounding
from foldyn.dynamics.motion_state import StepPlan

INACCURATE = 1e-2  # relative energy error above which to warn


def is_off(balance: EnergyBalance, rounding: Rounding) -> bool:
    """Whether the energy balance of a motion is off by more than rounding."""
    hidden = rounding.energy(balance.largest, balance.farthest)
    return balance.relative > INACCURATE and balance.scale > hidden


def doubts(
    balance: EnergyBalance, rounding: Rounding, plan: StepPlan, size: float, remedy: str
) -> str:
    """Warning about the accuracy of a motion; empty if there is none.

    Parameters
    ----------
    balance : EnergyBalance
    rounding : Rounding
    plan : StepPlan
    size : float
        Largest displacement (m), the scale of the step errors; 0 with fixed steps.
    remedy : str
        What makes the motion more accurate.
    """
    farthest, least = balance.farthest, rounding.least_motion(INACCURATE)
    if 0.0 < farthest < least:
        return (
            f"nothing moves farther than {farthest:.2g} m, and below {least:.2g} m rounding "
            "hides how hinges turn, so that they do not resist: use larger loads, lighter or "
            "softer panels, or a longer motion"
        )
    if 0.0 < size < plan.floor:
        return (
            f"the motion is small: {size:.2g} m at most, where errors of steps are measured "
            f"by {plan.floor:.2g} m, a share of the longest bar; use a tolerance of "
            f"{plan.tolerance * size / plan.floor:.1g}, or a method with a fixed step"
        )
    if balance.relative <= INACCURATE:
        return ""
    off = (
        f"the energy balance of the motion is off by {balance.relative:.1%} of the energies at play"
    )
    hidden = rounding.energy(balance.largest, farthest)
    if balance.scale <= hidden:
        return (
            f"{off}, {balance.scale:.2g} J: they are below the rounding errors of forces and "
            f"displacements of this size ({hidden:.2g} J), which may be all that moves"
        )
    return f"{off}: {remedy}"
