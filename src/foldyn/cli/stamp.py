"""The stamp of a results folder: its owner, and which of its files belong to the last run."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from foldyn import __version__
from foldyn.input_files import file_digest
from foldyn.studies import shipped_cases
from foldyn.writing import write_bytes, write_text

NAME = ".foldyn.json"


@dataclass(frozen=True)
class Owner:
    """The command and source file that a results folder belongs to.

    Attributes
    ----------
    command : str
        The command that makes the results, "run" or "run --model shell".
    source : str
        The name of a shipped case, or the path of the file relative to the folder.
    digest : str
        Digest of the file's content.
    """

    command: str
    source: str
    digest: str = ""

    @classmethod
    def of(cls, command: str, file: Path, folder: Path) -> Owner:
        """Return the owner of a results folder for a file."""
        shipped = [name for name, path in shipped_cases().items() if path == file]
        digest = file_digest(file)
        with suppress(ValueError, OSError):  # on another drive, where no relative path exists
            file = Path(os.path.relpath(os.path.realpath(file), os.path.realpath(folder)))
        source = shipped[0] if shipped else file.as_posix()
        return cls(command, source, digest)

    def same(self, stamp: dict[str, Any]) -> bool:
        """Whether a stamp names this owner; the file's content may have changed."""
        return (stamp["command"], stamp["source"]) == (self.command, self.source)


def read(folder: Path) -> dict[str, Any] | None:
    """Read the stamp of a folder; None if missing or unreadable."""
    try:
        found = json.loads(raw(folder) or b"")
        texts = [found[key] for key in ("command", "source", "state")]
        files = [*found["results"], *found["outdated"]]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    sound = all(isinstance(text, str) for text in (*texts, *files))
    return found if sound and all(Path(name).name == name for name in files) else None


def raw(folder: Path) -> bytes | None:
    """Return the raw content of the stamp; None if there is none."""
    try:
        return (folder / NAME).read_bytes()
    except OSError:
        return None


def restore(folder: Path, content: bytes | None) -> None:
    """Restore an earlier stamp."""
    if content is None:
        (folder / NAME).unlink(missing_ok=True)
    else:
        write_bytes(folder / NAME, content)


def write(
    folder: Path, owner: Owner, state: str, results: Sequence[str], outdated: Sequence[str] = ()
) -> None:
    """Stamp a folder.

    Parameters
    ----------
    folder : Path
    owner : Owner
    state : {"running", "stopped", "complete"}
        "running" without a live process means that the run was cut off.
    results, outdated : sequence of str
        Files of this run, and files of an earlier run, which are removed once this run saves its
        first.
    """
    stamp = {"foldyn_version": __version__, **asdict(owner), "state": state}
    stamp |= {"results": list(results), "outdated": list(outdated)}
    write_text(folder / NAME, json.dumps(stamp, indent=1) + "\n")


def named(stamp: dict[str, Any], folder: Path) -> str:
    """Name the owner in a stamp as a user would type it."""
    source = stamp["source"]
    if source.startswith("..") or source.endswith(".toml"):
        source = os.path.normpath(folder / source)
    return f"foldyn {stamp['command']} {source}"
