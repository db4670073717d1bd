"""What is said of a motion that `auto` has computed anew, by a better method."""

from __future__ import annotations

from typing import TYPE_CHECKING

from foldyn.dynamics.doubts import INACCURATE

if TYPE_CHECKING:
    from foldyn.dynamics.motion import Motion


def reason_of(second: Motion, first: Motion) -> str:
    """Why the second one was computed, for its result."""
    off = f"with {_apart(first, second)[0]} the energy balance was off by more than"
    return f"{first.reason}; computed anew: {off} {INACCURATE:.0%}"


def announced(second: Motion, first: Motion, off: float) -> str:
    """Warning before the second one; `off` is the relative energy error of the first."""
    new, ask = _apart(second, first)
    return (
        f"the motion is computed anew with {new}: with {_apart(first, second)[0]}, which auto "
        f"chose, its energy balance is off by {off:.1%} of the energies at play; {ask} saves the "
        "first attempt"
    )


def _apart(motion: Motion, other: Motion) -> tuple[str, str]:
    """How a motion is computed, unlike another one: in words, and as an argument."""
    if motion.method is other.method:
        return f"steps of {motion.plan.dt:.3g} s", f"dt = {motion.plan.dt:.6g}"
    return motion.method.name, f'method = "{motion.method.name}"'
