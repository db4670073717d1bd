"""A pool that is this process, and integrates the motions of many points at once on a GPU."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import islice

from foldyn.analyses.casefile import Moving
from foldyn.dynamics.motion import Motion
from foldyn.sweeps.evaluations import Evaluation
from foldyn.sweeps.job import Job
from foldyn.sweeps.points import Point
from foldyn.sweeps.pool import Here

AT_ONCE = 512
"""Motions, at most: a GPU is at full speed."""
ROOM = 2.0**31
"""Bytes of their samples."""


class SideBySide(Here[Point, Evaluation]):
    """A pool whose points are motions.

    Parameters
    ----------
    job : Job
        Of motions. What of them has no GPU kernel, and what goes wrong on the GPU, is computed by
        a processor.
    like : Motion
        One of them, from which the room for their samples is estimated.
    """

    def __init__(self, job: Job, like: Motion) -> None:
        super().__init__(job)
        self.job = job
        size = 48.0 * like.expected_samples * like.packed.system.rows  # bytes
        self.count = int(max(1, min(AT_ONCE, ROOM / size)))

    def each(
        self, items: Iterable[Point], keep: Callable[[Point, Evaluation], None],
        lost: object = None, first: bool = False,
    ) -> None:  # fmt: skip
        """Compute items, many at a time."""
        from foldyn.dynamics.gpu.many import integrate_prepared

        left = iter(items)
        while some := list(islice(left, self.count)):
            begun = [(point, self.job.begun(point)) for point in some]
            moving = [one.compute for _, one in begun if isinstance(one.compute, Moving)]
            for k in integrate_prepared([compute.motion for compute in moving]):
                moving[k].integrated = True
            while begun:  # which gives its samples' memory back
                point, one = begun.pop(0)
                keep(point, one.finished())
