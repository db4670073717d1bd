"""A pool in this process that integrates the motions of many points in batches on a GPU."""

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
"""Most motions in a batch, enough for a GPU's full speed."""
ROOM = 2.0**31
"""Bytes for their samples."""


class SideBySide(Here[Point, Evaluation]):
    """A pool for points that are motions.

    Parameters
    ----------
    job : Job
        Job whose points are motions. Points without a GPU kernel, or that fail on the GPU, run on
        the CPU.
    like : Motion
        One of the motions, used to estimate the memory for samples.
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
        """Compute items in batches."""
        from foldyn.dynamics.gpu.many import integrate_prepared

        left = iter(items)
        while some := list(islice(left, self.count)):
            begun = [(point, self.job.begun(point)) for point in some]
            moving = [one.compute for _, one in begun if isinstance(one.compute, Moving)]
            for k in integrate_prepared([compute.motion for compute in moving]):
                moving[k].integrated = True
            while begun:  # frees the memory of its samples
                point, one = begun.pop(0)
                keep(point, one.finished())
