"""Locks that let one process at a time write; the system releases a lock when its process ends."""

from __future__ import annotations

import os
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from foldyn.errors import warn


class LockedError(Exception):
    """Another process has the lock; the message names that process."""


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold a lock.

    Parameters
    ----------
    path : Path
        Lock file, which exists while the lock is held; its folder must exist.

    Raises
    ------
    LockedError
        Another process holds the lock.
    OSError
        The lock file cannot be made.
    """
    held = _take(path)
    try:
        with suppress(OSError):
            os.truncate(held, 0)
            here = f"process {os.getpid()} on {socket.gethostname()}"
            os.write(held, f"{here}, since {time.strftime('%Y-%m-%d %H:%M:%S')}".encode())
        yield
    finally:
        with suppress(OSError):
            path.unlink(missing_ok=True)
        os.close(held)


def _take(path: Path) -> int:
    while True:
        opened = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            _lock(opened)
            if _is(path, opened):  # the previous holder may have just removed the file
                return opened
            os.close(opened)
        except BlockingIOError:
            said = os.read(opened, 200).decode("utf-8", "replace") or "another process"
            os.close(opened)
            raise LockedError(said) from None
        except OSError as error:  # the file system has no locks
            warn(
                f"{path}: cannot be locked ({error.strerror}): see that no other process "
                "writes there",
                "command-line.md#folders-of-results",
            )
            return opened


def _lock(opened: int) -> None:
    """Lock an open file; BlockingIOError if another process holds the lock."""
    if sys.platform == "win32":
        import msvcrt

        os.lseek(opened, 1 << 20, os.SEEK_SET)  # locked bytes cannot be read
        try:
            msvcrt.locking(opened, msvcrt.LK_NBLCK, 1)
        except PermissionError:
            raise BlockingIOError from None
        finally:
            os.lseek(opened, 0, os.SEEK_SET)
    else:
        import fcntl

        fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _is(path: Path, opened: int) -> bool:
    with suppress(FileNotFoundError):
        return os.path.samestat(os.stat(path), os.fstat(opened))
    return False
