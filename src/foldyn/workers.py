"""Processes that compute for this one, and end with it.

All of them hold the reading end of one pipe, of which this process alone has the other end. When
that closes, because the work is given up or because the process is gone, however it went, they end
at once.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from multiprocessing.connection import Connection
from threading import Thread
from typing import Any, Self, TypeVar

from foldyn import memory
from foldyn.errors import ComputationError

Item = TypeVar("Item")


class Workers:
    """Processes to which work is submitted; a context manager.

    Parameters
    ----------
    count : int
        Of processes.
    begin : callable, optional
        Called in each process at its beginning, with the arguments that follow.
    """

    def __init__(
        self, count: int, begin: Callable[..., object] | None = None, *given: object
    ) -> None:
        context = get_context("spawn")
        line, self._end = context.Pipe(duplex=False)
        self._line = line  # open here too: a process that starts later gets it
        self._pool = ProcessPoolExecutor(
            count, context, initializer=_live, initargs=(line, memory.share(), begin, *given)
        )

    def submit(self, do: Callable[..., Any], *given: object) -> Future[Any]:
        """Have something computed.

        A process that starts for it does not hear of the terminal's Ctrl-C, which is for this one.
        """
        if os.name != "posix":
            return self._pool.submit(do, *given)
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            return self._pool.submit(do, *given)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def each(
        self, do: Callable[[Item], Any], items: Iterable[Item], keep: Callable[[Item, Any], None]
    ) -> None:
        """Compute something for each item; each result is kept as soon as it is ready.

        When Ctrl-C interrupts this, the results that are ready are kept, too.

        Raises
        ------
        ComputationError
            A process was ended from outside.
        """
        waiting: dict[Future[Any], Item] = {}
        try:
            waiting = {self.submit(do, item): item for item in items}
            for future in as_completed(list(waiting)):
                keep(waiting[future], future.result())
                del waiting[future]
        except BrokenProcessPool:
            raise ComputationError(
                "a process that computes was ended from outside: perhaps for lack of memory, then "
                "what was kept need not be computed again; or, in a script, because this was not "
                'called below if __name__ == "__main__" (processes=1 needs no other process)'
            ) from None
        except KeyboardInterrupt:
            for future, item in waiting.items():
                if future.done() and not future.cancelled() and future.exception() is None:
                    keep(item, future.result())
            raise

    def stop(self) -> None:
        """End all processes at once, whatever they compute."""
        self._end.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            self.stop()
        self._pool.shutdown(cancel_futures=True)
        self._end.close()
        self._line.close()


def _live(
    line: Connection, share: float, begin: Callable[..., object] | None, *given: object
) -> None:
    """Begin a process that ends when the line does, and has its parent's share of the memory."""
    Thread(target=_follow, args=(line,), daemon=True).start()
    _arm(line)
    if line.poll():  # it ended before that
        os._exit(1)
    memory.allow(share)
    if begin is not None:
        begin(*given)


def _follow(line: Connection) -> None:
    try:
        line.recv_bytes()
    except (EOFError, OSError):
        os._exit(1)


def _arm(line: Connection) -> None:
    """Have the system end this process with the line: compiled code keeps threads waiting."""
    if sys.platform != "linux":
        return
    import fcntl

    try:  # opened anew, as who is told of what happens to an opened file is one process
        own = os.open(f"/proc/self/fd/{line.fileno()}", os.O_RDONLY | os.O_NONBLOCK)
    except OSError:
        return
    signal.signal(signal.SIGIO, signal.SIG_DFL)
    fcntl.fcntl(own, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(own, fcntl.F_SETFL, os.O_ASYNC | os.O_NONBLOCK)
