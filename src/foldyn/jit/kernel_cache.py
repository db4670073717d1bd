"""Compiled functions on disk: a file for each function and its argument types.

Numba's own cache identifies a function only by the text of its file: it uses an old version after a
compiled function or a constant imported from another file has changed. With it, two processes that
write at once may exchange their kernels, and a damaged file causes a traceback. Here the file name
identifies the compiled version: its sources (`sources.digest`), its argument types, including all
fields of named tuples, and the processor. So a stored file equals what would be compiled now,
whichever process wrote it, and a checksum detects damage.

Kernels go to the first writable folder, in Numba's order: NUMBA_CACHE_DIR, `__pycache__` next to
the source, the user's cache folder; then, with a warning, a temporary folder. Because the files in
this temporary folder are loaded and run, only the user may have access to it.
"""

from __future__ import annotations

import atexit
import hashlib
import inspect
import os
import pickle
import shutil
import stat
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import cache, cached_property
from pathlib import Path
from typing import Any

from numba.core import config
from numba.core.caching import _Cache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps
from numba.core.sigutils import normalize_signature
from numba.misc.appdirs import AppDirs

from foldyn.errors import warn
from foldyn.jit.sources import Part, digest, made_from, read
from foldyn.notice import NOTICE
from foldyn.writing import remove_leftovers, write_bytes

REMEDY = "set NUMBA_CACHE_DIR to a folder that can be written"
OTHERS = 3  # number of older versions of a function to keep
_SEAL = hashlib.sha256().digest_size
_IMPORTED: dict[Part, list[Kept]] = {}  # functions, by the statements that define them


class Kept(_Cache):
    """The compiled versions of a function on disk, which Numba checks before it compiles."""

    def __init__(self, function: Callable[..., Any]) -> None:
        source = Path(inspect.getfile(function)).resolve()
        name = function.__qualname__.replace("<", "").replace(">", "")
        read(source)
        self._source = source, function.__qualname__.partition(".")[0]
        code = function.__code__
        self._code = code.co_code, code.co_names, [k for k in code.co_consts if _plain(k)]
        self._folder = folder_for(source.parent)
        self._stem = f"{source.stem}.{name}-"
        _IMPORTED.setdefault(self._source, []).append(self)
        self.enable()

    @cached_property
    def _version(self) -> str:
        return f"{self._stem}{digest(*self._source)}"

    @property
    def cache_path(self) -> str | None:
        """Folder of the files."""
        return None if self._folder is None else str(self._folder)

    def enable(self) -> None:
        """Enable loading and saving."""
        self._enabled = self._folder is not None

    def disable(self) -> None:
        """Disable loading and saving."""
        self._enabled = False

    def ready(self) -> bool:
        """Whether at least one version is on disk, for whichever arguments."""
        return self._folder is not None and any(self._folder.glob(f"{self._version}.*.nbc"))

    def missing(self) -> list[Kept]:
        """Compiled functions that this one consists of, if not on disk; may include itself."""
        made = (one for part in made_from(*self._source) for one in _IMPORTED.get(part, ()))
        return [one for one in made if not one.ready()]

    def flush(self) -> None:
        """Remove the current versions."""
        for path in self._folder.glob(f"{self._version}.*.nbc") if self._folder else ():
            path.unlink(missing_ok=True)

    def load_overload(self, sig: Any, target_context: Any) -> CompileResult | None:
        """Compiled function for a signature, if an undamaged file is on disk."""
        target_context.refresh()
        path = self._file(sig, target_context.codegen())
        data = None if path is None else _read(path)
        if data is None:  # Numba compiles it
            NOTICE.begin(self, self.missing)
            return None
        return CompileResult._rebuild(target_context, *data)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store a compiled function; if that fails, it is compiled again next time."""
        NOTICE.end()
        path = self._file(sig, data.codegen)
        if path is None or data.library.has_dynamic_globals:
            return
        try:
            content = dumps(data._reduce())
            path.parent.mkdir(parents=True, exist_ok=True)
            write_bytes(hashlib.sha256(content).digest() + content, path)
            self._remove_old()
            remove_leftovers(path.parent)
        except OSError as error:
            _warn(f"compiled kernels cannot be kept in {path.parent}: {error.strerror}")

    def _file(self, sig: Any, codegen: Any) -> Path | None:
        arguments = "; ".join(_spelled(kind) for kind in normalize_signature(sig)[0])
        if self._folder is None or not self._enabled or " at 0x" in arguments:
            return None  # addresses are different in another process
        key = repr((arguments, codegen.magic_tuple(), self._code)).encode()
        return self._folder / f"{self._version}.{hashlib.sha256(key).hexdigest()[:16]}.nbc"

    def _remove_old(self) -> None:
        """Remove compiled versions of earlier sources, except the last few."""
        assert self._folder is not None
        files: dict[str, list[Path]] = {}
        for path in self._folder.glob(f"{self._stem}*"):
            made_from = path.name[len(self._stem) :].split(".")[:1]
            files.setdefault("".join(made_from), []).append(path)
        with suppress(OSError):  # another process may have removed it
            by_age = sorted(files, key=lambda made: max(p.stat().st_mtime for p in files[made]))
            for path in (path for made_from in by_age[: -1 - OTHERS] for path in files[made_from]):
                path.unlink()


def _spelled(kind: Any) -> str:
    """A type in full: Numba's name of a named tuple lacks its fields."""
    if not hasattr(kind, "types"):
        return repr(kind)
    inside = [_spelled(of) for of in kind.types]
    if hasattr(kind, "fields"):
        inside = [f"{name}: {of}" for name, of in zip(kind.fields, inside, strict=True)]
    owner = getattr(kind, "instance_class", type(kind))
    return f"{owner.__module__}.{owner.__qualname__}({', '.join(inside)})"


def _plain(constant: Any) -> bool:
    return isinstance(constant, int | float | complex | bool)


def _read(path: Path) -> Any:
    """Content of a file; None if it is missing or damaged; damaged files are removed."""
    try:
        whole = path.read_bytes()
        if hashlib.sha256(whole[_SEAL:]).digest() == whole[:_SEAL]:
            return pickle.loads(whole[_SEAL:])
        path.unlink()
    except OSError:  # missing, or removed by another process
        pass
    return None


@cache
def folder_for(source: Path) -> Path | None:
    """Folder for the kernels of a source folder; None if none is writable."""
    named = str(getattr(config, "CACHE_DIR", ""))
    inside = f"{source.name}_{hashlib.sha1(os.fsencode(source)).hexdigest()[:16]}"
    if named:
        folder = Path(named).absolute() / inside
        if _writable(folder):
            return folder
        _warn(f"NUMBA_CACHE_DIR = {named!r} cannot be written: kernels are kept elsewhere")
    usual = [source / "__pycache__"]
    home = Path(AppDirs(appname="numba", appauthor=False).user_cache_dir)
    if home.is_absolute():  # otherwise the user has no home folder
        usual.append(home / inside)
    for folder in usual:
        if _writable(folder):
            return folder
    private = _private()
    if private is None or not _writable(private / inside):
        _warn("compiled kernels cannot be kept anywhere: each start compiles anew")
        return None
    _warn(
        "compiled kernels cannot be kept beside the package or in the home folder: they go to "
        f"{private}, which may not last"
    )
    return private / inside


@cache
def _warn(text: str) -> None:
    """Issue a warning with the remedy, once for each text."""
    warn(f"{text}; {REMEDY}", "tutorial.md#install")


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


@cache
def _private() -> Path | None:
    """Temporary folder that only this user can write to, or else one of this process alone."""
    user = os.getuid() if hasattr(os, "getuid") else "kernels"
    try:
        folder = Path(tempfile.gettempdir()) / f"foldyn-{user}"
        with suppress(FileExistsError):  # a file, or another process was faster
            folder.mkdir(mode=0o700)
        if _ours(folder):
            return folder
        folder = Path(tempfile.mkdtemp(prefix="foldyn-"))
    except OSError:
        return None
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def _ours(folder: Path) -> bool:
    """Whether a folder is not a link, belongs to the user, and is closed to all others."""
    status = folder.lstat()
    if not stat.S_ISDIR(status.st_mode) or not hasattr(os, "getuid"):
        return stat.S_ISDIR(status.st_mode)  # without getuid (Windows), each user has a private one
    return status.st_uid == os.getuid() and stat.S_IMODE(status.st_mode) & 0o077 == 0
