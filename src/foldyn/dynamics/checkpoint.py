"""Checkpoints: how an interrupted motion is stored on disk and resumed.

Next to the result file, a folder holds the samples, which are only appended, and a checkpoint. The
checkpoint consists of the identity of the motion, the number and checksums of the valid samples,
and a snapshot of everything that the next steps depend on. It has a checksum of its own and is
replaced atomically, after its samples are on disk. A lock file lets only one process at a time
write a motion.
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
from foldyn.dynamics.motion_state import MotionState, StepPlan
from foldyn.dynamics.system import PackedCase
from foldyn.errors import ComputationError, InputError
from foldyn.lock import LockedError, locked
from foldyn.mechanics.inelastic import HingeMemory
from foldyn.results.columns import Columns
from foldyn.results.netcdf import check_target, load, save
from foldyn.results.seal import seal, sound
from foldyn.store import program
from foldyn.values import flag, number, show
from foldyn.writing import remove_leftovers, whole

if TYPE_CHECKING:
    import xarray

SECONDS = 60.0
"""Default time between checkpoints, s."""
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Error numbers of a full disk, an exhausted quota, or a file above the allowed size."""
CHECKPOINT = "checkpoint.npz"
_ABOUT = "about"
KEY = "motion"
"""Attribute of a result whose motion was stored on the way: digest of the motion's identity."""
CONSTANT = ("team", "strips", "packed", "_packed", "_state", "_plan", "share")
"""Fields that never change, or are used within one evaluation only."""


class Keeping:
    """How a motion is stored on disk.

    Parameters
    ----------
    file : Path
        File of the result.
    seconds : float
        Time between checkpoints. A motion that ends before the first checkpoint, with few samples,
        writes nothing to disk.
    resume : bool
        Whether to continue an interrupted motion.
    anew : bool
        Whether to discard an interrupted motion.
    how : tuple of str
        How the user can resume, and how to start over, for messages.

    Attributes
    ----------
    begun : bool
        Whether there is anything on disk.
    columns : Columns
        The samples on disk.
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
        """Bytes available for samples on disk, including those already written."""
        try:
            there = next(place for place in self.folder.absolute().parents if place.is_dir())
            own = [file.stat().st_size for file in self.folder.glob("*") if file.is_file()]
            return float(shutil.disk_usage(there).free + sum(own))
        except OSError:  # the folder is gone: writing will report it
            return math.inf

    @contextmanager
    def held(self) -> Iterator[None]:
        """Lock the file and its checkpoint folder against other processes.

        Raises
        ------
        InputError
            Another process holds the lock, or the folder is not writable.
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
        """Finished result of this motion, if `resume` is on and the file holds it; else None."""
        if not self.resume or self.folder.exists() or not self.file.is_file():
            return None
        result = load(self.file, whole=False)
        same = result.attrs.get(KEY) == key and "stopped_because" not in result.attrs
        if not same:
            result.close()
        return result if same else None

    def keeps(self, about: Mapping[str, Any]) -> bool:
        """Whether the checkpoint belongs to this motion."""
        kept, now = self._read(), json.loads(json.dumps(about))
        return kept is not None and now.items() <= kept[_ABOUT]["motion"].items()

    def begin(
        self, about: Mapping[str, Any], rows: Mapping[str, tuple[int, ...]]
    ) -> dict[str, NDArray] | None:
        """Return the checkpoint of the same motion to resume from; None for a fresh start.

        Parameters
        ----------
        about : mapping of str to str or number
            Everything that determines the motion.
        rows : mapping of str to tuple of int
            Shape of a row of each column.

        Raises
        ------
        InputError
            There is a checkpoint, but `resume` is off, or the checkpoint belongs to another motion
            or is damaged.
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
            raise InputError(
                f"{self.folder}: keeps an interrupted motion, up to "
                f"t = {kept[_ABOUT]['reached']:.6g} s: continue it by {self.how[0]}, or "
                f"{self.how[1]} to start again"
            )
        told = kept.pop(_ABOUT)
        self._compare(told["motion"])
        count = int(told["samples"])
        self.columns = Columns(self.folder, rows, count, told["sums"])
        if damaged := self.columns.damaged():
            raise InputError(
                f"{damaged}: is damaged: samples that the checkpoint counts are missing or have "
                f"changed; {self.how[1]} to start again"
            )
        self.begun, self._reached = True, told["reached"]
        return kept

    @property
    def due(self) -> bool:
        """Whether it is time for a checkpoint."""
        return time.monotonic() - self._last >= self.seconds

    def append(self, rows: Mapping[str, NDArray]) -> None:
        """Append samples on disk; raise `ComputationError` if that fails."""
        try:
            if not self.begun:
                self.folder.mkdir(exist_ok=True)
                self.columns, self.begun = Columns(self.folder, self._rows), True
            self.columns.append(rows)
        except OSError as error:
            self._fail(error)

    def checkpoint(self, arrays: Mapping[str, NDArray], reached: float) -> None:
        """Write a checkpoint at the time reached (s), after `append` has stored all samples."""
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
        """Raise `ComputationError` if samples on disk differ from what was written."""
        if self.begun and (damaged := self.columns.damaged()):
            raise ComputationError(
                f"{damaged}: was changed by something else while the motion ran, so the result "
                f"would be wrong and is not written{self.summary}"
            )

    @property
    def summary(self) -> str:
        """End of a message: what is stored and how to resume it; empty without a checkpoint."""
        if self._reached is None:
            return ""
        where = f"; {self.folder} keeps it up to t = {self._reached:.6g} s"
        return f"{where}: continue it by {self.how[0]}"

    def remove(self) -> None:
        """Remove the checkpoint folder, once the result is in its file."""
        shutil.rmtree(self.folder, ignore_errors=True)
        self.begun, self._reached = False, None

    def save_result(self, result: xarray.Dataset) -> xarray.Dataset:
        """Write the result, remove the checkpoint folder, and return the result as stored."""
        try:
            save(result, self.file)
        except OSError as error:
            text = f"{self.file}: {_unwritable(error)}{self.summary}"
            raise ComputationError(text, result) from None
        self.remove()
        return load(self.file, whole=False)

    def _read(self) -> dict[str, Any] | None:
        """Return the checkpoint; None if none has been written."""
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
        except Exception:  # readers raise any kind of exception on damaged files
            raise InputError(
                f"{path}: is damaged, or was made by another version of Foldyn; {self.how[1]} to "
                "start again"
            ) from None
        return kept

    def _compare(self, before: Mapping[str, Any]) -> None:
        """Refuse to resume another motion, and name what has changed."""
        now = self._about
        for name in dict.fromkeys([*now, *before]):
            if now.get(name) != before.get(name):
                raise InputError(
                    f"{self.folder}: was begun with {name} = {show(before.get(name))}, which is "
                    f"{show(now.get(name))} now: a motion continues as it was begun; restore it, "
                    f"or {self.how[1]} to start again"
                )

    def _fail(self, error: OSError) -> NoReturn:
        kept = self.summary or "; nothing of the motion was kept before"
        raise ComputationError(f"{self.folder}: {_unwritable(error)}{kept}") from None


def _unwritable(error: OSError) -> str:
    """Reason why a write failed, and the remedy."""
    remedy = "make room" if error.errno in FULL else "see that nothing else moves or changes it"
    return f"cannot be written ({error.strerror or error}): {remedy}"


def check_keeping(store: Any, checkpoint: Any, resume: Any) -> Keeping:
    """Check the arguments `store`, `checkpoint` and `resume` of `simulate`; see `Keeping`."""
    if not isinstance(store, str | os.PathLike):
        raise InputError(f" = {show(store)}: give the file of the result", "store")
    file = check_target(store)
    seconds = number("checkpoint", checkpoint, above=0.0)
    return Keeping(file, seconds, flag("resume", resume))


def identity(
    case: Case, method: Any, plan: StepPlan, state: Iterable[Any], sampled: Iterable[str],
) -> dict[str, Any]:  # fmt: skip
    """Identity of a motion: values by name, with the case-file key as the name where one exists.

    User functions enter only by their position, as their source is unknown.

    Parameters
    ----------
    case : Case
    method : Integrator
    plan : StepPlan
    state : iterable
        The initial state.
    sampled : iterable of str
        Names of the user's sampled quantities.
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
    """Digest of an identity, such as "1f0c6a2b9d3e4f58"."""
    text = json.dumps(about, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _flat(table: Mapping[str, Any], place: str = "") -> dict[str, Any]:
    """Values of nested tables, with dotted keys."""
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
    """Digest of an array; None for None."""
    if array is None:
        return None
    values = np.ascontiguousarray(array)
    text = f"{values.dtype}{values.shape}".encode()
    return hashlib.sha256(text + values.tobytes()).hexdigest()[:16]


def beyond_samples(packed: PackedCase, state: MotionState) -> NDArray:
    """Displacement and velocity, if these include dofs that samples do not hold; else (0,)."""
    if not len(packed.body.hidden):
        return np.zeros(0)
    return np.concatenate([state.u.ravel(), state.v.ravel()])


def state_parts(packed: PackedCase, state: MotionState) -> dict[str, Any]:
    """Mutable state of a case and its motion, the same for all methods."""
    memory = packed.body.find(HingeMemory)
    parts: dict[str, Any] = {"state": state}
    if memory is not None:
        parts["branches"] = memory.own
    if packed.system.turns:
        parts["folds"] = [packed.system.actuators.folds, packed.system.actuators.offset]
    if packed.added.acts:
        own = packed.added
        parts["added_mass"] = [own.flow, own.resistance, own.guess, own.angle, own.made]
    if packed.heat is not None:
        parts["heat"] = [packed.heat.seen]
    return parts


class _Place(NamedTuple):
    """A place of mutable state: an array or record, changed in place, or a number of its owner."""

    name: str
    owner: Any
    field: str
    value: Any


def snapshot(parts: Mapping[str, Any]) -> dict[str, NDArray]:
    """Copy the mutable state in `parts`.

    Parameters
    ----------
    parts : mapping of str to ndarray, named tuple, list or object
        Arrays and records, including those within tuples and lists; of any other object, the
        arrays, tuples and numbers among its attributes.

    Returns
    -------
    dict of str to ndarray
        Values by the names of their places, for `restore`.
    """
    kept = {}
    for name, _, _, value in _places(parts):
        record = isinstance(value, np.void)
        kept[name] = np.array(value.tolist(), float) if record else np.array(value)
    return kept


def restore(parts: Mapping[str, Any], kept: Mapping[str, NDArray]) -> None:
    """Restore a snapshot of the same parts.

    Raises
    ------
    KeyError, ValueError
        The snapshot belongs to other parts.
    """
    for name, owner, field, value in _places(parts):
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


def _places(parts: Mapping[str, Any]) -> list[_Place]:
    """Mutable places in parts; an array shared by several threads appears once."""
    seen: dict[Any, _Place] = {}
    for place in _all_places(parts):
        shared = isinstance(place.value, np.ndarray)
        seen.setdefault(id(place.value) if shared else place.name, place)
    return list(seen.values())


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
