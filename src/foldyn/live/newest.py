"""A single worker thread that answers only the newest request."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextvars import copy_context
from typing import Generic, TypeVar

Wish = TypeVar("Wish")
Answer = TypeVar("Answer")


class Newest(Generic[Wish, Answer]):
    """A thread that computes the newest request.

    There is no queue: a newer request replaces one that has not begun, and discards the result of
    one being computed.

    Parameters
    ----------
    compute : callable
        Returns the answer to a request; it runs only in this thread and raises nothing.
    """

    def __init__(self, compute: Callable[[Wish], Answer]) -> None:
        self._compute = compute
        self._changed = threading.Condition()
        self._count = 0
        self._waiting: tuple[int, Wish] | None = None
        self._ready: tuple[int, Answer] | None = None
        run = copy_context().run
        threading.Thread(target=run, args=(self._work,), name="newest wish", daemon=True).start()

    def answer(self, wish: Wish) -> Answer | None:
        """Wait for the answer to a request; None as soon as a newer one arrives."""
        with self._changed:
            self._count += 1
            mine = self._count
            self._waiting = mine, wish
            self._changed.notify_all()
            self._changed.wait_for(
                lambda: self._count > mine or (self._ready is not None and self._ready[0] == mine)
            )
            ready = self._ready
            return None if self._count > mine or ready is None else ready[1]

    def _work(self) -> None:
        while True:
            with self._changed:
                while self._waiting is None:
                    self._changed.wait()
                (number, wish), self._waiting = self._waiting, None
            answer = self._compute(wish)
            with self._changed:
                self._ready = number, answer
                self._changed.notify_all()
