"""Messages while kernels compile: how many are missing on disk, and the expected time.

A kernel called from Python requires the kernels that it calls; its sources name them
(`jit.sources`). So when a kernel must be compiled, the number of missing kernels is known, and
earlier compile times give an estimate.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from multiprocessing import parent_process

import numpy as np

PER_KERNEL = 0.14
"""Smallest processor time (s) per kernel: 76 kernels of modes took 10 s, 109 kernels of a motion
with RK4 took 17 s."""
SHORTEST = 3.0
"""Expected times (s) below this are not announced."""


def on_terminal(text: str) -> None:
    """Print to a terminal, if there is one; worker processes print nothing."""
    if sys.stderr.isatty() and parent_process() is None:
        from tqdm import tqdm

        tqdm.write(text, file=sys.stderr)  # above a bar, if there is one


class Notice:
    """Follows compilation and reports its progress.

    Parameters
    ----------
    tell : callable
        Receives each message.
    clock : callable
        Time (s).
    worked : callable
        Processor time (s) of this process.
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
        """Note the start of a kernel's compilation.

        missing : function that returns the kernels that this kernel consists of, itself included,
        and that are not on disk; called only if no earlier kernel included this kernel.
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
        """Note the end of a kernel's compilation."""
        self._latest = self._now()

    @contextmanager
    def telling(self, tell: Callable[[str], None]) -> Iterator[None]:
        """Send messages elsewhere within the block."""
        before, self.tell = self.tell, tell
        try:
            yield
        finally:
            self.tell = before


def _about(seconds: float) -> str:
    """A time in words, rounded to its accuracy."""
    if seconds < 55.0:
        return f"about {max(5, 5 * round(seconds / 5.0))} s"
    minutes = round(seconds / 30.0) / 2.0
    return "about a minute" if minutes == 1.0 else f"about {minutes:g} minutes"


NOTICE = Notice()
"""The notice of this process, which has a single compiler."""
