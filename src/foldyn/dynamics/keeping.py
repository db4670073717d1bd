"""A motion that is kept on the disk while it runs, so that it can go on after whatever ends it.

Beside the file of its result stands a folder with its samples, which only grow, and a checkpoint:
how many of them count, and all on which the next steps depend. The checkpoint is replaced whole,
after its samples are on the disk.
"""

from __future__ import annotations

import io
import json
import math
import os
import shutil
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import ComputationError, InputError
from foldyn.results.columns import Columns
from foldyn.results.netcdf import check_target, load
from foldyn.values import number, show
from foldyn.writing import remove_leftovers, write_bytes

if TYPE_CHECKING:
    import xarray

SECONDS = 60.0
"""Time between checkpoints where the user does not say."""
CHECKPOINT = "checkpoint.npz"
_ABOUT = "about"
KEY = "motion"
"""Attribute of a result that was kept meanwhile: what the motion is, as a digest."""


class Keeping:
    """How a motion is kept.

    Parameters
    ----------
    file : Path
        Of the result.
    seconds : float
        Between checkpoints. A motion that ends before the first one, and whose samples take little
        memory, leaves the disk alone.
    resume : bool
        Whether to go on with what was cut off.
    anew : bool
        Whether to give up what was cut off.
    how : tuple of str
        How the user asks for that, and for a new beginning, in messages.

    Attributes
    ----------
    begun : bool
        Whether there is something on the disk.
    columns : Columns
        The samples there.
    """

    def __init__(
        self, file: Path, seconds: float = SECONDS, resume: bool = False, anew: bool = False,
        how: tuple[str, str] = ("resume=True", "remove that folder"),
    ) -> None:  # fmt: skip
        self.file = file
        self.folder = file.with_name(f"{file.name}.unfinished")
        self.seconds, self.resume, self.how = seconds, resume, how
        self._anew = anew
        self.begun = False
        self.columns: Columns
        self._rows: dict[str, tuple[int, ...]] = {}
        self._about: dict[str, Any] = {}
        self._reached: float | None = None
        self._last = time.monotonic()

    @property
    def room(self) -> float:
        """Bytes that the samples may take on the disk, with those that are there already."""
        try:
            there = next(place for place in self.folder.absolute().parents if place.is_dir())
            own = [file.stat().st_size for file in self.folder.glob("*") if file.is_file()]
            return float(shutil.disk_usage(there).free + sum(own))
        except OSError:  # a folder that is gone: writing will tell
            return math.inf

    def finished(self, key: str) -> xarray.Dataset | None:
        """The result, if it is there whole, is that of a motion, and is to be gone on with."""
        if not self.resume or self.folder.exists() or not self.file.is_file():
            return None
        result = load(self.file, whole=False)
        same = result.attrs.get(KEY) == key and "stopped_because" not in result.attrs
        if not same:
            result.close()
        return result if same else None

    def keeps(self, about: Mapping[str, Any]) -> bool:
        """Whether what is kept is this motion."""
        kept, now = self._read(), json.loads(json.dumps(about))
        return kept is not None and now.items() <= kept[_ABOUT]["motion"].items()

    def begin(
        self, about: Mapping[str, Any], rows: Mapping[str, tuple[int, ...]]
    ) -> dict[str, NDArray] | None:
        """What was kept of the same motion, to go on from; None to begin anew.

        Parameters
        ----------
        about : mapping of str to str or number
            All that decides what the motion is.
        rows : mapping of str to tuple of int
            Shape of a row of each column.

        Raises
        ------
        InputError
            There is something kept and it is not to go on, or it is of another motion, or damaged.
        """
        self._about, self._rows, self._last = dict(about), dict(rows), time.monotonic()
        if self._anew:
            self.remove()
        if not self.folder.exists():
            return None
        remove_leftovers(self.folder)
        kept = self._read()
        if kept is None:
            return None
        if not self.resume:
            on, anew = self.how
            raise InputError(
                f"{self.folder}: keeps a motion that was cut off, up to "
                f"t = {kept[_ABOUT]['reached']:.6g} s: go on with it by {on}, or {anew} to begin "
                "anew"
            )
        told = kept.pop(_ABOUT)
        self._compare(told["motion"])
        count = int(told["samples"])
        self.columns = Columns(self.folder, rows)
        if not self.columns.hold(count):
            raise InputError(
                f"{self.folder}: is damaged: it lacks samples that its checkpoint counts; "
                f"{self.how[1]} to begin anew"
            )
        self.columns.cut(count)
        self.begun, self._reached = True, told["reached"]
        return kept

    @property
    def due(self) -> bool:
        """Whether it is time for a checkpoint."""
        return time.monotonic() - self._last >= self.seconds

    def append(self, rows: Mapping[str, NDArray]) -> None:
        """Put samples on the disk; raises `ComputationError` where that fails."""
        try:
            if not self.begun:
                self.folder.mkdir(exist_ok=True)
                self.columns, self.begun = Columns(self.folder, self._rows), True
            self.columns.append(rows)
        except OSError as error:
            self._fail(error)

    def checkpoint(self, standing: Mapping[str, NDArray], reached: float) -> None:
        """Make a checkpoint at the time (s) reached, after `append` of all samples until then."""
        told = {"motion": self._about, "samples": self.columns.count, "reached": reached}
        text = np.frombuffer(json.dumps(told).encode(), np.uint8)
        content = io.BytesIO()
        np.savez(content, **{_ABOUT: text, **standing})  # type: ignore[arg-type]
        try:
            self.columns.settle()
            write_bytes(self.folder / CHECKPOINT, content.getvalue())
        except OSError as error:
            self._fail(error)
        self._reached, self._last = reached, time.monotonic()

    @property
    def summary(self) -> str:
        """What is kept, and how to go on, for the end of a message; empty where there is none."""
        if self._reached is None:
            return ""
        return f"; {self.folder} keeps it up to t = {self._reached:.6g} s: go on by {self.how[0]}"

    def remove(self) -> None:
        """Remove what is kept: the result is in its file."""
        shutil.rmtree(self.folder, ignore_errors=True)
        self.begun, self._reached = False, None

    def _read(self) -> dict[str, Any] | None:
        """The checkpoint; None where the first one was never made."""
        path = self.folder / CHECKPOINT
        if not path.exists():
            return None
        try:
            with np.load(path, allow_pickle=False) as stored:
                kept: dict[str, Any] = {name: stored[name] for name in stored.files}
            kept[_ABOUT] = json.loads(kept[_ABOUT].tobytes())
            float(kept[_ABOUT]["reached"])
        except Exception:  # what readers raise on damaged files is of any kind
            raise InputError(f"{path}: is damaged; {self.how[1]} to begin anew") from None
        return kept

    def _compare(self, before: Mapping[str, Any]) -> None:
        """Refuse to go on with another motion, by the name of what has changed."""
        now = self._about
        for name in dict.fromkeys([*now, *before]):
            if now.get(name) != before.get(name):
                raise InputError(
                    f"{self.folder}: was begun with {name} = {show(before.get(name))}, which is "
                    f"{show(now.get(name))} now: a motion goes on as it was begun; restore it, or "
                    f"{self.how[1]} to begin anew"
                )

    def _fail(self, error: OSError) -> NoReturn:
        kept = self.summary or "; nothing of the motion was kept before"
        text = f"{self.folder}: cannot be written ({error.strerror or error}): make room{kept}"
        raise ComputationError(text) from None


def check_keeping(store: Any, checkpoint: Any, resume: Any) -> Keeping:
    """How a motion is kept, from the arguments of `simulate`."""
    if not isinstance(store, str | os.PathLike):
        raise InputError(f" = {show(store)}: give the file of the result", "store")
    file = check_target(store)
    seconds = number("checkpoint", checkpoint, above=0.0)
    if not isinstance(resume, bool):
        raise InputError(f" = {show(resume)}: give True or False", "resume")
    return Keeping(file, seconds, resume)
