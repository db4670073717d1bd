"""How many functions are compiled, instead of loaded from disk."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from numba.core import event


@contextmanager
def counted() -> Iterator[Callable[[], int]]:
    """Give what returns how many functions have been compiled so far within this context."""
    with event.install_recorder("numba:compile") as recorder:
        yield lambda: sum(one.is_start for _, one in recorder.buffer)
