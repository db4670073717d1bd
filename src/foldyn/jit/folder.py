"""Where compiled kernels are kept: the first folder that can be written.

As Numba's own order: what NUMBA_CACHE_DIR says, `__pycache__` beside the source, the user's cache
folder; then, with a warning, a folder for temporary files. What is kept there is loaded and run, so
that one is the user's alone.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import stat
import tempfile
import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from numba.core import config
from numba.misc.appdirs import AppDirs

from foldyn.errors import FoldynWarning

REMEDY = "set NUMBA_CACHE_DIR to a folder that can be written"


@cache
def folder_for(source: Path) -> Path | None:
    """Folder for the kernels of a folder of sources; None where nothing can be written."""
    named = str(getattr(config, "CACHE_DIR", ""))
    inside = f"{source.name}_{hashlib.sha1(os.fsencode(source)).hexdigest()[:16]}"
    if named:
        folder = Path(named).absolute() / inside
        if _writable(folder):
            return folder
        tell(f"NUMBA_CACHE_DIR = {named!r} cannot be written: kernels are kept elsewhere; {REMEDY}")
    for folder in _usual(source, inside):
        if _writable(folder):
            return folder
    private = _private()
    if private is None or not _writable(private / inside):
        tell(f"compiled kernels cannot be kept anywhere: each start compiles anew; {REMEDY}")
        return None
    tell(
        "compiled kernels cannot be kept beside the package or in the home folder: they go to "
        f"{private}, which may not last; {REMEDY}"
    )
    return private / inside


@cache
def tell(text: str) -> None:
    """Warn, once."""
    warnings.warn(text, FoldynWarning, stacklevel=2)


def _usual(source: Path, inside: str) -> Iterator[Path]:
    yield source / "__pycache__"
    home = Path(AppDirs(appname="numba", appauthor=False).user_cache_dir)
    if home.is_absolute():  # else there is no home
        yield home / inside


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


@cache
def _private() -> Path | None:
    """Folder for temporary files that nobody else can write."""
    user = os.getuid() if hasattr(os, "getuid") else "kernels"
    try:
        folder = Path(tempfile.gettempdir()) / f"foldyn-{user}"
        folder.mkdir(mode=0o700, exist_ok=True)
    except FileExistsError:  # a file
        return _passing()
    except OSError:
        return None
    return folder if _ours(folder) else _passing()


def _passing() -> Path | None:
    """Folder of this process."""
    try:
        folder = tempfile.mkdtemp(prefix="foldyn-")
    except OSError:
        return None
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def _ours(folder: Path) -> bool:
    """Whether a folder is no link, the user's, and closed to all others."""
    if not hasattr(os, "getuid"):  # folders for temporary files are each user's own
        return True
    found = folder.lstat()
    private = stat.S_IMODE(found.st_mode) & 0o077 == 0
    return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and private
