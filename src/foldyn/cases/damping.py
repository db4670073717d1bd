"""Damping: how a case loses energy."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from foldyn.errors import InputError
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

    @classmethod
    def from_ratios(
        cls, f1: float, z1: float, f2: float, z2: float, state: str = "rest"
    ) -> Rayleigh:
        """Damping that has the ratios z1 and z2 at the frequencies f1 and f2.

        Solves z = alpha / (4 pi f) + beta pi f for both. Between the frequencies the ratio is
        lower, beyond them higher.

        Parameters
        ----------
        f1, f2 : float
            Frequencies (Hz), positive and different.
        z1, z2 : float
            Damping ratios there, at least 0 (0.02 is 2 %).
        state : {"rest", "start"}
            See `Rayleigh`.

        Raises
        ------
        InputError
            No alpha and beta of at least 0 give these ratios.

        Examples
        --------
        >>> import foldyn as fd
        >>> damping = fd.Rayleigh.from_ratios(9.3, 0.135, 16.7, 0.09)
        >>> print(f"{damping.alpha:.1f} 1/s, {damping.beta:.1e} s")
        14.4 1/s, 4.1e-04 s
        """
        f1, f2 = number("f1", f1, above=0.0), number("f2", f2, above=0.0)
        z1, z2 = number("z1", z1, least=0.0), number("z2", z2, least=0.0)
        if f1 == f2:
            raise InputError(f" = {f2:g}: must differ from f1", "f2")
        lower, upper = sorted((z1 * f1 / f2, z1 * f2 / f1))
        slack = 1e-12 * upper  # rounding where one of the two is alone
        if not lower - slack <= z2 <= upper + slack:
            ends = ("alpha", "beta") if f1 < f2 else ("beta", "alpha")
            raise InputError(
                f" = {z2:g}: with a ratio of {z1:g} at {f1:g} Hz, that at {f2:g} Hz can be from "
                f"{lower:.3g} ({ends[0]} alone) to {upper:.3g} ({ends[1]} alone)",
                "z2",
            )
        apart = f2**2 - f1**2
        alpha = 4.0 * math.pi * f1 * f2 * (z1 * f2 - z2 * f1) / apart
        beta = (z2 * f2 - z1 * f1) / (math.pi * apart)
        return cls(max(alpha, 0.0), max(beta, 0.0), state)

    def matrix(self, mass: Any, stiffness: Any) -> Any:
        """C from M (kg) and K0 (N/m)."""
        damping = mass * self.alpha
        return damping if self.beta == 0.0 else damping + self.beta * stiffness

    def rate(self, omega: Any) -> Any:
        """Damping (1/s) of a mode with angular frequency omega (rad/s) and modal mass 1 kg m2."""
        return self.alpha + self.beta * omega**2
