"""Seals: a digest at the end of a file, of all bytes before it, which reveals damage."""

from __future__ import annotations

import hashlib
from pathlib import Path

_MARK = b"\nfoldyn sha256 "
_LENGTH = len(_MARK) + 64 + 1
_PIECE = 1 << 20


def seal(path: Path) -> None:
    """Append a seal to a file."""
    with path.open("rb+") as file:
        file.write(_MARK + hashlib.file_digest(file, "sha256").hexdigest().encode() + b"\n")


def sound(path: Path) -> bool | None:
    """Whether the seal of a file matches its content; None if it has no seal."""
    left = path.stat().st_size - _LENGTH
    if left < 0:
        return None
    digest = hashlib.sha256()
    with path.open("rb") as file:
        file.seek(left)
        found = file.read()
        if not found.startswith(_MARK):
            return None
        file.seek(0)
        while left > 0 and (piece := file.read(min(left, _PIECE))):
            digest.update(piece)
            left -= len(piece)
    return found == _MARK + digest.hexdigest().encode() + b"\n"
