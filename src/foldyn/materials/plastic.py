"""Plasticity of creases: a yield moment with isotropic and kinematic hardening.

Let p be the plastic turn and a the sum of the sizes of its changes. Per length of the crease,

    M = k (d - p),    f = |M - C p| - (M_y + H a) <= 0,    dp/dt = sgn(M - C p) da/dt,

and a grows only if f = 0. With a nonlinear elastic law m(d), M = k (m(d) - p).

A step is the return mapping (M. L. Wilkins, 1964; J. C. Simo and T. J. R. Hughes, Computational
Inelasticity, 1998, box 1.5): if f > 0 in the trial state with the old p, a grows by
f / (k + H + C). For turns in one direction, the moment and the dissipation, int (M_y + H a) da, are
exact for any step. The slope of the moment within such a step is the consistent one,
k (H + C) / (k + H + C).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check
from foldyn.jit.compiled import scalar
from foldyn.materials.formulas import BranchFormulas
from foldyn.materials.inelastic_law import Branch, MemoryLaw
from foldyn.materials.law import HingeLaw, columns
from foldyn.values import number

CODE = 1


@scalar
def update(p, before, after, dt, plastic, grown):
    """Plastic turn, sum a, moment, slope, energy and loss, divided by k, after a turn.

    p : yield moment, isotropic and kinematic hardening, each divided by k.
    """
    limit, isotropic, kinematic = p[0], p[1], p[2]
    driven = after - plastic - kinematic * plastic
    beyond = abs(driven) - (limit + isotropic * grown)
    slope, lost = 0.0, 0.0
    if beyond > 0.0 and after != before:  # rounding alone must not cause yielding
        whole = 1.0 + isotropic + kinematic
        more = beyond / whole
        lost = more * (limit + isotropic * (grown + 0.5 * more))
        plastic += more if driven > 0.0 else -more
        grown += more
        slope = -1.0 / whole
    energy = plastic * (0.5 * (1.0 + kinematic) * plastic - after)
    return plastic, grown, -plastic, slope, energy, lost


@scalar
def mean_moment(p, before, after, dt, plastic, grown):
    """Mean moment of both ends, its slope, and the loss that the work of this mean does not cover.

    Part of the loss is not covered if the crease begins to yield within the turn. (The mean along
    the turn would cover all of it, but dofs without mass would then oscillate from step to step.)
    The covered loss is not negative: before a crease yields, it turns by at most twice the yield
    moment divided by the stiffness.
    """
    now = update(p, before, after, dt, plastic, grown)
    turn, more, whole = abs(after - before), now[1] - grown, 1.0 + p[1] + p[2]
    lacking = 0.5 * more * max(turn - whole * more, 0.0)
    return -0.5 * (plastic + now[0]), 0.5 * now[3], lacking


@dataclass(frozen=True)
class Plastic(MemoryLaw):
    """Elastic and plastic law of creases that does not depend on rates.

    Parameters
    ----------
    yield_moment : float
        Moment M_y per length of the crease (N m per m) at which it first yields, above 0.
    isotropic, kinematic : float
        Hardening H and C (N m/rad per m), at least 0: H is the growth of the yield moment per
        plastic turn, and C the shift of the elastic range.
    law : str or HingeLaw
        The elastic law.

    Examples
    --------
    >>> Plastic(yield_moment=0.05, kinematic=0.02).yield_moment
    0.05
    """

    yield_moment: Annotated[float, Check(number, above=0.0, unit="N m per m")]
    isotropic: Annotated[float, Check(number, least=0.0, unit="N m/rad per m")] = 0.0
    kinematic: Annotated[float, Check(number, least=0.0, unit="N m/rad per m")] = 0.0
    law: str | HingeLaw = "enhanced"
    name: str = "plastic"

    formulas = (BranchFormulas(CODE, update, mean_moment),)
    rate_dependent = False

    def branches(self, stiffness: NDArray, length: NDArray) -> tuple[Branch, ...]:
        """Branches of the law; see `MemoryLaw`."""
        per = length / stiffness
        values = (per * x for x in (self.yield_moment, self.isotropic, self.kinematic))
        return (Branch(CODE, columns(len(per), *values), 0.0, 0.0, np.ones(len(per))),)

    def lost_slope(self, stiffness: NDArray, length: NDArray) -> NDArray:
        """See `MemoryLaw`."""
        return stiffness / (stiffness + length * (self.isotropic + self.kinematic))
