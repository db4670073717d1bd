"""Signals that end a run: Ctrl-C, and the signals of batch systems and closed terminals.

Each raises KeyboardInterrupt, and the run keeps what it has computed. A signal during a save waits
until the save is done; a second Ctrl-C does not wait.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

ENDS = ("SIGINT", "SIGTERM", "SIGHUP")
HEEDED = [getattr(signal, name) for name in ENDS if hasattr(signal, name)]


class Endings:
    """The signals that were received, and how to react to further ones."""

    def __init__(self) -> None:
        self.first: int | None = None
        self._saving = False
        self._due = False

    @property
    def status(self) -> int:
        """Exit status of a process that a signal ended: 128 plus the signal's number."""
        return 128 + (self.first or signal.SIGINT)

    @property
    def by_hand(self) -> bool:
        """Whether the signal was Ctrl-C and not one that ends a job."""
        return self.first in (None, signal.SIGINT)

    @contextmanager
    def heeded(self) -> Iterator[None]:
        """Handle signals within the block; signals ignored before, as under nohup, stay ignored."""
        self.first, self._due = None, False
        before = {}
        if threading.current_thread() is threading.main_thread():
            before = {
                one: signal.signal(one, self._receive)
                for one in HEEDED
                if signal.getsignal(one) not in (signal.SIG_IGN, None)
            }
        try:
            yield
        finally:
            for one, handler in before.items():
                signal.signal(one, handler)
            if self.first is not None:
                # CPython sets a flag when KeyboardInterrupt ends code run from a string, as
                # dataclasses and named tuples do, and `python -m` then ends by SIGINT even if the
                # exception was caught: our exit status is lost. The next string that runs to its
                # end clears the flag.
                eval("None")

    @contextmanager
    def saving(self) -> Iterator[None]:
        """Delay the first signal until the end of the block."""
        self._saving = True
        try:
            yield
        finally:
            self._saving = False
            if self._due:
                self._due = False
                raise KeyboardInterrupt

    def _receive(self, number: int, _: FrameType | None) -> None:
        again, self.first = self.first is not None, self.first or number
        if again and number != signal.SIGINT:  # some systems signal the process and its group
            return
        if self._saving and not again:
            self._due = True
            return
        self._due = False
        raise KeyboardInterrupt


ENDINGS = Endings()
"""The signals of this process."""
