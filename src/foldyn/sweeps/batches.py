"""Points that are computed in batches, as motions side by side are, kept one by one."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Generic, Self, TypeVar

from foldyn.mechanics.lanes import WIDTH
from foldyn.sweeps.evaluations import Evaluation
from foldyn.sweeps.pool import Pool

Point = TypeVar("Point")

MOST = 8 * WIDTH
"""Points of a batch where motions may go side by side."""
SECONDS = 20.0
"""Computing time of a batch where points are quick: what is under way is lost with a process."""
SHARE = 2
"""Batches that each process can expect at least, so that none waits long for the last one."""


class Batches(Generic[Point]):
    """A pool that computes batches of points, as a pool of points.

    Parameters
    ----------
    pool : Pool
        Computes a list of evaluations for a tuple of points.
    most : int
        Points of a batch, at most; 1: each point is alone.
    """

    def __init__(self, pool: Pool[tuple[Point, ...], list[Evaluation]], most: int = MOST) -> None:
        self.pool, self.most = pool, most
        self._seconds = self._count = 0.0

    @property
    def count(self) -> int:
        """Batches that are computed at a time."""
        return self.pool.count

    def each(
        self,
        items: Iterable[Point],
        keep: Callable[[Point, Evaluation], None],
        lost: Callable[[Point, str], Evaluation] | None = None,
        first: bool = False,
    ) -> None:
        """Compute points; see `Pool.each`.

        The points of a batch that has ended its process are computed again, each alone.
        """
        doubtful = list[tuple[Point, ...]]()

        def keep_all(batch: tuple[Point, ...], found: list[Evaluation]) -> None:
            for point, one in zip(batch, found, strict=False):  # none of one that is lost
                self._seconds, self._count = self._seconds + one.seconds, self._count + 1.0
                keep(point, one)

        def lost_all(batch: tuple[Point, ...], reason: str) -> list[Evaluation]:
            assert lost is not None
            if len(batch) == 1:
                return [lost(batch[0], reason)]
            doubtful.extend((point,) for point in batch)
            return []

        blamed = None if lost is None else lost_all
        self.pool.each(self._batches(items), keep_all, blamed, first)
        if doubtful:
            self.pool.each(doubtful, keep_all, blamed)

    def _batches(self, items: Iterable[Point]) -> Iterator[tuple[Point, ...]]:
        """Batches, each as large as makes sense when it is asked for."""
        left = deque(items)
        while left:
            yield tuple(left.popleft() for _ in range(self.size(len(left))))

    def size(self, left: int) -> int:
        """Points of the next batch, of so many that are left: whole vectors, but for the last."""
        each = -(-left // self.pool.count)
        if min(each, self.most) <= WIDTH:
            return min(each, self.most)
        quick = SECONDS * self._count / self._seconds if self._seconds > 0.0 else 0.0
        wanted = min(self.most, each // SHARE, int(quick))
        return max(WIDTH, wanted - wanted % WIDTH)

    def stop(self) -> None:
        """Give up at once."""
        self.pool.stop()

    def __enter__(self) -> Self:
        self.pool.__enter__()
        return self

    def __exit__(self, *what: Any) -> None:
        self.pool.__exit__(*what)
