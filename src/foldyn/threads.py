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

FEW = 2000  # up to this number of rows of a full matrix, more threads are slower


def processors() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_threads(do: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """Results of `do` for each item, computed by threads on all processors.

    This pays off for linear algebra, which runs without Python's lock; each item uses one thread.
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
    """Keep LAPACK on one thread: more threads slow down factorizations of small or band matrices.

    With two threads of SciPy's OpenBLAS, band matrices took 5 times as long at 333 dofs and 1.4
    times at 6000; full matrices took twice as long at 400 to 900 rows. Threads also wait for each
    other if other programs run. Threads of other libraries (PARDISO) are not limited.

    rows : number of rows of a full matrix; above `FEW`, threads are not limited.
    """
    return nullcontext() if rows > FEW else _ONE


@cache
def _openblas() -> ThreadpoolController:
    import scipy.linalg  # noqa: F401  # libraries are found only once they are loaded

    return ThreadpoolController().select(internal_api="openblas")
