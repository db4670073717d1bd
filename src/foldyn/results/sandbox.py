"""Calls in a separate process, so that a library's crash on damaged data ends only that process."""

from __future__ import annotations

import faulthandler
import os
import pickle
import signal
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from foldyn.errors import FoldynError

T = TypeVar("T")
IDLE = 4
"""Wall time allowed per computing time of a call, as the machine may be busy."""


def apart(make: Callable[[], T], seconds: int, memory: int) -> T:
    """Return a function's result, computed in a fork of this process.

    Except on Linux a fork is not safe; there the function is called in this process.

    Parameters
    ----------
    make : callable
        Takes no arguments; its result can be pickled.
    seconds : int
        CPU time after which the process is ended; wall time may be `IDLE` times that.
    memory : int
        Bytes that it may allocate on top of this process's own.

    Raises
    ------
    FoldynError
        The function raised it.
    OSError
        The function failed in another way, or its process crashed or exceeded a limit.
    """
    if sys.platform != "linux":
        return make()
    reading, writing = os.pipe()
    with warnings.catch_warnings():  # about threads, which the child does not need
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        os.close(reading)
        _answer(make, seconds, memory, writing)
    os.close(writing)
    value: Any
    try:
        with os.fdopen(reading, "rb") as pipe:
            made, value = pickle.load(pipe)
    except Exception:
        made, value = False, OSError("its process crashed or took too much")
    finally:
        os.waitpid(child, 0)
    if not made:
        raise value
    return value


def _answer(make: Callable[[], Any], seconds: int, memory: int, writing: int) -> None:
    """Send the function's result and end this process in any case."""
    try:
        for number in (signal.SIGALRM, signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)
        signal.alarm(IDLE * seconds)
        _limit(seconds, memory)
        faulthandler.disable()
        silent = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silent, 1)
        os.dup2(silent, 2)
        try:
            answer = True, make()
        except FoldynError as error:
            answer = False, error
        except BaseException as error:
            answer = False, OSError(f"{type(error).__name__}: {error}")
        with os.fdopen(writing, "wb") as pipe:
            pickle.dump(answer, pipe, protocol=5)
    finally:
        os._exit(0)


def _limit(seconds: int, memory: int) -> None:
    import resource  # not available on Windows

    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    wanted = pages * resource.getpagesize() + memory
    if most == resource.RLIM_INFINITY or wanted < most:
        resource.setrlimit(resource.RLIMIT_AS, (wanted, most))
