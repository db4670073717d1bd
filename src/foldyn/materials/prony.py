"""Linear viscoelasticity: the generalized Maxwell law, whose relaxation is a Prony series.

Branches act in parallel to the elastic law. Each is a spring g k in series with a dashpot, with the
relaxation time tau = eta / (g k). With e the part of the turn d that the spring takes,

    M = k (m(d) + sum g e),    de/dt = dd/dt - e / tau,

so that after a step of d the moment relaxes as k d (1 + sum g exp(-t/tau)). For small vibrations
the complex stiffness is k (m' + sum g i w tau / (1 + i w tau)). k is the long-time stiffness.

Over a step in which d changes by D at a constant rate, with x = dt / tau, the law is integrated
exactly (R. L. Taylor, K. S. Pister and G. L. Goudreau, Int. J. Numer. Methods Eng. 2, 1970; J. C.
Simo and T. J. R. Hughes, Computational Inelasticity, 1998, section 10.3):

    e' = exp(-x) e + D (1 - exp(-x)) / x,

The loss in the dashpot, g int e^2 dt / tau, is exact too.

A crease in series with panels (`series`), with or without a parallel damper, is again such a law;
the rates of this law are the poles of the stiffness (`in_series`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check
from foldyn.errors import InputError
from foldyn.jit.compiled import scalar
from foldyn.materials.formulas import BranchFormulas
from foldyn.materials.inelastic_law import Branch, MemoryLaw
from foldyn.materials.law import HingeLaw, columns
from foldyn.values import number_or_list, show

CODE = 0  # code of the branch
FEW = 0.02  # a series gives the loss in steps below this share of a relaxation time


@scalar
def update(p, before, after, dt, spring, other):
    """Turn of the spring, 0, moment, slope, energy and loss, divided by k, after a turn in dt.

    p : share and rate (1/s) of the branch.
    """
    share, x = p[0], p[1] * dt
    left, turn = -math.expm1(-x), after - before
    mean = left / x if x > 0.0 else 1.0
    now = (1.0 - left) * spring + mean * turn
    if x < FEW:  # int (1 - exp(-y))^2 dy / x^2
        lost = x * (1 / 3 - x * (1 / 4 - x * (7 / 60 - x * (1 / 24 - x * (31 / 2520)))))
    else:
        lost = (x - 0.5 * left * (2.0 + left)) / (x * x)
    lost = spring * spring * left * (1.0 - 0.5 * left) + turn * (spring * left * mean + turn * lost)
    return now, 0.0, share * now, share * mean, 0.5 * share * now * now, share * lost


@scalar
def mean_moment(p, before, after, dt, spring, other):
    """Mean moment along the turn, its slope, and deficit 0: work is exactly stored or lost."""
    share, x = p[0], p[1] * dt
    mean = -math.expm1(-x) / x if x > 0.0 else 1.0
    if x < FEW:
        rise = 0.5 - x * (1 / 6 - x * (1 / 24 - x * (1 / 120 - x * (1 / 720 - x / 5040))))
    else:
        rise = (1.0 - mean) / x
    return share * (mean * spring + rise * (after - before)), share * rise, 0.0


def _branches(name: str, value: Any) -> tuple[float, ...]:
    """Return a tuple of positive numbers, one for each branch."""
    given = number_or_list(name, value, "branch", above=0.0)
    return given if isinstance(given, tuple) else (given,)


@dataclass(frozen=True)
class Prony(MemoryLaw):
    """Viscoelastic law: an elastic law with parallel Maxwell branches.

    Parameters
    ----------
    ratios : float or sequence of float
        Stiffness of each branch relative to the elastic law, above 0.
    times : float or sequence of float
        Relaxation time (s) of each branch, above 0.
    law : str or HingeLaw
        The elastic law, which holds for slow turns and for statics.

    Examples
    --------
    >>> Prony(ratios=[0.3, 0.1], times=[0.02, 1.0]).relaxation([0.0, 1e3]).round(6).tolist()
    [1.4, 1.0]
    """

    ratios: Annotated[float | Sequence[float], Check(_branches)]
    times: Annotated[float | Sequence[float], Check(_branches, unit="s")]
    law: str | HingeLaw = "enhanced"
    name: str = "prony"

    formulas = (BranchFormulas(CODE, update, mean_moment),)
    rate_dependent = True
    relaxes = True

    def agree(self) -> None:
        """Refuse different numbers of ratios and times."""
        super().agree()
        ratios, times = np.atleast_1d(self.ratios), np.atleast_1d(self.times)
        if len(ratios) != len(times):
            raise InputError(
                f"{len(ratios)} ratios = {show(ratios)} and {len(times)} times = {show(times)}: "
                "give one of each per branch"
            )

    @property
    def series(self) -> tuple[NDArray, NDArray]:
        """Ratios and relaxation times (s) of the branches."""
        return np.atleast_1d(self.ratios).astype(float), np.atleast_1d(self.times).astype(float)

    def relaxation(self, time: Sequence[float] | NDArray) -> NDArray:
        """Stiffness relative to the long-time stiffness, at times (s) after a turn."""
        ratio, tau = self.series
        return 1.0 + (ratio * np.exp(-np.asarray(time, float)[..., None] / tau)).sum(axis=-1)

    def modulus(self, frequency: Sequence[float] | NDArray) -> NDArray:
        """Complex stiffness relative to the long-time one at frequencies (Hz), for exp(+i w t)."""
        ratio, tau = self.series
        x = 2j * np.pi * np.asarray(frequency, float)[..., None] * tau
        return 1.0 + (ratio * x / (1.0 + x)).sum(axis=-1)

    def branches(self, stiffness: NDArray, length: NDArray) -> tuple[Branch, ...]:
        """Branches of the law; see `MemoryLaw`."""
        ratio, tau = (np.tile(each, (len(stiffness), 1)) for each in self.series)
        return maxwell(ratio, 1.0 / tau)


@dataclass(frozen=True)
class CreaseDampers(MemoryLaw):
    """Dampers of creases between compliant panels, as a law without branches of its own.

    The dampers resist the turn of the creases, which differs from the turn of the hinges.
    """

    law: str | HingeLaw = "linear"
    name: str = "damping of creases"

    rate_dependent = True
    relaxes = True

    def branches(self, stiffness: NDArray, length: NDArray) -> tuple[Branch, ...]:
        """Branches of the law; see `MemoryLaw`."""
        return ()


def maxwell(ratio: NDArray, rate: NDArray) -> tuple[Branch, ...]:
    """Maxwell branches of n hinges with stiffness ratios (n, b) and rates (n, b), 1/s."""
    pairs = zip(ratio.T, rate.T, strict=True)
    return tuple(Branch(CODE, columns(len(g), g, each), 0.0, g, each) for g, each in pairs)


def in_series(
    share: NDArray, ratio: NDArray, rate: NDArray, time: NDArray
) -> tuple[NDArray, NDArray]:
    """Branches of n hinges whose creases are in series with panels.

    With phi the turn of the crease, theta the turn of the hinge and a_j the turns of the dashpots,
    per unit stiffness of the crease,

        time dphi/dt = k (theta - phi) - phi - sum g_j (phi - a_j),   da_j/dt = rate_j (phi - a_j),

    with k = share / (1 - share) the stiffness of the panels. The moment k (theta - phi) follows a
    generalized Maxwell law, whose rates are the eigenvalues of this symmetric system.

    Parameters
    ----------
    share : (n,)
        Share of the crease in the turn of a hinge for small turns, at most 1.
    ratio, rate : (n, b)
        Ratios of the crease's own branches, per unit stiffness of the crease, and rates, 1/s.
    time : (n,)
        Damping of the crease divided by its stiffness, s.

    Returns
    -------
    ratio, rate : (n, b + 1)
        Ratios per unit stiffness of the hinge, and rates, 1/s; missing branches have the ratio 0.
    """
    n, b = ratio.shape
    ratios, rates = np.zeros((n, b + 1)), np.ones((n, b + 1))
    alone = share == 1.0
    ratios[alone, :b], rates[alone, :b] = ratio[alone], rate[alone]
    for damped in (False, True):
        rows = np.flatnonzero(~alone & ((time > 0.0) == damped))
        g, part = ratio[rows], share[rows]
        panels = part / (1.0 - part)
        matrix = np.zeros((len(rows), b + 1, b + 1))
        matrix[:, 0, 0] = panels + 1.0 + g.sum(axis=1)
        matrix[:, 0, 1:] = matrix[:, 1:, 0] = -g
        matrix[:, np.arange(1, b + 1), np.arange(1, b + 1)] = g
        weight = np.column_stack([time[rows], g / rate[rows]])
        push = np.zeros((len(rows), b + 1))
        push[:, 0] = panels
        if not damped:  # the crease is always in balance with its branches
            first, across = matrix[:, :1, 0], matrix[:, 1:, 0]
            push, weight = -across * (panels[:, None] / first), weight[:, 1:]
            matrix = matrix[:, 1:, 1:] - across[:, :, None] * (across / first)[:, None, :]
        root = np.sqrt(weight)
        found, shapes = np.linalg.eigh(matrix / (root[:, :, None] * root[:, None, :]))
        pushed = ((push / root)[:, None, :] @ shapes)[:, 0]
        columns_ = slice(1 - damped, b + 1)
        ratios[rows, columns_] = pushed**2 / (found * part[:, None])
        rates[rows, columns_] = found
    return ratios, rates
