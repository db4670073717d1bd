"""Imports without the collection of garbage."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def lasting() -> Iterator[None]:
    """Import what lasts as long as the process: nobody looks for garbage in it, then or later.

    Modules make some hundred thousand objects, and the collector would look through all of them
    again and again: a fifth of the time of a short run. Only the first import is treated so; what
    a process that has worked before may leave as garbage is not kept.
    """
    if not gc.isenabled() or "foldyn.analyses" in sys.modules:
        yield
        return
    gc.disable()
    try:
        yield
        gc.freeze()
    finally:
        gc.enable()
