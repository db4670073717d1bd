"""Memory limits: input that is estimated to be too large for the machine is refused.

Estimates are right within a factor of about two. The bytes per item, and how they were measured,
are documented where the item is made.
"""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path

from foldyn.errors import InputError

MEBI, GIB = 2.0**20, 2.0**30
HALF = 0.5
"""Share of the memory that commands may use without --force."""
_LIMITS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")
_share: ContextVar[float] = ContextVar("share of the memory", default=1.0)


@contextmanager
def at_most(share: float) -> Iterator[None]:
    """Within the block, refuse input that needs more than this share of the memory."""
    before = _share.set(share)
    try:
        yield
    finally:
        _share.reset(before)


def share() -> float:
    """Share of the memory that may be used; see `at_most`."""
    return _share.get()


def allow(share: float) -> None:
    """Set the share for the rest of the process."""
    _share.set(share)


def memory() -> float:
    """Bytes of memory of the machine, or of its container or shell limit if smaller."""
    known = [_machine(), *map(_limit, _LIMITS)]
    if sys.platform != "win32":
        import resource

        soft = resource.getrlimit(resource.RLIMIT_AS)[0]
        known.append(math.inf if soft == resource.RLIM_INFINITY else float(soft))
    return min(known)


def check_memory(field: str, what: str, needed: float, remedy: str) -> None:
    """Refuse input that would not fit in memory.

    Parameters
    ----------
    field : str
        Field that makes the input large, by the name that users know.
    what : str
        What is too large, with its size: "a pattern of 1e+06 vertices".
    needed : float
        Bytes, estimated.
    remedy : str
        What to do.

    Raises
    ------
    InputError
        The input needs more than the memory, or more than the share that `at_most` allows.
    """
    there = memory()
    if needed <= _share.get() * there:
        return
    here = f"the {there / GIB:.3g} GiB of this machine"
    if needed <= there:
        part = "half" if _share.get() == HALF else f"the share {_share.get():.3g}"
        here, remedy = f"{part} of {here}", f"{remedy}, or continue with --force"
    raise InputError(
        f": {what} needs about {needed / GIB:.3g} GiB, more than {here}: {remedy}", field
    )


def _machine() -> float:
    with suppress(AttributeError, OSError, ValueError):
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    return math.inf


def _limit(file: str) -> float:
    """Limit of a container, in bytes."""
    with suppress(OSError, ValueError):  # the file does not exist, or contains "max"
        return float(Path(file).read_text())
    return math.inf
