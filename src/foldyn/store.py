"""Results stored in files, so that interrupted work can continue.

A file holds a stamp of everything on which its result depends, including a digest of the program's
sources. Files that are damaged, or hold results of other inputs or of another program, are ignored,
and the results are computed again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Generic, TypeVar

from foldyn.errors import warn

Result = TypeVar("Result")


COMPUTING = (
    "jit", "patterns", "materials", "mechanics", "algebra", "structures", "shells", "cases",
    "statics", "dynamics", "linear", "signals",
)  # fmt: skip
"""Folders of the package whose changes outdate stored results."""


@cache
def program(*more: str) -> str:
    """Digest of the program, such as "1f0c6a2b9d3e4f58".

    Parameters
    ----------
    *more : str
        Further files and folders of the package on which a result depends.
    """
    return digest(Path(__file__).parent, *more)


def digest(package: Path, *more: str) -> str:
    """Digest of those sources of a package that compute results."""
    sources = [path for part in (*COMPUTING, *more) for path in _sources(package / part)]
    found = hashlib.sha256()
    for path in sorted(sources):
        found.update(path.relative_to(package).as_posix().encode())
        found.update(path.read_bytes())
    return found.hexdigest()[:16]


def _sources(part: Path) -> list[Path]:
    inside = [path for path in part.rglob("*") if path.suffix in (".py", ".toml")]
    return [part] if part.is_file() else inside


@dataclass(frozen=True)
class Store(Generic[Result]):
    """How results of one kind are stored.

    Parameters
    ----------
    read : callable
        Returns the stamp and the result in a file, or raises any exception if the file is damaged.
    write : callable
        Writes a stamp and a result to a file, atomically.
    warns : bool
        Whether to warn of a damaged file.
    """

    read: Callable[[Path], tuple[str, Result]]
    write: Callable[[Path, str, Result], None]
    warns: bool = True

    def find(self, file: Path, inputs: Any) -> Result | None:
        """Stored result for some inputs (JSON-serializable), or None."""
        if not file.is_file():
            return None
        try:
            stamp, result = self.read(file)
        except Exception:  # readers raise any kind of exception on damaged files
            if self.warns:
                warn_of_damage(file)
            return None
        return result if stamp == stamp_of(inputs) else None

    def keep(self, file: Path, inputs: Any, result: Result) -> None:
        """Store the result for some inputs."""
        self.write(file, stamp_of(inputs), result)


def stamp_of(inputs: Any) -> str:
    """Inputs of a result as one line of JSON."""
    return json.dumps(inputs, sort_keys=True)


def name_of(inputs: Any) -> str:
    """File name derived from these inputs."""
    return hashlib.sha256(stamp_of(inputs).encode()).hexdigest()[:32]


def warn_of_damage(file: Path, then: str = "it is computed again") -> None:
    """Warn that a file cannot be used, and what happens instead."""
    warn(f"{file}: is damaged, missing, or of another kind; {then}", "results.md#damaged-files")
