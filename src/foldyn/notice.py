"""What is told while kernels are compiled: how many are not on disk, and about how long they take.

A kernel that Python calls brings along those that it calls, which its sources name (`jit.sources`).
So when one has to be compiled, it is known how many others are missing too, and what the ones
before took says how long that lasts.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from multiprocessing import parent_process

import numpy as np

PER_KERNEL = 0.14
"""Seconds of a processor at least: 76 of modes took 10 s, 109 of a motion with RK4 17 s."""
SHORTEST = 3.0
"""Seconds below which nothing is told."""


def on_terminal(text: str) -> None:
    """Tell whoever waits at a terminal; workers keep quiet."""
    if sys.stderr.isatty() and parent_process() is None:
        from tqdm import tqdm

        tqdm.write(text, file=sys.stderr)  # above a bar, if there is one


class Notice:
    """Follows what is compiled, and tells of it.

    Parameters
    ----------
    tell : callable
        Is given each message.
    clock : callable
        Time (s).
    worked : callable
        Time (s) that the processor has worked for this process: less where others have it, too.
    """

    def __init__(
        self,
        tell: Callable[[str], None] = on_terminal,
        clock: Callable[[], float] = time.perf_counter,
        worked: Callable[[], float] = time.process_time,
    ) -> None:
        self.tell, self._now = tell, lambda: np.array([clock(), worked()])
        self._known: set[object] = set()
        self._told, self._count, self._spent = False, 0, np.zeros(2)
        self._since = self._latest = np.zeros(2)

    def begin(self, kernel: object, missing: Callable[[], Iterable[object]]) -> None:
        """Note that a kernel is compiled now.

        missing : gives the kernels that it is made from, itself among them, and that are not on
            disk; asked only where the kernel was not among those of an earlier one.
        """
        self._count += 1
        if kernel in self._known:
            return
        new = {kernel, *missing()} - self._known
        self._known |= new
        self._spent += self._latest - self._since
        self._since = self._latest = self._now()
        done = self._count - 1
        whole, own = self._spent
        each = max(PER_KERNEL, own / done if done else 0.0)
        seconds = len(new) * each * (max(1.0, whole / own) if own > 0.0 else 1.0)
        if seconds < SHORTEST:
            return
        if self._told:
            self.tell(f"compiling {len(new)} more kernels, {_about(seconds)}")
        else:
            self.tell(
                f"compiling {len(new)} kernels for their first use, {_about(seconds)}; others may "
                "follow when they are needed, and all are kept for later runs"
            )
        self._told = True

    def end(self) -> None:
        """Note that a kernel is compiled."""
        self._latest = self._now()

    @contextmanager
    def telling(self, tell: Callable[[str], None]) -> Iterator[None]:
        """Tell something else within the block."""
        before, self.tell = self.tell, tell
        try:
            yield
        finally:
            self.tell = before


def _about(seconds: float) -> str:
    """A time in words, no more exact than it is known."""
    if seconds < 55.0:
        return f"about {max(5, 5 * round(seconds / 5.0))} s"
    minutes = round(seconds / 30.0) / 2.0
    return "about a minute" if minutes == 1.0 else f"about {minutes:g} minutes"


NOTICE = Notice()
"""That of this process, as there is one compiler in it."""
