"""Pattern files: the registry of formats, and reading and writing by extension."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from foldyn.errors import InputError, within
from foldyn.formats import fold
from foldyn.input_files import read_text
from foldyn.patterns import Pattern
from foldyn.writing import write_bytes

MOST = 32
"""Size of a pattern file (MiB)."""


@dataclass(frozen=True)
class Format:
    """A text format for patterns.

    Reading and writing work on text: opening, decoding and saving files, and naming the file
    in messages, is done once for all formats.

    Parameters
    ----------
    name : str
        Name of the format.
    extensions : tuple of str
        File extensions, lower case with the dot.
    read : callable or None
        From the text of a file to a `Pattern`; raises `InputError` naming the field.
        None: the format is written only.
    write : callable or None
        From a `Pattern` to the text of a file. None: the format is read only.
    """

    name: str
    extensions: tuple[str, ...]
    read: Callable[[str], Pattern] | None = None
    write: Callable[[Pattern], str] | None = None


_FORMATS = (Format("FOLD", (".fold",), read=fold.read, write=fold.write),)

FORMATS: dict[str, Format] = {end: fmt for fmt in _FORMATS for end in fmt.extensions}
"""The format of each file extension."""


def read_pattern(path: str | os.PathLike[str]) -> Pattern:
    """Read a pattern from a file; its extension determines the format.

    Parameters
    ----------
    path : path-like
        The file, for example "crane.fold"; `FORMATS` lists the extensions.

    Returns
    -------
    Pattern
        With coordinates in meters.

    Raises
    ------
    InputError
        No such file, an unknown extension, or content that is not a sound pattern; the message
        names the file and the field.
    """
    file, fmt = _file_and_format(path)
    if fmt.read is None:
        raise InputError(f"{file}: {fmt.name} files can be written but not read.")
    text = read_text(file, f"a {fmt.name} file", MOST, "leave out all but the pattern")
    with within("", file):
        return fmt.read(text)


def write_pattern(path: str | os.PathLike[str], pattern: Pattern) -> None:
    """Write a pattern to a file; its extension determines the format.

    The whole text is made first and the file put in place in one step, so that a failure
    leaves what was there before.

    Parameters
    ----------
    path : path-like
        The file to make or to replace; its directory must exist.
    pattern : Pattern
        What to write.

    Raises
    ------
    InputError
        An unknown extension (nothing is touched then), or the file cannot be written.
    """
    file, fmt = _file_and_format(path)
    if fmt.write is None:
        raise InputError(f"{file}: {fmt.name} files can be read but not written.")
    if not isinstance(pattern, Pattern):
        raise InputError(f"pattern = {pattern!r}: give a Pattern to write.")
    content = fmt.write(pattern).encode()
    try:
        write_bytes(file, content)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"{file}: cannot be written: {reason}; check that its directory exists and "
            "may be written to."
        ) from None


def _file_and_format(path: Any) -> tuple[Path, Format]:
    try:
        file = Path(path)
    except TypeError:
        raise InputError(f"path = {path!r}: give the path of a file.") from None
    if os.path.isdir(file):
        raise InputError(f"{file}: is a directory; name a pattern file in it.")
    fmt = FORMATS.get(file.suffix.lower())
    if fmt is None:
        has = f"has the unknown extension {file.suffix!r}" if file.suffix else "has no extension"
        raise InputError(f"{file}: {has}; known ones are {', '.join(sorted(FORMATS))}.")
    return file, fmt
