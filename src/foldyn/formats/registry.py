"""The registry of pattern formats: one line for each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from foldyn.formats import fold
from foldyn.patterns import Pattern


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
