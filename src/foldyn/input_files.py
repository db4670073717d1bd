"""Safe reading of external files, whatever their kind, size or depth of nesting.

Every message says what is wrong and what to do; the caller adds the location in front.
"""

from __future__ import annotations

import codecs
import hashlib
import json
import os
import re
import stat
import tomllib
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

from foldyn.errors import InputError
from foldyn.values import show

DEEPEST = 50
"""Largest number of levels of nested tables and lists in a TOML or JSON text."""

MEBI = 2**20
_DEEP_KEY = re.compile(rf"""(?<![\w"'-])(?:[\w"'-]++[ \t]*+\.[ \t]*+){{{DEEPEST},}}""")


def read_text(path: str | os.PathLike[str], what: str, most: int, thin: str) -> str:
    """Text of a UTF-8 file, with or without a byte order mark.

    Parameters
    ----------
    path : path
        A file; links are followed.
    what : str
        Expected kind of file for messages, such as "a CSV file".
    most : int
        Largest accepted size (MiB).
    thin : str
        Remedy for larger files, for messages.

    Raises
    ------
    InputError
        The file does not exist, is a folder, pipe or device, is too large, or is not text.
    """
    path = check_file(path, what)
    try:
        with path.open("rb") as file:
            content = file.read(most * MEBI + 1)
        codecs.getincrementaldecoder("utf-8")().decode(content[:MEBI])
        if len(content) > most * MEBI:
            raise InputError(f"{path}: is larger than {most} MiB; {thin}")
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not a text file in UTF-8; give {what}") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None


def path_of(path: Any, name: str = "path") -> Path:
    """Path of a file or folder, from a string or a path-like object."""
    try:
        return Path(path)
    except TypeError:
        raise InputError(f" = {show(path)}: give the path of a file", name) from None


def check_file(path: str | os.PathLike[str], what: str) -> Path:
    """Path of an existing regular file; links are followed.

    Raises
    ------
    InputError
        The file does not exist, or is a folder, a pipe or a device.
    """
    path = path_of(path)
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file") from None
    except (OSError, ValueError) as error:  # the path does not exist, or the name is invalid
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{path}: cannot be read: {reason}") from None
    if stat.S_ISDIR(mode):
        raise InputError(f"{path}: is a folder; give {what}")
    if not stat.S_ISREG(mode):  # reading a pipe or a device might never end
        raise InputError(
            f"{path}: is a pipe or a device, not a file; save its content, and give {what}"
        )
    return path


def file_digest(path: Path) -> str:
    """Digest of the content of a file, such as "1f0c6a2b9d3e4f58"."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:16]


def from_toml(text: str) -> dict[str, Any]:
    """Tables of a TOML text.

    Raises
    ------
    InputError
        The text is not TOML, or is nested deeper than any supported file. The message begins with
        "is not".
    """
    deep = _DEEP_KEY.search(text)
    if deep:  # tomllib would take minutes
        line = text.count("\n", 0, deep.start()) + 1
        raise InputError(f"is not valid TOML: a key of more than {DEEPEST} parts (at line {line})")
    try:
        return _shallow(tomllib.loads(text))
    except (ValueError, RecursionError) as error:
        raise InputError(f"is not valid TOML: {_why(error)}") from None


def from_json(text: str, repeated: list[str] | None = None) -> Any:
    """Value of a JSON text.

    Parameters
    ----------
    repeated : list of str, optional
        Receives keys that occur more than once in an object; the last value counts.

    Raises
    ------
    InputError
        The text is not JSON, or is nested deeper than any supported file. The message begins with
        "is not".
    """
    try:
        return _shallow(json.loads(text, object_pairs_hook=partial(_object, repeated)))
    except (ValueError, RecursionError) as error:
        raise InputError(f"is not valid JSON: {_why(error)}") from None


def _object(repeated: list[str] | None, pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if repeated is not None and len(found) < len(pairs):
        repeated += [key for key, times in Counter(key for key, _ in pairs).items() if times > 1]
    return found


def _why(error: Exception) -> str:
    too_deep = isinstance(error, RecursionError)
    return f"nested deeper than {DEEPEST} levels" if too_deep else str(error)


def _shallow(value: Any) -> Any:
    """Return `value` unless it is too deep for recursive functions."""
    level = [value]
    for _ in range(DEEPEST + 1):
        deeper = [item for item in level if isinstance(item, (dict, list))]
        parts = (item.values() if isinstance(item, dict) else item for item in deeper)
        level = [inner for part in parts for inner in part]
        if not level:
            return value
    raise RecursionError
