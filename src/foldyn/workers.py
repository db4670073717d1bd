"""Processes that compute for this one, and end with it.

All of them hold the reading end of one pipe, of which this process alone has the other end. When
that closes, because the work is given up or because the process is gone, however it went, they end
at once.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing import get_context
from multiprocessing.connection import Connection
from threading import Thread
from typing import Any, Self


class Workers:
    """Processes to which work is submitted; a context manager.

    Parameters
    ----------
    count : int
        Of processes.
    begin : callable, optional
        Called in each of them first, with `given`.
    *given
        Can be sent to another process.
    """

    def __init__(
        self, count: int, begin: Callable[..., None] | None = None, *given: object
    ) -> None:
        context = get_context("spawn")
        line, self._end = context.Pipe(duplex=False)
        self._line = line  # open here too: a process that starts later gets it
        self._pool = ProcessPoolExecutor(
            count, context, initializer=_live, initargs=(line, begin, given)
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


def _live(line: Connection, begin: Callable[..., None] | None, given: tuple[Any, ...]) -> None:
    """Begin a process that ends when the line does."""
    Thread(target=_follow, args=(line,), daemon=True).start()
    _arm(line)
    if line.poll():  # it ended before that
        os._exit(1)
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
