"""What computes a motion, stretch after stretch of steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from foldyn.dynamics.course import Course, Plan, Samples
from foldyn.dynamics.system import Packed, scratch
from foldyn.mechanics import workspace


class Engine(Protocol):
    """Integrator with the case and the memory that it works with."""

    def advance(self, course: Course, plan: Plan, out: Samples, stretch: int) -> tuple[int, int]:
        """Advance a motion in place by at most `stretch` steps; returns (outcome, hinge)."""
        ...


class Compiled:
    """An explicit method, whose whole loop is compiled."""

    def __init__(self, advance: Callable[..., tuple[int, int]], packed: Packed) -> None:
        self._loop, self._packed = advance, packed
        self._work = workspace(packed.model)
        self._memory = scratch(len(packed.model.rest), len(packed.system.waves.code))

    def advance(self, course: Course, plan: Plan, out: Samples, stretch: int) -> tuple[int, int]:
        """See `Engine`."""
        model, system, mass = self._packed.model, self._packed.system, self._packed.mass
        return self._loop(model, system, mass, course, plan, out, self._work, self._memory, stretch)
