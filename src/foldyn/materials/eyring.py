"""Creep of creases after Eyring, whose relaxation at a fixed angle is logarithmic.

Let c be the part of the turn d that has crept, by jumps forward and back over a barrier that the
moment tilts (H. Eyring, J. Chem. Phys. 4, 1936). Then

    M = k (d - c),    dc/dt = r (exp(M / M0) - exp(-M / M0)),

with M0 per length of the crease. At a fixed angle, tanh(M / 2 M0) falls as exp(-2 k r t / M0). As
long as M is well above M0, this is M(t) = M(0) - M0 ln(1 + t/t0), t0 = M0 / (k r) exp(-M(0)/M0),
the logarithmic relaxation of folded sheets (B. Thiria and M. Adda-Bedia, Phys. Rev. Lett. 107,
2011; T. Jules, F. Lechenault and M. Adda-Bedia, Phys. Rev. Research 2, 2020). With a nonlinear
elastic law m(d), M = k (m(d) - c).

Over a step in which d changes by D at a constant rate, w = exp(-M/M0) satisfies the Riccati
equation w' = (r k/M0) (1 - w^2) - (k D/M0 dt) w, which is solved exactly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check
from foldyn.jit.compiled import inner_scalar, scalar
from foldyn.materials.formulas import BranchFormulas
from foldyn.materials.inelastic_law import Branch, MemoryLaw
from foldyn.materials.law import HingeLaw, columns
from foldyn.values import number

CODE = 2
LARGEST = 700.0  # largest exponent of exp


@scalar
def update(p, before, after, dt, spring, other):
    """Elastic turn, 0, moment, slope, energy and loss, divided by k, after a turn in a time dt.

    p : M0 / k, rad, and rate r, rad/s.
    """
    turn = after - before
    now, slope = _relaxed(turn, dt, spring, p[0], p[1])
    lost = 0.5 * (spring + now) * (turn - (now - spring))
    # the elastic law counts the whole turn; these are the differences from it
    return now, 0.0, now - after, slope - 1.0, 0.5 * (now * now - after * after), lost


@scalar
def mean_moment(p, before, after, dt, spring, other):
    """Mean moment of both ends, its slope, and deficit 0: the work is exactly stored or lost."""
    now, slope = _relaxed(after - before, dt, spring, p[0], p[1])
    return 0.5 * (spring + now - before - after), 0.5 * (slope - 1.0), 0.0


@inner_scalar
def _relaxed(turn, dt, spring, barrier, rate):
    """Elastic turn after a step, and its derivative with respect to the turn in the step."""
    sign = -1.0 if turn < 0.0 else 1.0
    p, t = abs(turn) / barrier, rate * dt / barrier
    if t == 0.0:
        return spring + turn, 1.0
    w = math.exp(min(-sign * spring / barrier, LARGEST))
    root = math.sqrt(p * p + 4.0 * t * t)
    tanh, rest = math.tanh(0.5 * root), 2.0 / (1.0 + math.exp(min(root, LARGEST)))
    gap = 4.0 * t * t / (root + p)  # root - p
    above = w * (gap + p * rest) + 2.0 * t * tanh
    below = root + p * tanh + 2.0 * w * t * tanh
    if not above > 0.0:  # the flow exceeds all numbers
        return spring + turn, 1.0
    dtanh = 0.5 * (1.0 - tanh * tanh) * p / root
    dabove = w * (rest - gap / root - p * dtanh) + 2.0 * t * dtanh
    dbelow = p / root + tanh + (p + 2.0 * w * t) * dtanh
    slope = dbelow / below - dabove / above
    return -sign * barrier * math.log(above / below), slope


@dataclass(frozen=True)
class Eyring(MemoryLaw):
    """Creeping law of creases.

    Parameters
    ----------
    barrier_moment : float
        Moment M0 per length of the crease (N m per m), above 0. An increase of the moment by M0
        makes the creep e times as fast.
    rate : float
        Rate r (rad/s), above 0.
    law : str or HingeLaw
        The elastic law.

    Examples
    --------
    >>> Eyring(barrier_moment=0.001, rate=1e-9).rate
    1e-09
    """

    barrier_moment: Annotated[float, Check(number, above=0.0, unit="N m per m")]
    rate: Annotated[float, Check(number, above=0.0, unit="rad/s")]
    law: str | HingeLaw = "enhanced"
    name: str = "eyring"

    formulas = (BranchFormulas(CODE, update, mean_moment),)
    rate_dependent = True

    def branches(self, stiffness: NDArray, length: NDArray) -> tuple[Branch, ...]:
        """Branches of the law, see `MemoryLaw`; under small moments the creep is viscous."""
        barrier = self.barrier_moment * length / stiffness
        table = columns(len(barrier), barrier, self.rate)
        return (Branch(CODE, table, -1.0, 1.0, 2.0 * self.rate / barrier),)

    def lost_slope(self, stiffness: NDArray, length: NDArray) -> NDArray:
        """All: it creeps the faster, the larger the moment; see `MemoryLaw`."""
        return np.ones(len(stiffness))
