"""Worker processes, which end with this process.

All workers hold the reading end of one pipe, and only this process holds the other end. When that
end closes, because the work is abandoned or this process has ended in any way, all workers end at
once.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from itertools import islice
from multiprocessing import get_context
from multiprocessing.connection import Connection
from threading import Thread
from typing import Any, Generic, Self, TypeVar

from foldyn import ram_limit
from foldyn.errors import ComputationError

Item = TypeVar("Item")
Result = TypeVar("Result")

AHEAD = 2
"""Number of items that wait for each process, so that no process is idle."""
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Environment variables that restrict a process to one thread, for processes that run side by
side."""
GONE = "the process that computed it was ended from outside, perhaps for lack of memory"


class Workers(Generic[Item, Result]):
    """Worker processes; a context manager.

    Each worker runs on one thread, and refuses work that needs more than its share of the memory.

    Parameters
    ----------
    do : callable
        Function of an item; it is sent to each process once.
    count : int
        Number of processes.
    """

    def __init__(self, do: Callable[[Item], Result], count: int) -> None:
        self.do, self.count = do, count
        self._context = get_context("spawn")
        line, self._end = self._context.Pipe(duplex=False)
        self._line = line  # stays open in this process: later workers need it
        self._pool = self._started()

    def _started(self) -> ProcessPoolExecutor:
        given = (self._line, ram_limit.share() / self.count, pickle.dumps(self.do))
        return ProcessPoolExecutor(self.count, self._context, initializer=_live, initargs=given)

    def _submit(self, do: Callable[..., Any], *given: object) -> Future[Any]:
        """Submit a function to the pool.

        A worker process that this starts ignores the terminal's Ctrl-C, which is meant for this
        process.
        """
        if os.name != "posix":
            return self._pool.submit(do, *given)
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            return self._pool.submit(do, *given)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def each(
        self,
        items: Iterable[Item],
        keep: Callable[[Item, Result], None],
        lost: Callable[[Item, str], Result] | None = None,
        first: bool = False,
    ) -> None:
        """Compute a result for each item, and keep each as soon as it is ready.

        Results that are ready when Ctrl-C interrupts are kept, too.

        Parameters
        ----------
        items : iterable
        keep : callable
            Called with an item and its result.
        lost : callable, optional
            Called with an item and a reason if the item's process was killed twice, the second time
            while it computed nothing else; returns the result of the item. Other items are still
            computed. Only for calls from one thread at a time.
        first : bool
            Whether to compute the first item here while the processes start, so that they find its
            kernels compiled.

        Raises
        ------
        ComputationError
            A process was killed, and there is no `lost`.
        """
        left, doubtful = iter(items), deque[Item]()
        for item in islice(left, int(first)):
            for _ in range(self.count):
                self._submit(int)  # starts a process
            keep(item, self.do(item))
        while True:
            broken = self._each(left, keep)
            if not broken:
                break
            if lost is None:
                raise ComputationError(
                    "a worker process was ended from outside, perhaps for lack of memory (what was "
                    "kept need not be computed again). In a script, call this only below "
                    'if __name__ == "__main__", or give processes=1, which needs no other process'
                )
            doubtful.extend(broken)
            self._restart()
            while doubtful:  # one item at a time, to find the one that kills its process
                item = doubtful.popleft()
                if self._each(iter([item]), keep):
                    keep(item, lost(item, GONE))
                    self._restart()

    def _each(self, left: Iterator[Item], keep: Callable[[Item, Result], None]) -> list[Item]:
        """Compute the remaining items; return the items under way when a process was killed."""
        waiting: dict[Future[Any], Item] = {}
        broken: list[Item] = []
        try:
            while True:
                for item in islice(left, AHEAD * self.count - len(waiting)):
                    try:
                        waiting[self._submit(_do, item)] = item
                    except BrokenProcessPool:
                        broken.append(item)
                        break
                if broken or not waiting:
                    break
                for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                    broken += self._kept(future, waiting, keep)
            for future in list(waiting) if broken else ():
                broken += self._kept(future, waiting, keep)
        except KeyboardInterrupt:
            for future, item in waiting.items():
                if future.done() and not future.cancelled() and future.exception() is None:
                    keep(item, future.result())
            raise
        return broken

    def _kept(
        self, future: Future[Any], waiting: dict[Future[Any], Item],
        keep: Callable[[Item, Result], None],
    ) -> list[Item]:  # fmt: skip
        """Keep the result of a future; return its item if its process was killed."""
        try:
            result = future.result()
        except BrokenProcessPool:
            return [waiting.pop(future)]
        keep(waiting[future], result)
        del waiting[future]
        return []

    def _restart(self) -> None:
        self._pool.shutdown(cancel_futures=True)
        self._pool = self._started()

    def stop(self) -> None:
        """End all processes immediately."""
        self._end.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            self.stop()
        self._pool.shutdown(cancel_futures=True)
        self._end.close()
        self._line.close()


_own: list[Callable[[Any], Any]] = []  # the function of a worker process


def _do(item: Any) -> Any:
    return _own[0](item)


def _live(line: Connection, share: float, do: bytes) -> None:
    """Start a worker that ends with the pipe, with its share of the memory and one thread.

    The function arrives as bytes, because unpickling it loads libraries, which must read the
    environment set here.
    """
    Thread(target=_follow, args=(line,), daemon=True).start()
    _arm(line)
    if line.poll():  # the pipe has already closed
        os._exit(1)
    ram_limit.allow(share)
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
    _own[:] = [pickle.loads(do)]
    if "numpy" in sys.modules:  # loaded earlier, by the main script
        from threadpoolctl import threadpool_limits

        threadpool_limits(1, user_api="blas")


def _follow(line: Connection) -> None:
    try:
        line.recv_bytes()
    except (EOFError, OSError):
        os._exit(1)


def _arm(line: Connection) -> None:
    """Let the system end this process with the pipe: compiled code blocks Python's threads."""
    if sys.platform != "linux":
        return
    import fcntl

    try:  # opened again, because only one process is notified per open file
        own = os.open(f"/proc/self/fd/{line.fileno()}", os.O_RDONLY | os.O_NONBLOCK)
    except OSError:
        return
    signal.signal(signal.SIGIO, signal.SIG_DFL)
    fcntl.fcntl(own, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(own, fcntl.F_SETFL, os.O_ASYNC | os.O_NONBLOCK)
