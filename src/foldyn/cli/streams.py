"""Output of a command, and its running time.

Standard output and error may be closed, full, or unable to encode some characters.
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
    """A stream that drops what it cannot write.

    Attributes
    ----------
    failure : OSError or None
        Why output was lost.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self.failure: OSError | None = None
        # for characters that the encoding lacks
        with suppress(AttributeError, OSError, ValueError):
            stream.reconfigure(errors="backslashreplace")  # type: ignore[attr-defined]

    def write(self, text: str) -> int:
        """Write, or drop the text."""
        try:
            return self._stream.write(text)
        except OSError as failure:
            return self._lose(failure, len(text))

    def flush(self) -> None:
        """Flush, or drop the buffer."""
        try:
            self._stream.flush()
        except OSError as failure:
            self._lose(failure, 0)

    def _lose(self, failure: OSError, size: int) -> int:
        """Discard the buffer and all further output."""
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
    with open(os.devnull, "w", encoding="utf-8") as nowhere:  # for a stream closed before
        out, err = Outlet(sys.stdout or nowhere), Outlet(sys.stderr or nowhere)
        sys.stdout, sys.stderr = out, err  # type: ignore[assignment]
        try:
            yield out
        finally:
            out.flush()
            err.flush()
            sys.stdout, sys.stderr = before


def _fill_closed() -> None:
    """Occupy the numbers of closed streams; a file opened with one would receive the output."""
    while True:
        place = os.open(os.devnull, os.O_RDWR)
        if place > 2:
            os.close(place)
            return


def speech(quiet: bool) -> Callable[[str], None]:
    """Return a function that prints a line at once, or nothing if quiet."""
    return (lambda text: None) if quiet else partial(print, flush=True)


def noticed(quiet: bool) -> AbstractContextManager[None]:
    """Print messages about kernels being compiled, unless quiet."""
    from foldyn.notice import NOTICE

    def tell(text: str) -> None:
        from tqdm import tqdm

        tqdm.write(text)  # above the progress bar, if any
        sys.stdout.flush()

    return NOTICE.telling(speech(True) if quiet else tell)


def progress_bar(quiet: bool, **options: Any) -> Any:
    """Return a tqdm progress bar, hidden if quiet or not on a terminal."""
    from tqdm import tqdm

    return tqdm(disable=quiet or not sys.stderr.isatty(), leave=False, **options)


@contextmanager
def noted_warnings(page_of: Path | None = None) -> Iterator[Told]:
    """Collect warnings and still show them.

    page_of : case file that gets a page. The model of a shipped case was chosen on purpose, so
    warnings about its accuracy appear only on the page.
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
    """Wall time and processor time (s) when a command began."""

    wall: float
    cpu: float

    @classmethod
    def now(cls) -> Clock:
        """Read both clocks."""
        return cls(time.perf_counter(), time.process_time())

    def spent(self) -> dict[str, float]:
        """Return the time (s) since the command began as `wall` and `cpu`."""
        return {name: b - a for name, a, b in zip(self._fields, self, self.now(), strict=True)}
