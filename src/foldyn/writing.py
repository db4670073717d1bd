"""Files that appear only when complete, even if the writing process is killed."""

from __future__ import annotations

import json
import math
import os
import re
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from foldyn.errors import InputError
from foldyn.input_files import path_of

_LEFT = re.compile(r"\..+\.(\d+)\.tmp(\.\w+)?")


@contextmanager
def whole(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Path of a temporary file that replaces `path` if the block succeeds.

    Until then `path` is unchanged; after an exception the temporary file is removed. The content is
    on disk before the file appears at `path`. Links are followed.
    """
    target = Path(os.path.realpath(path))
    part = _beside(target, target.suffix)
    try:
        yield part
        with part.open("r+b") as written:
            os.fsync(written.fileno())
        os.replace(part, target)
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def target_of(path: Any) -> Path:
    """Path of a file to be written; refuse one in a folder that does not exist."""
    path = path_of(path)
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist; make it first")
    return path


def write_bytes(content: bytes, path: str | os.PathLike[str]) -> None:
    """Write a file atomically."""
    with whole(path) as part:
        part.write_bytes(content)


def write_text(text: str, path: str | os.PathLike[str]) -> None:
    r"""Write a UTF-8 text file atomically.

    Characters that UTF-8 cannot encode, such as raw bytes of file names, are escaped, as in
    "\udcff".
    """
    write_bytes(text.encode("utf-8", "backslashreplace"), path)


def plain(value: Any) -> Any:
    """Value for JSON: arrays become lists, and non-finite numbers null."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):  # numbers and arrays of NumPy
        return plain(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_json(value: Any, path: str | os.PathLike[str]) -> None:
    """Write a value as a JSON file; see `plain`."""
    write_text(json.dumps(plain(value), indent=2, allow_nan=False) + "\n", path)


@contextmanager
def scratch(folder: Path, name: str) -> Iterator[Path]:
    """A temporary folder inside another, removed at the end of the block."""
    made = _beside(folder / name)
    made.mkdir()
    try:
        yield made
    finally:
        shutil.rmtree(made, ignore_errors=True)


def made_folder(folder: str | os.PathLike[str]) -> Path:
    """A folder to write into: created if missing, and cleared of partial files.

    Raises
    ------
    InputError
        The path is a file, or the folder cannot be created.
    """
    path = Path(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        why = "is a file" if path.is_file() else f"cannot be made ({error.strerror})"
        raise InputError(f" = {str(path)!r}: {why}; give the path of a folder", "folder") from error
    remove_leftovers(path)
    return path


def remove_leftovers(*folders: Path) -> None:
    """Remove temporary files that dead processes have left in folders."""
    for folder in folders:
        with suppress(OSError):
            for path in list(folder.iterdir()):
                found = _LEFT.fullmatch(path.name)
                if found and not _alive(int(found[1])):
                    _remove(path)


def _beside(target: Path, suffix: str = "") -> Path:
    """Name of a temporary file, with the process id; the suffix tells writers the format.

    Random letters distinguish processes on other machines that share the folder.
    """
    letters = secrets.token_hex(4)
    return target.with_name(f".{target.name[:40]}.{letters}.{os.getpid()}.tmp{suffix}")


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
        return
    with suppress(OSError):
        path.unlink()


def _alive(process: int) -> bool:
    """Whether a process runs; if unknown, False, as open files then cannot be removed."""
    if os.name != "posix":
        return False
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return True
