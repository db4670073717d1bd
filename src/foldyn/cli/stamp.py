"""The stamp of a results folder: what it belongs to, and which of its files are of the last run."""

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
    """What a folder of results belongs to.

    Attributes
    ----------
    command : str
        That makes them, "run" or "run --model shell".
    source : str
        Of what: the name of a shipped case, or a file as it is found from the folder.
    digest : str
        Of the file's content.
    """

    command: str
    source: str
    digest: str = ""

    @classmethod
    def of(cls, command: str, file: Path, folder: Path) -> Owner:
        """Owner of a folder of results of a file."""
        shipped = [name for name, path in shipped_cases().items() if path == file]
        digest = file_digest(file)
        with suppress(ValueError, OSError):  # on another drive; where there is no such place
            file = Path(os.path.relpath(os.path.realpath(file), os.path.realpath(folder)))
        source = shipped[0] if shipped else file.as_posix()
        return cls(command, source, digest)

    def same(self, stamp: dict[str, Any]) -> bool:
        """Whether a stamp is of this owner; the content of its file may have changed."""
        return (stamp["command"], stamp["source"]) == (self.command, self.source)


def read(folder: Path) -> dict[str, Any] | None:
    """Stamp of a folder; None if it has none, or an unreadable one."""
    try:
        found = json.loads(raw(folder) or b"")
        texts = [found[key] for key in ("command", "source", "state")]
        files = [*found["results"], *found["outdated"]]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    sound = all(isinstance(text, str) for text in (*texts, *files))
    return found if sound and all(Path(name).name == name for name in files) else None


def raw(folder: Path) -> bytes | None:
    """Content of the stamp; None if there is none."""
    try:
        return (folder / NAME).read_bytes()
    except OSError:
        return None


def restore(folder: Path, content: bytes | None) -> None:
    """Put back a stamp as it was."""
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
        A run that is not there any more and still "running" was cut off.
    results, outdated : sequence of str
        Files of this run, and of one before, which go when the first of this one is there.
    """
    stamp = {"foldyn_version": __version__, **asdict(owner), "state": state}
    stamp |= {"results": list(results), "outdated": list(outdated)}
    write_text(folder / NAME, json.dumps(stamp, indent=1) + "\n")


def named(stamp: dict[str, Any], folder: Path) -> str:
    """What a stamp is of, as a person would type it."""
    source = stamp["source"]
    if source.startswith("..") or source.endswith(".toml"):
        source = os.path.normpath(folder / source)
    return f"foldyn {stamp['command']} {source}"
