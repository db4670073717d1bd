"""Damping of a case."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from foldyn.values import choice, number

STATES = ("rest", "start")


@dataclass(frozen=True)
class Rayleigh:
    """Damping matrix C = alpha M + beta K0, K0 the tangent stiffness at a stated state.

    A motion of angular frequency w is damped with the ratio alpha / (2 w) + beta w / 2.

    Parameters
    ----------
    alpha : float
        Mass-proportional coefficient (1/s), at least 0.
    beta : float
        Stiffness-proportional coefficient (s), at least 0.
    state : {"rest", "start"}
        Where K0 is taken: at the structure's rest, or where a motion starts (for modes and
        frequency responses: the state about which it vibrates).
    """

    alpha: float = 0.0
    beta: float = 0.0
    state: str = "rest"

    def __post_init__(self) -> None:
        """Check the arguments."""
        object.__setattr__(self, "alpha", number("alpha", self.alpha, least=0.0))
        object.__setattr__(self, "beta", number("beta", self.beta, least=0.0))
        choice("state", self.state, STATES)

    def matrix(self, mass: Any, stiffness: Any) -> Any:
        """C from M (kg) and K0 (N/m)."""
        damping = mass * self.alpha
        return damping if self.beta == 0.0 else damping + self.beta * stiffness

    def rate(self, omega: Any) -> Any:
        """Damping (1/s) of a mode with angular frequency omega (rad/s) and modal mass 1 kg m2."""
        return self.alpha + self.beta * omega**2
