"""Output of a command and the time it takes.

Standard output and error may be closed, full or short of letters.
"""

from __future__ import annotations

import os
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, TextIO

from foldyn.errors import OF_MODELS, Told


class Outlet:
    """A stream that loses what it cannot write.

    Attributes
    ----------
    failure : OSError or None
        Why something was lost.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self.failure: OSError | None = None
        with suppress(AttributeError, OSError, ValueError):  # letters that its encoding lacks
            stream.reconfigure(errors="backslashreplace")  # type: ignore[attr-defined]

    def write(self, text: str) -> int:
        """Write, or lose it."""
        try:
            return self._stream.write(text)
        except OSError as failure:
            return self._lose(failure, len(text))

    def flush(self) -> None:
        """Flush, or lose it."""
        try:
            self._stream.flush()
        except OSError as failure:
            self._lose(failure, 0)

    def _lose(self, failure: OSError, size: int) -> int:
        """Write nothing from now on; drop what waits in the buffer."""
        self.failure = failure
        with suppress(OSError, ValueError):
            place = os.open(os.devnull, os.O_WRONLY)
            os.dup2(place, self._stream.fileno())
            os.close(place)
        return size

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextmanager
def steady_streams() -> Iterator[Outlet]:
    """Make both streams reliable within the block; yields standard output."""
    _fill_closed()
    before = sys.stdout, sys.stderr
    with open(os.devnull, "w", encoding="utf-8") as nowhere:  # for one that was closed before
        out, err = Outlet(sys.stdout or nowhere), Outlet(sys.stderr or nowhere)
        sys.stdout, sys.stderr = out, err  # type: ignore[assignment]
        try:
            yield out
        finally:
            out.flush()
            err.flush()
            sys.stdout, sys.stderr = before


def _fill_closed() -> None:
    """Occupy the numbers of closed streams: output would go to any file that got one."""
    while True:
        place = os.open(os.devnull, os.O_RDWR)
        if place > 2:
            os.close(place)
            return


def speech(quiet: bool) -> Callable[[str], None]:
    """Return what prints a line at once, or nothing if the command is to be quiet."""
    return (lambda text: None) if quiet else partial(print, flush=True)


def noticed(quiet: bool) -> AbstractContextManager[None]:
    """Print what is told while kernels are compiled, unless the command is to be quiet."""
    from foldyn.notice import NOTICE

    def tell(text: str) -> None:
        from tqdm import tqdm

        tqdm.write(text)  # above a bar, if there is one
        sys.stdout.flush()

    return NOTICE.telling(speech(True) if quiet else tell)


def progress_bar(quiet: bool, **options: Any) -> Any:
    """Progress bar of tqdm, hidden if the command is to be quiet or nobody watches."""
    from tqdm import tqdm

    return tqdm(disable=quiet or not sys.stderr.isatty(), leave=False, **options)


@contextmanager
def noted_warnings(page_of: Path | None = None) -> Iterator[Told]:
    """Note warnings, which are shown all the same.

    page_of : case file that gets a page. A shipped one has its model on purpose: what that gets
        only roughly is said there alone.
    """
    from foldyn.studies import shipped_cases

    noted, show = Told(), warnings.showwarning
    unsaid = OF_MODELS if page_of in shipped_cases().values() else ()

    def both(message: Warning | str, category: type[Warning], *rest: Any) -> None:
        noted.add(str(message))
        if not issubclass(category, unsaid):
            show(message, category, *rest)

    with warnings.catch_warnings():
        warnings.showwarning = both
        yield noted


class Clock(NamedTuple):
    """When a command began, by the wall and by the processor (s)."""

    wall: float
    cpu: float

    @classmethod
    def now(cls) -> Clock:
        """Both clocks at this moment."""
        return cls(time.perf_counter(), time.process_time())

    def spent(self) -> dict[str, float]:
        """Time (s) since then: `wall` and `cpu`."""
        return {name: b - a for name, a, b in zip(self._fields, self, self.now(), strict=True)}
