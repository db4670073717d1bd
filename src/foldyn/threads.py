"""Threads of this process: their number, and the number that linear algebra uses."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from functools import cache
from threading import Lock
from typing import Any, TypeVar

from threadpoolctl import ThreadpoolController, threadpool_limits

Item = TypeVar("Item")
Result = TypeVar("Result")

FEW = 2000  # rows of a full matrix up to which more threads are slower


def processors() -> int:
    """Processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def in_threads(do: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """Results of `do` for each item, computed by threads on all processors.

    This pays off for linear algebra, which runs without Python's lock, on one thread each.
    """
    with threadpool_limits(1), ThreadPoolExecutor(processors()) as pool:
        return list(pool.map(do, items))


class _Limit:
    """Limits LAPACK's threads in this process while any caller is inside."""

    def __init__(self) -> None:
        self._lock, self._inside = Lock(), 0
        self._limited: Any = None

    def __enter__(self) -> None:
        with self._lock:
            if not self._inside:
                self._limited = _openblas().limit(limits=1)
            self._inside += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._inside -= 1
            if not self._inside:
                self._limited.restore_original_limits()


_ONE = _Limit()


def one_thread(rows: int = 0) -> AbstractContextManager:
    """Keep LAPACK on one thread: more slow down factorizations of bands and of few rows.

    Measured with two threads, SciPy's OpenBLAS: bands 5 times at 333 dofs, 1.4 at 6000; full
    matrices twice at 400 to 900 rows. They also wait for each other if other programs run. Threads
    of other libraries (PARDISO) are not limited.

    rows : of a full matrix; above FEW, threads are not limited.
    """
    return nullcontext() if rows > FEW else _ONE


@cache
def _openblas() -> ThreadpoolController:
    import scipy.linalg  # noqa: F401  # libraries are found only once they are loaded

    return ThreadpoolController().select(internal_api="openblas")
