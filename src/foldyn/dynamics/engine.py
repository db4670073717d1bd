"""`Engine`: base class of the objects that advance a motion, on a processor or a GPU."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

from foldyn.dynamics.checkpoint import restore, snapshot
from foldyn.dynamics.motion_state import Samples


class Engine(ABC):
    """Advances a `MotionState` in place; base class.

    Attributes
    ----------
    threads : int
        Number of threads that the engine runs on.
    """

    threads = 1

    @abstractmethod
    def advance(self, out: Samples, stretch: int) -> tuple[int, int]:
        """Advance the motion by at most `stretch` steps; returns (outcome, hinge)."""

    @abstractmethod
    def continuation(self) -> NDArray:
        """What samples do not hold, to continue from the last one; (0,) if they hold all."""

    @abstractmethod
    def changing(self) -> dict[str, Any]:
        """What the next steps depend on, apart from the case, when a stretch has ended."""

    def checkpoint_arrays(self) -> dict[str, NDArray]:
        """All arrays and numbers of `changing`, by name."""
        return snapshot(self.changing())

    def resume_from(self, arrays: Mapping[str, NDArray]) -> None:
        """Resume from the checkpoint arrays of an engine with the same number of threads."""
        restore(self.changing(), arrays)

    def facts(self) -> dict[str, Any]:
        """Statistics for the result's attributes."""
        return {}
