"""Latches as a law with memory: a spring that engages where a crease passes an angle.

A latch that is open has no moment. It engages where the crease passes the latch's angle, coming
from the side on which it rests, and then holds the crease there with k (theta - angle). It opens
where this moment exceeds what it can hold, or at a given time, and what it has stored is lost; it
engages again where the crease passes the angle again. Within a step a latch engages at its angle
itself, however far the step goes, so that engaging neither stores nor loses energy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner_scalar, scalar
from foldyn.materials.formulas import BranchFormulas
from foldyn.materials.inelastic_law import Branch, MemoryLaw
from foldyn.materials.law import HingeLaw

CODE = 3


@inner_scalar
def _closed(p, before, after, dt, engaged, since):
    """Whether a latch holds after a turn, and the turn at which it has opened, if it has."""
    limit = p[1]
    holds = engaged != 0.0
    if p[2] <= since + dt:  # its time has come
        return False, min(abs(before - p[0]), limit) if holds else 0.0
    if not holds and p[3] * (before - p[0]) <= 0.0 and p[3] * (after - p[0]) > 0.0:
        holds = True
    if holds and abs(after - p[0]) > limit:
        return False, limit
    return holds, 0.0


@scalar
def update(p, before, after, dt, engaged, since):
    """Whether it holds, time, moment, slope, energy and loss, divided by k, after a turn.

    p : turn of the latch and turn from there that opens it, rad; time (s) at which it opens; its
    stiffness divided by k, with the sign of the turns that engage it.
    """
    holds, opened = _closed(p, before, after, dt, engaged, since)
    k, lost = abs(p[3]), 0.5 * abs(p[3]) * opened * opened
    if not holds:
        return 0.0, since + dt, 0.0, 0.0, 0.0, lost
    turn = after - p[0]
    return 1.0, since + dt, k * turn, k, 0.5 * k * turn * turn, lost


@scalar
def mean_moment(p, before, after, dt, engaged, since):
    """Mean moment along the turn, its slope, and the loss that the work of this mean lacks."""
    holds, opened = _closed(p, before, after, dt, engaged, since)
    k, turn = abs(p[3]), after - before
    held = before - p[0] if engaged != 0.0 else 0.0
    if engaged != 0.0 and holds:
        return 0.5 * k * (before + after - 2.0 * p[0]), 0.5 * k, 0.0
    last = after - p[0] if holds else opened
    done = 0.5 * k * (last * last - held * held)
    if abs(turn) < 1e-12:
        return 0.0, 0.0, done
    return done / turn, (k * last * holds - done / turn) / turn, 0.0


@dataclass(frozen=True)
class Latching(MemoryLaw):
    """Latches of hinges, in the place of a law.

    Parameters
    ----------
    at : tuple of float
        Turn of each hinge, from rest, at which its latch holds, rad.
    stiffness : tuple of float
        Stiffness of each latch, N m/rad, with the sign of the turns that engage it.
    limit : tuple of float
        Turn from there that opens each latch, rad.
    until : float
        Time at which they open, s.
    """

    at: tuple[float, ...] = ()
    stiffness: tuple[float, ...] = ()
    limit: tuple[float, ...] = ()
    until: float = np.inf
    law: str | HingeLaw = "linear"
    name: str = "latch"

    formulas = (BranchFormulas(CODE, update, mean_moment),)
    rate_dependent = False

    def branches(self, stiffness: NDArray, length: NDArray) -> tuple[Branch, ...]:
        """Branches of the law; see `MemoryLaw`."""
        own = np.array(self.stiffness) / stiffness
        table = np.stack([self.at, self.limit, np.full(len(own), self.until), own], axis=1)
        return (Branch(CODE, table, 0.0, 0.0, np.ones(len(own)), np.abs(own)),)
