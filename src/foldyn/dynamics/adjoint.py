"""What discrete adjoints of motions share: derivatives by what a motion has beside its terms."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.waveforms import evaluate
from foldyn.dynamics.system import scratch
from foldyn.errors import InputError
from foldyn.mechanics.pullback import Pullback, arrays_of_body


class ByMotion(NamedTuple):
    """Derivatives by what a motion has beside its terms."""

    loads: NDArray  # (l,) by `System.loads`
    moved: NDArray  # (s,) by `System.moved`
    mass: NDArray  # (entries,) by those of the nodal mass matrix
    alpha: NDArray  # (1,)


class Adjoint(ABC):
    """Backward through a motion, from derivatives of a number by its samples.

    Parameters
    ----------
    motion : Motion
        Ready to be computed, by `dynamics.driver.prepare`.
    """

    def __init__(self, motion: Any) -> None:
        packed = motion.packed
        self._packed, self._system, self._mass = packed, packed.system, packed.mass
        self._plan, self._pullback = motion.plan, Pullback(packed.body)
        self._imposed = packed.numbering.inward(motion.case.imposed)
        self._scratch = scratch(packed.system)
        sizes = len(self._system.loads.dof), len(self._system.moved.dof), len(self._mass.data), 1
        self._by = ByMotion(*map(np.zeros, sizes))

    def add_supports(self, t: float, by_u: NDArray, by_v: NDArray) -> None:
        """Add what a number with these derivatives by a sample at t (s) has by supports."""
        self._evaluate(t)
        moved, factor = self._system.moved, self._scratch.factor
        rate = factor[moved.row]
        self._by.moved[:] += by_u.ravel()[moved.dof] * rate[:, 0]
        self._by.moved[:] += by_v.ravel()[moved.dof] * rate[:, 1]

    @abstractmethod
    def backward(self, first: int, last: int, by_u: NDArray, by_v: NDArray) -> None:
        """Go back over the steps from number `first` to `last`.

        by_u, by_v : derivatives (n, 3) of the number by the state at the last; they become, in
            place, those by the state at the first.
        """

    def gradient(self, by_u: NDArray, by_v: NDArray) -> dict[str, NDArray]:
        """Derivatives of the number, from those by the state at the start, where it goes back to.

        By the arrays of the terms (`pullback.arrays_of_body`), by "loads", "moved", "mass" and
        "alpha" as `ByMotion` says, and by "start.displacement" and "start.velocity".
        """
        self._evaluate(self._plan.start)
        moved, outward = self._system.moved, self._packed.numbering.outward
        # a base starts from where the state puts it
        free = ~self._imposed.ravel()[moved.dof]
        factor = self._scratch.factor[moved.row, 0]
        self._by.moved[:] -= free * by_u.ravel()[moved.dof] * factor
        # forces of terms resist: they stand with a minus in the acceleration
        terms = {name: -out for name, out in self._pullback.gradient.items()}
        start = {"start.displacement": outward(by_u), "start.velocity": outward(by_v)}
        return terms | self._by._asdict() | start

    def _evaluate(self, t: float) -> None:
        if self._system.varies:
            evaluate(self._system.waves, t, True, self._scratch.factor)
        self._scratch.time[0] = t


def refuse(motion: Any) -> None:
    """Refuse motions that have no adjoint yet, with a remedy."""
    packed, system = motion.packed, motion.packed.system
    arrays_of_body(packed.body)  # which refuses terms
    lacks = {
        "contact, which switches on and off": system.touches,
        "rest angles that turn in time (Actuate, Temperature)": system.turns,
        "loads that depend on the displacement (Pressure, CreaseMoment)": system.follows,
        "constraints (Link, rigid panels)": len(system.ties.slave) > 0,
        "supports that move at the start, and a mass matrix that is not diagonal": (
            not packed.mass.lumped and bool(motion.start[1][motion.case.fixed].any())
        ),
    }
    for what, here in lacks.items():
        if here:
            raise InputError(
                f"there are no gradients of motions with {what}; leave that out, or vary the "
                "parameters by fd.sweep"
            )
