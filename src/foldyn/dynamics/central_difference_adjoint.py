"""Discrete adjoint of central differences: exact gradients of the computed motion.

A step maps displacement u, velocity v and the stored acceleration a to

    v' = v + dt/2 a,   u1 = u + dt v',   a1 = a(u1, v' + dt/2 a),   v1 = v' + dt/2 a1.

Stored states allow the steps to be recomputed, bit for bit. The points of force
evaluation and the accelerations are stored for one segment of steps at a time.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.dynamics.adjoint import Adjoint
from foldyn.dynamics.equation import EquationOfMotion, accelerate

ROOM = 4e6  # memory for the states of a segment, bytes


Evaluated = tuple[NDArray, NDArray, NDArray]
"""Displacement (n, 3), m, and velocity, m/s, of a force evaluation, and the acceleration, m/s2."""


class CentralDifferenceAdjoint(Adjoint):
    """Backward pass through a motion by central differences; see `Adjoint`."""

    def __init__(self, motion: Any) -> None:
        super().__init__(motion)
        packed, start = self._packed, motion.beginning
        part = packed.body.thread_parts(1)[0]
        self._equation = EquationOfMotion(packed, part, self._scratch, start, None)
        self._apart = max(1, int(ROOM / (3 * start.u.nbytes)))
        self._number, self._segment = -1, list[Evaluated]()
        self._by_a = np.zeros_like(start.u)
        state = start.u, start.v, self._acceleration(0, start.u, start.v)
        self._begin, self._kept = state, [state]
        for first in range(0, self._plan.steps - self._apart, self._apart):
            self._kept.append(self._taken(first, first + self._apart, *self._kept[-1])[0])

    def backward(self, first: int, last: int, by_u: NDArray, by_v: NDArray) -> None:
        """Step backward from step number `last` to step number `first`; see `Adjoint`."""
        for step in range(last, first, -1):
            number, place = divmod(step - 1, self._apart)
            if number != self._number:
                start = number * self._apart
                end = min(start + self._apart, self._plan.steps)
                self._number = number
                self._segment = self._taken(start, end, *self._kept[number])[1]
            self._back(step, self._segment[place], by_u, by_v)
        if first == 0:
            push = self._push(self._by_a)
            self._through(self._plan.start, *self._begin, push, self._by_a, by_u, by_v)
            self._by_a[:] = 0.0

    def _back(self, step: int, at: Evaluated, by_u: NDArray, by_v: NDArray) -> None:
        """Step backward from the end of one step to its start."""
        half, by_ahead = 0.5 * self._plan.dt, np.zeros_like(by_v)
        by_a = self._by_a + half * by_v
        t = self._plan.start + step * self._plan.dt
        self._through(t, *at, self._push(by_a), by_a, by_u, by_ahead)
        by_v += by_ahead + self._plan.dt * by_u
        self._by_a[:] = half * (by_ahead + by_v)

    def _taken(
        self, first: int, last: int, u: NDArray, v: NDArray, a: NDArray
    ) -> tuple[Evaluated, list[Evaluated]]:
        """Repeat the steps `first` to `last`; return the final state and all force evaluations.

        Reproduces the forward run bit for bit.
        """
        dt, taken = self._plan.dt, []
        for step in range(first + 1, last + 1):
            v = v + 0.5 * dt * a
            u = u + dt * v
            ahead = v + 0.5 * dt * a
            a = self._acceleration(step, u, ahead)
            v = v + 0.5 * dt * a
            taken.append((u, ahead, a))
        return (u, v, a), taken

    def _acceleration(self, step: int, u: NDArray, v: NDArray) -> NDArray:
        out, t = np.zeros_like(u), self._plan.start + step * self._plan.dt
        accelerate(self._equation.handle, u, v, t, out)
        return out
