"""Pools for many computations: this process, processes of this machine, or a cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from typing import Any, Protocol, Self, TypeVar

from foldyn.errors import ComputationError, InputError, optional
from foldyn.workers import AHEAD, Workers

Item = TypeVar("Item")
Result = TypeVar("Result")


class Pool(Protocol[Item, Result]):
    """Context manager that computes many items."""

    def each(
        self,
        items: Iterable[Item],
        keep: Callable[[Item, Result], None],
        lost: Callable[[Item, str], Result] | None = None,
        first: bool = False,
    ) -> None:
        """Compute items; each result is kept, in this process, as soon as it is ready.

        lost : function of an item whose process died, and the reason, that returns a result for the
            item; without it, a dead process is an error.
        first : whether to compute one item before the others, so that they find kernels compiled.
        """
        ...

    def stop(self) -> None:
        """Abort at once."""

    def __enter__(self) -> Self:
        """Enter the context."""
        return self

    def __exit__(self, *_: Any) -> None:
        """Leave the context; abort at once if an exception was raised."""


class Here(Pool[Item, Result]):
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


PATIENCE = 30.0
"""Seconds to wait for an answer from the scheduler."""
AT_LEAST = 16
"""Items submitted at a time while the number of workers is unknown."""


class Cluster(Pool[Item, Result]):
    """Workers of a Dask cluster as a pool; a context manager.

    If a worker dies, another worker computes its item; Dask gives up an item on which several
    workers have died.

    Parameters
    ----------
    do : callable
        Computes an item.
    address : str
        Address of the scheduler, such as "tcp://10.0.0.1:8786".

    Raises
    ------
    InputError
        Dask is not installed, no scheduler answers, or a worker has several threads.
    """

    def __init__(self, do: Callable[[Item], Result], address: str) -> None:
        dask = optional("distributed", "a cluster needs Dask's library distributed", "foldyn[dask]")
        self.do, self.address, self._dask = do, address, dask
        try:
            self._client: Any = dask.Client(address, timeout=PATIENCE, set_as_default=False)
        except (TimeoutError, OSError, ValueError) as error:
            why = " ".join(str(error).split()) or "no answer"
            raise InputError(
                f" = {address}: no Dask scheduler there ({why}); give the address that it prints "
                "when it starts, as in tcp://10.0.0.1:8786",
                "scheduler",
            ) from None
        several = [one for one, threads in self._client.nthreads().items() if threads > 1]
        if several:  # all threads of a process share its warnings and library settings
            self._client.close()
            raise InputError(
                f" = {address}: its worker {several[0]} computes on several threads; start workers "
                "with --nthreads 1, and more of them",
                "scheduler",
            )

    def each(
        self,
        items: Iterable[Item],
        keep: Callable[[Item, Result], None],
        lost: Callable[[Item, str], Result] | None = None,
        first: bool = False,
    ) -> None:
        """Compute each item; see `foldyn.workers.Workers.each`.

        first : compute one item on one worker before the others.
        """
        left = iter(items)
        if first:
            self._each(islice(left, 1), keep, lost)
        self._each(left, keep, lost)

    def _each(
        self, left: Iterator[Item], keep: Callable[[Item, Result], None],
        lost: Callable[[Item, str], Result] | None,
    ) -> None:  # fmt: skip
        waiting = dict[Any, Item]()
        finished = self._dask.as_completed(loop=self._client.loop)
        self._hand_out(left, waiting, finished)
        try:
            for future in finished:
                item = waiting.pop(future)
                try:
                    result = future.result()
                except self._dask.scheduler.KilledWorker as error:
                    if lost is None:
                        raise ComputationError(f"{self.address}: {error}") from None
                    result = lost(item, f"it ended the workers that computed it: {error}")
                keep(item, result)
                future.release()
                self._hand_out(left, waiting, finished)
        except self._dask.CancelledError:
            raise ComputationError(
                f"{self.address}: the scheduler is gone; what was kept need not be computed again"
            ) from None
        finally:
            self._client.cancel(list(waiting))

    def _hand_out(self, left: Any, waiting: dict[Any, Item], finished: Any) -> None:
        """Submit enough items to keep all workers busy."""
        room = max(AHEAD * len(self._client.nthreads()), AT_LEAST)
        for item in islice(left, max(room - len(waiting), 0)):
            future = self._client.submit(self.do, item, pure=False)
            waiting[future] = item
            finished.add(future)

    def stop(self) -> None:
        """Leave the cluster, which then drops its computations for this process."""
        self._client.close()

    def __exit__(self, *_: object) -> None:
        self._client.close()


def pool_of(
    do: Callable[[Item], Result], processes: int, scheduler: str | None = None
) -> Pool[Item, Result]:
    """Create the pool that computes items.

    Parameters
    ----------
    do : callable
        Computes an item; it must be picklable to run in other processes.
    processes : int
        Number of parallel processes on this machine; 1 means this process.
    scheduler : str, optional
        Address of a Dask scheduler; its workers then compute, instead of this machine.
    """
    if scheduler is not None:
        return Cluster(do, scheduler)
    return Here(do) if processes == 1 else Workers(do, processes)
