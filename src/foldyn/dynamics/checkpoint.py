"""Checkpoints: how an interrupted motion is stored on disk, and resumed.

Beside the file of its result stands a folder with its samples, which only grow, and a checkpoint:
what the motion is, how many samples count, their checksums, and a snapshot of all on which the next
steps depend. The checkpoint is sealed and replaced whole, after its samples are on the disk. One
process at a time keeps a motion in a file: it holds the lock beside it.
"""

from __future__ import annotations

import errno
import hashlib
import json
import math
import os
import shutil
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from foldyn import __version__
from foldyn.cases import Case
from foldyn.cases.document import to_document
from foldyn.dynamics.motion_state import Course, StepPlan
from foldyn.dynamics.system import Packed
from foldyn.errors import ComputationError, InputError
from foldyn.lock import LockedError, locked
from foldyn.mechanics.inelastic_branches import HingeMemory
from foldyn.program import program
from foldyn.results.columns import Columns
from foldyn.results.netcdf import check_target, load, save
from foldyn.results.seal import seal, sound
from foldyn.values import flag, number, show
from foldyn.writing import remove_leftovers, whole

if TYPE_CHECKING:
    import xarray

SECONDS = 60.0
"""Time between checkpoints where the user does not say."""
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Errors of a disk, or of what one may use of it, that is full."""
CHECKPOINT = "checkpoint.npz"
_ABOUT = "about"
KEY = "motion"
"""Attribute of a result that was kept meanwhile: what the motion is, as a digest."""
CONSTANT = ("team", "strips", "packed", "course", "_packed", "_course", "_plan", "share")
"""Fields that stay what they are, or serve one evaluation."""


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

    @contextmanager
    def held(self) -> Iterator[None]:
        """Let no other process write to the file, or to what is kept beside it.

        Raises
        ------
        InputError
            Another process does, or nothing can be written there.
        """
        lock = self.file.with_name(f".{self.file.name}.lock")
        with ExitStack() as stack:
            try:
                stack.enter_context(locked(lock))
            except LockedError as other:
                raise InputError(
                    f"{self.file}: is being written by {other}; wait until it ends, or name "
                    "another file"
                ) from None
            except OSError as error:
                why = error.strerror or error
                raise InputError(
                    f"{self.file}: cannot be written ({why}); choose another folder"
                ) from None
            yield

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
        self.columns = Columns(self.folder, rows, count, told["sums"])
        if damaged := self.columns.damaged():
            raise InputError(
                f"{damaged}: is damaged: samples that the checkpoint counts are missing or have "
                f"changed; {self.how[1]} to begin anew"
            )
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

    def checkpoint(self, arrays: Mapping[str, NDArray], reached: float) -> None:
        """Make a checkpoint at the time (s) reached, after `append` of all samples until then."""
        told = {
            "motion": self._about, "samples": self.columns.count, "sums": self.columns.sums,
            "reached": reached,
        }  # fmt: skip
        text = np.frombuffer(json.dumps(told).encode(), np.uint8)
        try:
            self.columns.settle()
            with whole(self.folder / CHECKPOINT) as part:
                np.savez(part, **{_ABOUT: text, **arrays})  # type: ignore[arg-type]
                seal(part)
        except OSError as error:
            self._fail(error)
        self._reached, self._last = reached, time.monotonic()

    def check(self) -> None:
        """Raise `ComputationError` where samples are not those that were written."""
        if self.begun and (damaged := self.columns.damaged()):
            raise ComputationError(
                f"{damaged}: was changed by something else while the motion ran, so the result "
                f"would be wrong and is not written{self.summary}"
            )

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

    def save_result(self, result: xarray.Dataset) -> xarray.Dataset:
        """Write the result to its file, and remove what was kept; the result as it is there."""
        try:
            save(result, self.file)
        except OSError as error:
            text = f"{self.file}: {_unwritable(error)}{self.summary}"
            raise ComputationError(text, result) from None
        self.remove()
        return load(self.file, whole=False)

    def _read(self) -> dict[str, Any] | None:
        """The checkpoint; None where the first one was never made."""
        path = self.folder / CHECKPOINT
        if not path.exists():
            return None
        try:
            if not sound(path):
                raise ValueError
            with np.load(path, allow_pickle=False) as stored:
                kept: dict[str, Any] = {name: stored[name] for name in stored.files}
            kept[_ABOUT] = json.loads(kept[_ABOUT].tobytes())
            float(kept[_ABOUT]["reached"])
        except Exception:  # what readers raise on damaged files is of any kind
            raise InputError(
                f"{path}: is damaged, or was made by another version of Foldyn; {self.how[1]} to "
                "begin anew"
            ) from None
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
        raise ComputationError(f"{self.folder}: {_unwritable(error)}{kept}") from None


def _unwritable(error: OSError) -> str:
    """Why something cannot be written, and what to do."""
    remedy = "make room" if error.errno in FULL else "see that nothing else moves or changes it"
    return f"cannot be written ({error.strerror or error}): {remedy}"


def check_keeping(store: Any, checkpoint: Any, resume: Any) -> Keeping:
    """How a motion is kept, from the arguments of `simulate`."""
    if not isinstance(store, str | os.PathLike):
        raise InputError(f" = {show(store)}: give the file of the result", "store")
    file = check_target(store)
    seconds = number("checkpoint", checkpoint, above=0.0)
    return Keeping(file, seconds, flag("resume", resume))


def identity(
    case: Case, method: Any, plan: StepPlan, state: Iterable[Any], sampled: Iterable[str],
) -> dict[str, Any]:  # fmt: skip
    """Numbers and texts by name, of a case file's keys where it has them.

    Functions of the user's count by their places alone: their text is not known.

    Parameters
    ----------
    case : Case
    method : Integrator
    plan : StepPlan
    state : iterable
        What the motion starts from.
    sampled : iterable of str
        Names of what the user samples.
    """
    document = to_document(case)
    options = getattr(method.scheme, "keywords", {})
    return {
        **_flat(document.sections),
        **{name: _digest(array) for name, array in document.arrays.items()},
        "method": method.name,
        "spectral_radius": options.get("facts", {}).get("spectral_radius"),
        "start": plan.start,
        "duration": plan.end - plan.start,
        "every_steps": 0 if plan.steps else plan.every,
        "interval": plan.interval,
        "dt": plan.dt,
        "tolerance": plan.tolerance,
        "initial": [one if isinstance(one, str) else _digest(one) for one in state],
        "sample": list(sampled),
        "the version of Foldyn": f"{__version__} ({program('results')})",
    }


def identity_digest(about: Mapping[str, Any]) -> str:
    """Digest of an identity, "1f0c6a2b9d3e4f58"."""
    text = json.dumps(about, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _flat(table: Mapping[str, Any], place: str = "") -> dict[str, Any]:
    """Values of tables within tables, by their keys with dots."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            found |= _flat(value, f"{place}{key}.")
        elif isinstance(value, list) and value and all(isinstance(one, Mapping) for one in value):
            for k, one in enumerate(value):
                found |= _flat(one, f"{place}{key}[{k}].")
        else:
            found[f"{place}{key}"] = value
    return found


def _digest(array: Any) -> str | None:
    """Digest of the numbers of an array; None of none."""
    if array is None:
        return None
    values = np.ascontiguousarray(array)
    text = f"{values.dtype}{values.shape}".encode()
    return hashlib.sha256(text + values.tobytes()).hexdigest()[:16]


def state_parts(packed: Packed, course: Course) -> dict[str, Any]:
    """What changes in a case and its state, for all methods."""
    memory = packed.body.find(HingeMemory)
    parts: dict[str, Any] = {"course": course}
    if memory is not None:
        parts["branches"] = memory.own
    if packed.system.turns:
        parts["folds"] = [packed.body.sheet.folds, packed.body.sheet.series()[1]]
    if packed.added.acts:
        own = packed.added
        parts["added_mass"] = [own.flow, own.resistance, own.guess, own.angle, own.made]
    if packed.heat is not None:
        parts["heat"] = [packed.heat.seen]
    return parts


class _Place(NamedTuple):
    """Something that changes: an array or a record, in place, or a number of its owner."""

    name: str
    owner: Any
    field: str
    value: Any


def snapshot(parts: Mapping[str, Any]) -> dict[str, NDArray]:
    """Copy what changes in parts.

    Parameters
    ----------
    parts : mapping of str to ndarray, named tuple, list or object
        Arrays and records, also those within tuples and lists; of other objects their own arrays,
        tuples and numbers.

    Returns
    -------
    dict of str to ndarray
        What `restore` takes, by the names of the places.
    """
    kept = {}
    for place in _places(parts):
        if isinstance(place.value, np.void):
            kept[place.name] = np.array(
                [float(place.value[one]) for one in place.value.dtype.names or ()]
            )
        else:
            kept[place.name] = np.array(place.value)
    return kept


def restore(parts: Mapping[str, Any], kept: Mapping[str, NDArray]) -> None:
    """Put a snapshot of such parts back.

    Raises
    ------
    KeyError, ValueError
        It is one of other parts.
    """
    for name, owner, field, value in list(_places(parts)):
        then = kept[name]
        if isinstance(value, np.void):
            for one, number in zip(value.dtype.names or (), then.tolist(), strict=True):
                value[one] = number
        elif isinstance(value, np.ndarray):
            if value.shape != then.shape:
                raise ValueError(f"{name}: {then.shape} instead of {value.shape}")
            value[...] = then
        else:
            setattr(owner, field, type(value)(then[()]))


def _places(parts: Mapping[str, Any]) -> Iterator[_Place]:
    """Places in parts; an array that threads share is one."""
    seen: set[int] = set()
    for place in _all_places(parts):
        if isinstance(place.value, np.ndarray):
            if id(place.value) in seen:
                continue
            seen.add(id(place.value))
        yield place


def _all_places(parts: Mapping[str, Any]) -> Iterator[_Place]:
    for name, part in parts.items():
        if isinstance(part, tuple | list | np.ndarray | np.void):
            yield from _arrays(name, part)
            continue
        for field, value in vars(part).items():
            if isinstance(value, bool | int | float):
                yield _Place(f"{name}.{field}", part, field, value)
            elif field not in CONSTANT:
                yield from _arrays(f"{name}.{field}", value)


def _arrays(name: str, value: Any) -> Iterator[_Place]:
    """Arrays and records in a value."""
    if isinstance(value, np.void) or (isinstance(value, np.ndarray) and value.flags.writeable):
        yield _Place(name, None, "", value)
    elif isinstance(value, list):
        for k, one in enumerate(value):
            yield from _arrays(f"{name}[{k}]", one)
    elif isinstance(value, tuple):
        for field, one in zip(getattr(value, "_fields", ()), value, strict=False):
            if field not in CONSTANT:
                yield from _arrays(f"{name}.{field}", one)
