"""Pools for many computations: this process, processes of this machine, or a cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Generic, Protocol, Self, TypeVar

from foldyn.sweeps.cluster import Cluster
from foldyn.workers import Workers

Item = TypeVar("Item")
Result = TypeVar("Result")


class Pool(Protocol[Item, Result]):
    """Computes many items; a context manager."""

    def each(
        self,
        items: Iterable[Item],
        keep: Callable[[Item, Result], None],
        lost: Callable[[Item, str], Result] | None = None,
        first: bool = False,
    ) -> None:
        """Compute items; each result is kept, in this process, as soon as it is ready.

        lost : returns a result for an item whose process died, given the item and the reason;
        without it that is an error. first : compute one item before the others, which then find its
        kernels compiled.
        """
        ...

    def stop(self) -> None:
        """Abort at once."""
        ...

    def __enter__(self) -> Self:
        """Enter the context."""
        ...

    def __exit__(self, *_: Any) -> None:
        """Leave the context, at once if something was raised."""
        ...


class Here(Generic[Item, Result]):
    """A pool that runs in this process only."""

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
        """Do nothing, as nothing runs in the background."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass


def pool_of(
    do: Callable[[Item], Result], processes: int, scheduler: str | None = None
) -> Pool[Item, Result]:
    """Create the pool that computes items.

    Parameters
    ----------
    do : callable
        Computes an item; for other processes it must be picklable.
    processes : int
        Number of parallel processes on this machine; 1 means this process.
    scheduler : str, optional
        Address of a Dask scheduler, whose workers compute instead.
    """
    if scheduler is not None:
        return Cluster(do, scheduler)
    return Here(do) if processes == 1 else Workers(do, processes)
