"""Linear viscoelasticity: the generalized Maxwell law, whose relaxation is a Prony series.

Beside the elastic law stand branches of a spring g k and a dashpot in series, with the relaxation
time tau = eta / (g k). With e the part of the turn d that the spring takes,

    M = k (m(d) + sum g e),    de/dt = dd/dt - e / tau,

so that after a step of d the moment relaxes as k d (1 + sum g exp(-t/tau)), and small vibrations
see the complex stiffness k (m' + sum g i w tau / (1 + i w tau)). k is the long-time stiffness.

Over a step in which d changes by D at a constant rate, with x = dt / tau, the law is integrated
exactly (R. L. Taylor, K. S. Pister and G. L. Goudreau, Int. J. Numer. Methods Eng. 2, 1970; J. C.
Simo and T. J. R. Hughes, Computational Inelasticity, 1998, section 10.3):

    e' = exp(-x) e + D (1 - exp(-x)) / x,

and so is what the dashpot takes, g int e^2 dt / tau.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.jit.compiled import scalar
from foldyn.materials.law import HingeLaw
from foldyn.materials.memory_law import Branch, MemoryLaw, columns
from foldyn.values import number, number_or_list, show

CODE = 0  # among branches
FEW = 0.02  # of a relaxation time: below, the loss under a constant rate is its series


@scalar
def update(before, after, dt, spring, share, rate):
    """Spring's turn, 0, moment, slope, energy and loss per k, after a turn in a time dt."""
    x = rate * dt
    left, turn = -math.expm1(-x), after - before
    mean = left / x if x > 0.0 else 1.0
    now = (1.0 - left) * spring + mean * turn
    if x < FEW:  # int (1 - exp(-y))^2 dy / x^2
        lost = x * (1 / 3 - x * (1 / 4 - x * (7 / 60 - x * (1 / 24 - x * (31 / 2520)))))
    else:
        lost = (x - 0.5 * left * (2.0 + left)) / (x * x)
    lost = spring * spring * left * (1.0 - 0.5 * left) + turn * (spring * left * mean + turn * lost)
    return now, 0.0, share * now, share * mean, 0.5 * share * now * now, share * lost


@dataclass(frozen=True)
class Prony(MemoryLaw):
    """Viscoelastic law: an elastic law and Maxwell branches beside it.

    Parameters
    ----------
    ratios : float or sequence of float
        Stiffness of each branch over that of the elastic law, above 0.
    times : float or sequence of float
        Relaxation time (s) of each, above 0.
    law : str or HingeLaw
        The elastic law: that of slow turns, and what statics take.

    Examples
    --------
    >>> Prony(ratios=[0.3, 0.1], times=[0.02, 1.0]).relaxation([0.0, 1e3]).round(6).tolist()
    [1.4, 1.0]
    """

    ratios: float | Sequence[float]
    times: float | Sequence[float]
    law: str | HingeLaw = "enhanced"
    name: str = "prony"

    rate_dependent = True
    relaxes = True

    def __post_init__(self) -> None:
        lists = []
        for field in ("ratios", "times"):
            given = number_or_list(f"Prony: {field}", getattr(self, field), "branch")
            given = given if isinstance(given, tuple) else (given,)
            lists.append(tuple(number(f"Prony: {field}", one, above=0.0) for one in given))
            object.__setattr__(self, field, lists[-1])
        if len(lists[0]) != len(lists[1]):
            raise InputError(
                f"Prony: {len(lists[0])} ratios = {show(lists[0])} and {len(lists[1])} times = "
                f"{show(lists[1])}: give one of each per branch"
            )
        _ = self.elastic

    @property
    def series(self) -> tuple[NDArray, NDArray]:
        """Ratios and relaxation times (s) of the branches."""
        return np.atleast_1d(self.ratios).astype(float), np.atleast_1d(self.times).astype(float)

    def relaxation(self, time: Sequence[float] | NDArray) -> NDArray:
        """Stiffness over the long-time one at times (s) after a turn."""
        ratio, tau = self.series
        return 1.0 + (ratio * np.exp(-np.asarray(time, float)[..., None] / tau)).sum(axis=-1)

    def modulus(self, frequency: Sequence[float] | NDArray) -> NDArray:
        """Complex stiffness over the long-time one at frequencies (Hz), for exp(+i w t)."""
        ratio, tau = self.series
        x = 2j * np.pi * np.asarray(frequency, float)[..., None] * tau
        return 1.0 + (ratio * x / (1.0 + x)).sum(axis=-1)

    def branches(self, stiffness: NDArray, length: NDArray) -> tuple[Branch, ...]:
        """See `MemoryLaw`."""
        n = len(stiffness)
        return tuple(
            Branch(CODE, columns(n, g, 1.0 / tau), 0.0, g, np.full(n, 1.0 / tau))
            for g, tau in zip(*self.series, strict=True)
        )
