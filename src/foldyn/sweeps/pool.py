"""Where many computations run: in this process, in processes of this machine, on a cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Generic, Protocol, Self, TypeVar

from foldyn.sweeps.cluster import Cluster
from foldyn.workers import Workers

Item = TypeVar("Item")
Result = TypeVar("Result")


class Pool(Protocol[Item, Result]):
    """What computes something for each of many items; a context manager."""

    def each(
        self,
        items: Iterable[Item],
        keep: Callable[[Item, Result], None],
        lost: Callable[[Item, str], Result] | None = None,
        first: bool = False,
    ) -> None:
        """Compute items; each result is kept, in this process, as soon as it is ready.

        lost : result for an item whose process is gone, from the item and the reason; without it
        that is an error.
        first : whether one is computed before the others, which then find its kernels compiled.
        """
        ...

    def stop(self) -> None:
        """Give up at once."""
        ...

    def __enter__(self) -> Self:
        """Begin."""
        ...

    def __exit__(self, *_: Any) -> None:
        """End, at once if something was raised."""
        ...


class Here(Generic[Item, Result]):
    """A pool that is this process alone."""

    def __init__(self, do: Callable[[Item], Result]) -> None:
        self.do = do

    def each(
        self, items: Iterable[Item], keep: Callable[[Item, Result], None], lost: object = None,
        first: bool = False,
    ) -> None:  # fmt: skip
        """Compute items one after the other."""
        for item in items:
            keep(item, self.do(item))

    def stop(self) -> None:
        """Nothing runs beside this."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass


def pool_of(
    do: Callable[[Item], Result], processes: int, scheduler: str | None = None
) -> Pool[Item, Result]:
    """Pool that computes something for items.

    Parameters
    ----------
    do : callable
        What is computed; for other processes it must be one that can be sent there.
    processes : int
        How many items at a time on this machine; 1: in this process.
    scheduler : str, optional
        Address of a Dask scheduler, whose workers compute instead.
    """
    if scheduler is not None:
        return Cluster(do, scheduler)
    return Here(do) if processes == 1 else Workers(do, processes)
