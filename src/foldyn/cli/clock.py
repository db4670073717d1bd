"""What a command has cost so far."""

from __future__ import annotations

import time
from typing import NamedTuple


class Clock(NamedTuple):
    """When a command began, by the wall and by the processor (s)."""

    wall: float
    cpu: float

    @classmethod
    def now(cls) -> Clock:
        """Both clocks at this moment."""
        return cls(time.perf_counter(), time.process_time())

    def spent(self) -> dict[str, float]:
        """Time (s) since then: `wall` and `cpu`."""
        return {name: b - a for name, a, b in zip(self._fields, self, self.now(), strict=True)}
