"""The results folder: it is checked before a run, locked by the run, stamped and written to."""

from __future__ import annotations

import json
import os
import re
import shutil
import tempfile
from argparse import Namespace
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from foldyn import __version__
from foldyn.cli.signals import ENDINGS
from foldyn.cli.streams import speech
from foldyn.errors import ComputationError, FoldynError, InputError, Told
from foldyn.input_files import file_digest
from foldyn.lock import LockedError, locked
from foldyn.plots import FIGURES
from foldyn.studies import shipped_cases
from foldyn.writing import remove_leftovers, write_bytes, write_text

LOCK, PAGE = ".foldyn.lock", "report.html"
_RESULT = re.compile(r"result(-\w+)?\.nc")


STAMP = ".foldyn.json"


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
        with suppress(ValueError, OSError):  # no relative path leads to another drive
            file = Path(os.path.relpath(os.path.realpath(file), os.path.realpath(folder)))
        return cls(command, shipped[0] if shipped else file.as_posix(), digest)

    def same(self, stamp: dict[str, Any]) -> bool:
        """Whether a stamp names this owner; the file's content may have changed."""
        return (stamp["command"], stamp["source"]) == (self.command, self.source)


def read_stamp(folder: Path) -> dict[str, Any] | None:
    """Read the stamp of a folder; None if missing or unreadable."""
    try:
        found = json.loads(raw_stamp(folder) or b"")
        texts = [found[key] for key in ("command", "source", "state")]
        files = [*found["results"], *found["outdated"]]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    sound = all(isinstance(text, str) for text in (*texts, *files))
    return found if sound and all(Path(name).name == name for name in files) else None


def raw_stamp(folder: Path) -> bytes | None:
    """Return the raw content of the stamp; None if there is none."""
    try:
        return (folder / STAMP).read_bytes()
    except OSError:
        return None


def named_owner(stamp: dict[str, Any], folder: Path) -> str:
    """Return the owner named in a stamp, in the words a user would type."""
    source = stamp["source"]
    if source.startswith("..") or source.endswith(".toml"):
        source = os.path.normpath(folder / source)
    return f"foldyn {stamp['command']} {source}"


def check_folder(folder: Path, out: str | None, names: Sequence[str]) -> None:
    """Refuse a results folder that cannot be written; test by writing, and leave nothing behind."""
    with _made(folder, out, names):
        pass


@contextmanager
def _made(folder: Path, out: str | None, names: Sequence[str]) -> Iterator[None]:
    """Make a folder and check that it is writable; remove it again if it stays empty."""
    if out == "":
        raise InputError("--out: is empty; name a folder")
    made: list[Path] = []
    try:
        try:
            for part in (*reversed(folder.parents), folder):
                if not part.exists():
                    part.mkdir(exist_ok=True)
                    made.append(part)
            _check(folder, out, names)
        except (OSError, ValueError) as error:
            if isinstance(error, InputError):
                raise
            why = getattr(error, "strerror", None) or error
            raise InputError(
                f"{_place(folder, out)}: cannot be written ({why}); name another folder"
            ) from None
        yield
    finally:
        with suppress(OSError):
            for part in reversed(made):
                part.rmdir()


def _check(folder: Path, out: str | None, names: Sequence[str]) -> None:
    if not folder.is_dir():
        raise InputError(f"{_place(folder, out)}: is a file; name a folder")
    for name in names:
        if (folder / name).is_dir():
            raise InputError(
                f"{_place(folder, out)}: {folder / name} is a folder where a file is to be "
                "written; name another folder"
            )
    with tempfile.TemporaryFile(dir=folder):
        pass


def _place(folder: Path, out: str | None) -> str:
    return f"--out {folder}" if out is not None else f"results folder {folder}"


class Results:
    """Results of one run, in a folder that the run has locked.

    Attributes
    ----------
    folder : Path
    kept : list of str
        Paths of the saved files.
    resumable : bool
        Whether the same command can resume from this folder.
    """

    def __init__(self, folder: Path, owner: Owner, drawn: Sequence[str], old: list[str]) -> None:
        self.folder, self.owner, self.drawn = folder, owner, drawn
        self.kept: list[str] = []
        self.resumable = False
        self._old, self._new = old, list[str]()
        self._before = raw_stamp(folder)
        self._begun = self._cleared = False

    def begin(self, name: str) -> None:
        """Record a folder that collects results one by one, from which the same command resumes."""
        self.resumable = True
        self.kept.append(str(self.folder / name))
        self._new.append(name)
        self._stamp("running")

    def keep(self, name: str, write: Callable[[Path], None]) -> None:
        """Save a file; the first one removes all files of an earlier run.

        Raises
        ------
        ComputationError
            The file cannot be saved in this folder; it is saved elsewhere if possible.
        """
        file = self.folder / name
        with ENDINGS.saving():
            try:
                self._stamp("running")  # from here on no old file passes for a new one
                write(file)
            except (OSError, InputError) as error:  # the folder has changed since it was checked
                saved, failure = rescued(file, write, error)
                self.kept.append(saved)
                raise failure from None
            self.kept.append(str(file))
            self._new.append(name)
            self.clear()
            with suppress(OSError):
                self._stamp("running")

    def clear(self) -> None:
        """Remove the files and figures of an earlier run, which would contradict this one."""
        if self._cleared:
            return
        self._cleared = True
        drawn = [path for pattern in self.drawn for path in self.folder.glob(pattern)]
        for path in (*drawn, *(self.folder / name for name in self._old if name not in self._new)):
            if not path.is_dir():
                path.unlink(missing_ok=True)
        self._old = []

    def end(self, state: str) -> None:
        """Write the final stamp, or restore the old one if nothing was written."""
        with suppress(OSError):
            if self._new:
                self._stamp(state)
            elif self._begun and self._before is not None:
                write_bytes(self._before, self.folder / STAMP)
            elif self._begun:
                (self.folder / STAMP).unlink(missing_ok=True)

    def summary(self) -> str:
        """List what was kept, for the end of a message."""
        if not self.kept:
            return ""
        further = "; the same command continues from there" if self.resumable else ""
        return f"\nfoldyn: kept what was computed: {', '.join(self.kept)}{further}"

    def _stamp(self, state: str) -> None:
        stamp = {"foldyn_version": __version__, **asdict(self.owner), "state": state}
        stamp |= {"results": self._new, "outdated": self._old}
        write_text(json.dumps(stamp, indent=1) + "\n", self.folder / STAMP)
        self._begun = True


def rescued(
    file: Path, write: Callable[[Path], None], failure: BaseException
) -> tuple[str, ComputationError]:
    """Save to the system's temporary folder a file that its own folder cannot take.

    Return its path and the error to raise.

    Raises
    ------
    ComputationError
        The file cannot be saved in the temporary folder either.
    """
    made = None
    place = f"{file}: cannot be written ({reason(failure)})"
    try:
        made = Path(tempfile.mkdtemp(prefix="foldyn-"))
        write(made / file.name)
    except (OSError, InputError) as error:
        if made is not None:
            shutil.rmtree(made, ignore_errors=True)
        raise ComputationError(
            f"{place}, nor can a temporary folder ({reason(error)}): it is lost; make room, or "
            "name another place with --out"
        ) from None
    remedy = "make room, or name another place with --out"
    return str(made / file.name), ComputationError(f"{place}: {remedy}")


@contextmanager
def held(
    folder: Path, out: str | None, names: Sequence[str], owner: Owner, replace: bool = False,
    drawn: Sequence[str] = (), inside: Sequence[str] = (),
) -> Iterator[Results]:  # fmt: skip
    """Lock the folder for one run; an error that ends the run names what was kept.

    Parameters
    ----------
    folder : Path
    out : str or None
        The folder as the user typed it.
    names : sequence of str
        Files that the run writes.
    owner : Owner
    replace : bool
        Whether to replace results of another owner.
    drawn : sequence of str
        Glob patterns for figures and pages.
    inside : sequence of str
        Subfolders that the run writes to.

    Raises
    ------
    InputError
        The folder cannot be written, another run holds it, or it belongs to another owner.
    """
    places = [folder, *(folder / name for name in inside)]
    try:
        with _made(folder, out, names), locked(folder / LOCK):
            old = _old(folder, _place(folder, out), names, owner, replace)
            results = Results(folder, owner, drawn, old)
            remove_leftovers(*places)
            state = "stopped"
            try:
                with _naming(results):
                    yield results
                state = "complete"
            finally:
                results.end(state)
                remove_leftovers(*places)
    except LockedError as error:
        raise InputError(
            f"{_place(folder, out)}: another run writes to it ({error}); wait for its end, or name "
            "another folder"
        ) from None


def held_by(
    given: Namespace, command: str, path: Path, written: Sequence[str], drawn: Sequence[str],
    kept: str,
) -> AbstractContextManager[Results]:  # fmt: skip
    """Lock the results folder of a command on a file; see `held`.

    written : files that the command writes, without its page.
    drawn : glob patterns for figures, without their suffixes.
    kept : subfolder that the command writes to.
    """
    folder = Path(f"{path.stem}-{command}" if given.out is None else given.out)
    names = [*written, *([] if given.no_figures else [PAGE])]
    figures = [PAGE, *(f"{name}.{form}" for name in drawn for form in FIGURES)]
    owner = Owner.of(command, path, folder)
    return held(folder, given.out, names, owner, given.replace, figures, [kept])


def add_page(
    given: Namespace, folder: Path, noted: Told, spent: Mapping[str, float],
    write: Callable[..., Path],
) -> None:  # fmt: skip
    """Write the page of results with the warnings noted and the time spent, if it is asked for."""
    from foldyn.analyses.provenance import Call

    if not given.no_figures:
        with drawing(folder):
            call = Call(given.typed, tuple(noted), **spent)
            speech(given.quiet)(f"wrote {write(call=call, figures=given.figures)}")


@contextmanager
def _naming(results: Results) -> Iterator[None]:
    """Within the block: if the run ends early, name the kept files in its message."""
    try:
        yield
    except KeyboardInterrupt as stop:
        raise KeyboardInterrupt(f"{str(stop) or 'interrupted'}{results.summary()}") from None
    except (FoldynError, OSError, MemoryError) as error:
        if not results.kept and not isinstance(error, ComputationError):
            raise
        partial = getattr(error, "partial", None)
        raise ComputationError(f"{reason(error)}{results.summary()}", partial) from None


def _old(folder: Path, place: str, names: Sequence[str], owner: Owner, replace: bool) -> list[str]:
    """Return results in the folder that this run replaces; refuse another owner's results."""
    found = read_stamp(folder)
    if found is None:
        there = [path.name for path in folder.iterdir() if _RESULT.fullmatch(path.name)]
        strange = sorted(set(there) - set(names))
        if strange and not replace:
            raise InputError(
                f"{place}: holds {strange[0]}, which this run does not write and would "
                "leave among the new results; name another folder, or replace it with --replace"
            )
        return there
    old = [name for name in (*found["results"], *found["outdated"]) if (folder / name).exists()]
    if old and not owner.same(found) and not replace:
        raise InputError(
            f"{place}: holds the results of {named_owner(found, folder)}; name another folder, or "
            "replace them with --replace"
        )
    return list(dict.fromkeys(old))


@contextmanager
def drawing(place: object, kept: str = "") -> Iterator[None]:
    """Turn any failure while figures are drawn into one message that names what was kept."""
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted while figures were drawn{kept}") from None
    except Exception as error:
        kind = "" if isinstance(error, FoldynError | OSError) else f"{type(error).__name__}: "
        raise ComputationError(f"{place}: figures: {kind}{reason(error)}{kept}") from None


def reason(error: BaseException) -> str:
    """Return the message of an error; for a system error, file and reason without its number."""
    if isinstance(error, MemoryError):
        return "not enough memory: take fewer cells, divisions, steps or samples"
    if not isinstance(error, OSError) or not error.strerror:
        return str(error)
    return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
