"""Results kept in files, so that work that was cut off goes on where it stopped.

A file holds a stamp of all that its result depends on, a digest of the program's sources among it
(`foldyn.program`). A result of other inputs or of another program counts as not there, and so does
a damaged file: it is computed again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from foldyn.errors import warn

Result = TypeVar("Result")


@dataclass(frozen=True)
class Store(Generic[Result]):
    """How results of one kind are kept.

    Parameters
    ----------
    read : callable
        Gives the stamp in a file and its result, or raises anything where the file is damaged.
    write : callable
        Writes a file, whole or not at all, with a stamp and a result.
    warns : bool
        Whether a damaged file is warned of.
    """

    read: Callable[[Path], tuple[str, Result]]
    write: Callable[[Path, str, Result], None]
    warns: bool = True

    def find(self, file: Path, inputs: Any) -> Result | None:
        """Result for some inputs (what JSON can hold), or None."""
        if not file.is_file():
            return None
        try:
            stamp, result = self.read(file)
        except Exception:  # what readers raise on damaged files is of any kind
            if self.warns:
                warn_of_damage(file)
            return None
        return result if stamp == stamp_of(inputs) else None

    def keep(self, file: Path, inputs: Any, result: Result) -> None:
        """Keep the result for some inputs."""
        self.write(file, stamp_of(inputs), result)


def stamp_of(inputs: Any) -> str:
    """Inputs of a result as one line of text."""
    return json.dumps(inputs, sort_keys=True)


def name_of(inputs: Any) -> str:
    """Name for a file of these inputs, where there are too many for names of their own."""
    return hashlib.sha256(stamp_of(inputs).encode()).hexdigest()[:32]


def warn_of_damage(file: Path, then: str = "it is computed again") -> None:
    """Tell that a file cannot be used, and what happens then."""
    text = f"{file}: is damaged, missing, or of another kind; {then}"
    warn(text, "results.md#damaged-files")
