"""Damping of a case."""

from __future__ import annotations

from dataclasses import dataclass

from foldyn.cases.values import number


@dataclass(frozen=True)
class Rayleigh:
    """Damping matrix C = alpha M + beta K0, K0 the tangent stiffness at rest.

    A motion of angular frequency w is damped with the ratio alpha / (2 w) + beta w / 2.

    Parameters
    ----------
    alpha : float
        Mass-proportional coefficient (1/s), at least 0.
    beta : float
        Stiffness-proportional coefficient (s), at least 0.
    """

    alpha: float = 0.0
    beta: float = 0.0

    def __post_init__(self) -> None:
        """Check the arguments."""
        object.__setattr__(self, "alpha", number("alpha", self.alpha, least=0.0))
        object.__setattr__(self, "beta", number("beta", self.beta, least=0.0))
