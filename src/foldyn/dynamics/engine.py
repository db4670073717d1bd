"""What computes a motion, stretch after stretch of steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from foldyn.cases.waveforms import CALLED
from foldyn.dynamics.course import Course, Plan, Samples
from foldyn.dynamics.system import Packed, scratches
from foldyn.mechanics.threads import run_together


class Engine(Protocol):
    """Integrator with the case and the memory that it works with.

    Attributes
    ----------
    threads : int
        Threads that it runs on.
    """

    threads: int

    def advance(self, course: Course, plan: Plan, out: Samples, stretch: int) -> tuple[int, int]:
        """Advance a motion in place by at most `stretch` steps; returns (outcome, hinge)."""
        ...

    def facts(self) -> dict[str, Any]:
        """Statistics of its own, for the result's attributes."""
        ...


class Compiled:
    """An explicit method, whose whole loop is compiled.

    Parameters
    ----------
    advance : callable
        The loop; see `rk4.advance`.
    packed : Packed
        The case.
    threads : int
        On how many threads it shall run at most; fewer where elements reach too far.
    """

    def __init__(
        self, advance: Callable[..., tuple[int, int]], packed: Packed, threads: int
    ) -> None:
        self._loop, self._packed = advance, packed
        self._works = packed.body.workspaces(threads)
        self._memories = scratches(packed.system, self._works)
        self.threads = len(self._works)

    def advance(self, course: Course, plan: Plan, out: Samples, stretch: int) -> tuple[int, int]:
        """See `Engine`."""
        model, system, mass = self._packed.model, self._packed.system, self._packed.mass
        arguments = [
            (model, system, mass, course, plan, out, work, memory, stretch)
            for work, memory in zip(self._works, self._memories, strict=True)
        ]
        return run_together(self._loop, [work.team for work in self._works], arguments)[0]

    def facts(self) -> dict[str, Any]:
        """See `Engine`."""
        return {}


def threads_of(packed: Packed) -> int:
    """Threads on which a motion of a case runs fastest.

    One where something would have to be done by each of them: functions of the user, moving
    supports, actuated folds, the substitutions of a consistent mass matrix.
    """
    system = packed.system
    called = bool((system.waves.code == CALLED).any())
    alone = system.moves or system.turns or called or not packed.mass.lumped
    return 1 if alone else packed.body.threads
