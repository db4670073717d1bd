"""A Dask cluster as a pool: its scheduler's address is all that is needed of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from typing import Any, Generic, Self, TypeVar

from foldyn.errors import ComputationError, InputError, optional
from foldyn.workers import AHEAD

Item = TypeVar("Item")
Result = TypeVar("Result")

PATIENCE = 30.0
"""Seconds after which a scheduler that does not answer is given up."""
AT_LEAST = 16
"""Items that are handed out at a time while it is not known how many workers there are."""


class Cluster(Generic[Item, Result]):
    """Workers of a Dask cluster, to which work is given; a context manager.

    An item whose worker is gone is computed by another one; Dask gives up one that has ended
    several workers.

    Parameters
    ----------
    do : callable
        What is computed for an item.
    address : str
        Of the scheduler, "tcp://10.0.0.1:8786".

    Raises
    ------
    InputError
        Dask is not installed, nothing answers there, or a worker computes on several threads.
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
        if several:  # warnings and libraries of one process would mix
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
        """Compute something for each item; see `foldyn.workers.Workers.each`.

        first : whether one is computed by one worker before the others.
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
        """Hand out so many items that no worker is idle."""
        room = max(AHEAD * len(self._client.nthreads()), AT_LEAST)
        for item in islice(left, max(room - len(waiting), 0)):
            future = self._client.submit(self.do, item, pure=False)
            waiting[future] = item
            finished.add(future)

    def stop(self) -> None:
        """Leave the cluster; what it computes for this process is dropped."""
        self._client.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._client.close()
