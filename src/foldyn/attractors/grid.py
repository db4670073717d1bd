"""`basins`: the attractors in which motions from a grid of starts end.

The end states can be stored in a folder, so that an interrupted grid can continue.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import os
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from numpy.typing import ArrayLike, NDArray

from foldyn import writing
from foldyn.attractors.diagram import repeats_after
from foldyn.attractors.drive import drive_frequency
from foldyn.attractors.run import PER_PERIOD, check_relaxing, divisor, step_of
from foldyn.cases import Case, State
from foldyn.cases.document import to_document
from foldyn.dynamics import initial_state, prepare, simulate_many
from foldyn.dynamics.ensemble import device_for
from foldyn.dynamics.gpu.choice import DEVICES
from foldyn.dynamics.progress import Progress, Reporter, reported
from foldyn.errors import InputError, told_once, warn
from foldyn.ram_limit import check_memory
from foldyn.results.dataset import result_dataset
from foldyn.results.quantities import PLACE, variable
from foldyn.results.seal import seal, sound
from foldyn.store import Store, name_of, program
from foldyn.values import choice, number, numbers, of_kind, show, whole

AT_ONCE = 256  # motions computed together, and stored in one file
LOOKED_AT = 64  # most starts used to choose the step
LEAST = 1e-6  # least length scale for comparing states, relative to the longest bar
BYTES = 600.0  # memory per node for a start and the end of its motion
TAKEN = (
    "attractor", "record", *PLACE, "basin", "periods", "share", "displacement", "velocity",
    "support",
)  # fmt: skip
"""Names used in the result."""
UNDRIVEN = 0.02  # without a drive, interval between recorded states, relative to the duration


def basins(
    case: Case,
    initial: Callable[..., State],
    *,
    grid: Mapping[str, ArrayLike],
    duration: float,
    record: int = 8,
    same: float = 0.01,
    method: str = "central_difference",
    dt: float | None = None,
    threads: int | None = None,
    device: str = "auto",
    folder: str | os.PathLike[str] | None = None,
    progress: bool | Reporter | None = None,
) -> xarray.Dataset:
    """Basins of attraction: the motion, or equilibrium, in which each start of a grid ends.

    All motions are computed together (`simulate_many`). Motions have the same attractor if they end
    in the same states, sampled once per period of the drive.

    Parameters
    ----------
    case : Case
        Case without hinges that yield or creep. Its `Harmonic` histories set the period; without a
        `Harmonic` history, attractors are equilibria.
    initial : callable
        Function that returns the `State` at a point of the grid; its keyword arguments are the
        values of the parameters at this point.
    grid : mapping of str to array_like
        Values of each parameter of `initial`: {"height": ..., "speed": ...}.
    duration : float
        Duration (s) of each motion before it is recorded, rounded up to whole periods.
    record : int
        Number of states recorded after `duration`, one per period, at least 4: attractors of up to
        half as many periods are distinguished.
    same : float
        Distance below which states are equal, as a fraction of the range of all states.
    dt : float, optional
        Largest step (s), shortened to divide the period. By default half the least critical step of
        up to 64 of the starts, and with a drive at most 1/64 of the period.
    method, threads, device :
        As in `simulate_many`.
    folder : path, optional
        Folder in which the ends of motions are stored, 256 at a time. An interrupted grid, or a
        grid that adds starts after the same first ones, continues from the stored ends.
    progress : bool or callable, optional
        True shows a bar; a callable gets a `Progress` of the number of motions.

    Returns
    -------
    xarray.Dataset
        Along the names of the grid: `basin`, the number of the attractor, from 0 in order of
        appearance, or -1 if the motion does not repeat: it is chaotic, has not settled yet, or has
        failed. Along `attractor`: `periods`, the number of drive periods after which the attractor
        repeats (1 for an equilibrium); `share`, the share of the starts that end in it; and along
        `record` the states `displacement` (m) and `velocity` (m/s). The attribute `device` names
        the device that computed the motions.

    Raises
    ------
    InputError
        An argument out of range, a case that `simulate_many` refuses, friction, or hinges that
        yield or creep.

    Warns
    -----
    FoldynWarning
        Some motions do not repeat; also the warnings of `simulate_many`.

    Examples
    --------
    >>> import foldyn as fd
    >>> s = fd.discretize(fd.patterns.simple_fold(dihedral=60), fd.Sheet(1e6, 0.25, 0.1, 1.0))
    >>> supports = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "yz")]
    >>> case = fd.Case(s, supports, damping=fd.Rayleigh(alpha=40.0))
    >>> def pulled(length):
    ...     u = np.zeros((len(s.nodes), 3))
    ...     u[[0, 1], 0] = length
    ...     return fd.State(u)
    >>> grid = {"length": [-0.01, 0.0, 0.01]}
    >>> basins(case, pulled, grid=grid, duration=1.0, dt=5e-5).basin.values.tolist()
    [0, 0, 0]
    """
    began = time.perf_counter()
    of_kind("case", case, Case)
    check_relaxing(case, "their memory is not part of the grid")
    if case.contact is not None and case.contact.rubs:
        raise InputError(
            ": motions continue from their settled states, which do not hold the stretch of "
            "friction springs; give friction = 0.0",
            "contact.friction",
        )
    names, places = _grid(grid, len(case.structure.nodes))
    starts = _starts(case, initial, names, places)
    duration = number("duration", duration, above=0.0, unit="s")
    record, same = whole("record", record, least=4), number("same", same, above=0.0, below=1.0)
    frequency = drive_frequency(case)
    period = 1.0 / frequency if frequency else UNDRIVEN * duration
    settled = float(np.ceil(duration / period - 1e-9) * period)
    step = _step(case, starts, method, dt, period, bool(frequency))
    about = {"method": method, "dt": step, "device": choice("device", device, DEVICES)}
    used = dict[str, str]()
    if device == "auto":
        like = prepare(case, settled, method, step, initial=starts[0], force=True, kept=True)
        device, used["device_reason"] = device_for([like], len(starts), threads)
    how = {**about, "threads": threads, "device": device}
    compute = partial(_ends, case, settled, period, record, how, used)
    about |= {"duration": settled, "period": period, "record": record}
    kept, found = KeptEnds(folder, case, about), list[NDArray]()
    with reported(progress) as report, told_once():
        for k in range(0, len(starts), AT_ONCE):
            some = starts[k : k + AT_ONCE]
            found.append(kept.of(some, partial(compute, some)))
            done = k + len(some)
            report(Progress(float(done), float(len(starts)), done, 0.0))
    ends = np.concatenate(found)
    weights = np.array([1.0, period / (2.0 * np.pi) if frequency else 0.0])
    size = _size(case, starts, ends, weights, same, bool(frequency))
    label, first_of, periods = told_apart(ends, weights, same, size)
    lost = int((label < 0).sum())
    if lost:
        warn(
            f"{lost} of {len(label)} motions do not repeat in {record // 2} periods (basin -1): "
            "chaotic, or not settled yet; a longer duration or record shows which",
            "long-motions.md#basins-of-attraction",
        )
    about |= {"same": same, "wall_seconds": time.perf_counter() - began, **used}
    about["period"] = period if frequency else None
    label = label.reshape([len(values) for values in places])
    along = dict(zip(names, places, strict=True))
    return _dataset(case, along, label, periods, ends[first_of], about)


def _dataset(
    case: Case, grid: Mapping[str, NDArray], label: NDArray, periods: Sequence[int],
    states: NDArray, facts: Mapping[str, Any],
) -> xarray.Dataset:  # fmt: skip
    """The result; states (attractor, record, 2, n, 3)."""
    share = np.bincount(label[label >= 0], minlength=len(periods)) / label.size
    along, text = ("attractor", "record", *PLACE), "periods of the drive after which it repeats"
    data = {
        "basin": variable(tuple(grid), label, "", "attractor"),
        "periods": variable(("attractor",), np.array(periods, int), "1", text),
        "share": variable(("attractor",), share, "1", "share of the starts"),
        "displacement": variable(along, states[:, :, 0], "m", "displacement once a period"),
        "velocity": variable(along, states[:, :, 1], "m/s", "velocity once a period"),
    }
    coordinates = {name: variable((name,), values, "", name) for name, values in grid.items()}
    return result_dataset("basins", case, data, coordinates, facts)


def _grid(grid: Any, nodes: int) -> tuple[tuple[str, ...], list[NDArray[np.float64]]]:
    """Names and values of the parameters; checks that there is memory for all starts."""
    if not isinstance(grid, Mapping) or not grid:
        raise InputError(f" = {show(grid)}: give values by name, {{'height': [0.0, 0.1]}}", "grid")
    places = []
    for name, given in grid.items():
        if not isinstance(name, str) or not name.isidentifier():
            raise InputError(f": {name!r} cannot be the name of an argument", "grid")
        if name in TAKEN:
            raise InputError(
                f": {name!r} is a name in the result; give the parameter another one", "grid"
            )
        values = numbers(f"grid.{name}", given)
        if values.ndim != 1 or not values.size:
            raise InputError(": must be a list of numbers", f"grid.{name}")
        places.append(values)
    count = math.prod(map(len, places))
    check_memory("grid", f"a grid of {count:g} starts", count * nodes * BYTES, "take a coarser one")
    return tuple(grid), places


def _starts(
    case: Case, initial: Any, names: tuple[str, ...], places: Sequence[NDArray]
) -> list[State]:
    """State at each point of the grid, the last parameter running fastest."""
    if not callable(initial):
        raise InputError(f" = {show(initial)}: must be a function that gives a State", "initial")
    starts = []
    for point in itertools.product(*(values.tolist() for values in places)):
        given = dict(zip(names, point, strict=True))
        try:
            start = initial(**given)
        except Exception as error:
            raise InputError(
                f": raised {type(error).__name__} at {given}: {error}", "initial"
            ) from error
        start = of_kind("initial", start, State)
        start.of_nodes("displacement", case.structure.nodes.shape)
        starts.append(start)
    return starts


def _step(
    case: Case, starts: Sequence[State], method: str, dt: float | None, period: float, driven: bool
) -> float:
    """Step (s) of the motions, which divides the period; see `dt` in `basins`."""
    if dt is None:
        longest = period / PER_PERIOD if driven else np.inf
        some = starts[:: -(-len(starts) // LOOKED_AT)]
        dt = min(step_of(case, method, start, longest) for start in some)
        if not np.isfinite(dt):
            raise InputError(": nothing limits the step (no stiffness); give dt", "dt")
    return divisor(period, dt)


def _ends(
    case: Case, settled: float, period: float, record: int, how: Mapping[str, Any],
    used: dict[str, str], starts: Sequence[State],
) -> NDArray[np.float64]:  # fmt: skip
    """States (m, record, 2, n, 3) of settled motions, one per period.

    used : receives the name of the device that computed the motions, as "device".
    """
    count = len(starts)
    before = simulate_many([case] * count, settled, interval=settled, initial=starts, **how)
    used["device"] = before.attrs["device"]
    out = np.full((count, record, 2, *case.structure.nodes.shape), np.nan)
    sound = np.flatnonzero(before.outcome.values == "done")
    if not len(sound):
        return out
    later = [initial_state(before.isel(model=k)) for k in sound]
    span = (record - 1) * period
    after = simulate_many(
        [case] * len(sound), span, interval=period, initial=later, start=settled, **how
    )
    out[sound, :, 0] = after.displacement.values
    out[sound, :, 1] = after.velocity.values
    return out


def _size(
    case: Case, starts: Sequence[State], ends: NDArray, weights: NDArray, same: float, driven: bool
) -> float:
    """Length scale (m) for comparing states: the range of the end states.

    If there is no drive, or all motions end in one attractor, the starts also set the scale.
    """
    shape = case.structure.nodes.shape
    first = [[one.of_nodes(name, shape) for name in ("displacement", "velocity")] for one in starts]
    every = np.concatenate([ends, np.array(first)[:, None]], axis=1) * weights[:, None, None]
    every = every[np.isfinite(ends).all(axis=(1, 2, 3, 4))]
    if not len(every):
        return 0.0
    size = float(np.ptp(every[:, :-1, 0], axis=(0, 1)).max())
    widest = float(np.ptp(every, axis=(0, 1)).max())
    if not driven or size < same * widest:
        size = widest
    return max(size, LEAST * case.body.sheet.longest())


def told_apart(
    ends: NDArray[np.float64], weights: NDArray[np.float64], same: float, size: float
) -> tuple[NDArray[np.int64], list[int], list[int]]:
    """Attractor of each motion (m,), and for each attractor one motion and the periods.

    ends : states (m, record, 2, n, 3), one per period.
    weights : weights of displacement and velocity in a distance.
    same : distance below which states are equal, relative to `size` (m).
    """
    states = (ends * weights[:, None, None]).reshape(*ends.shape[:2], -1)
    label = np.full(len(states), -1)
    kept: list[int] = []
    periods: list[int] = []
    for k, own in enumerate(states):
        repeats = repeats_after(own, same * size) if np.isfinite(own).all() else 0
        if not repeats:
            continue
        for number_, other in enumerate(kept):
            if periods[number_] == repeats and any(
                np.abs(own[:repeats] - np.roll(states[other][:repeats], turn, axis=0)).max()
                <= same * size
                for turn in range(repeats)
            ):
                label[k] = number_
                break
        else:
            label[k] = len(kept)
            kept.append(k)
            periods.append(repeats)
    return label, kept, periods


class KeptEnds:
    """Stored end states of motions, one file per batch.

    Parameters
    ----------
    folder : path or None
        Folder of the files; None stores nothing.
    case : Case
    how : mapping
        Everything else on which the ends depend, as JSON data.

    Raises
    ------
    InputError
        The case cannot be written to a file, so that stored ends could belong to another case.
    """

    def __init__(
        self, folder: str | os.PathLike[str] | None, case: Case, how: Mapping[str, Any]
    ) -> None:
        self._folder = None
        if folder is None:
            return
        if not isinstance(folder, str | os.PathLike):
            raise InputError(f" = {show(folder)}: give the path of a folder", "folder")
        document = to_document(case)
        if document.obstacles:
            raise InputError(
                f": this case cannot be stored: {document.obstacles[0]}; leave folder out", "folder"
            )
        arrays = {name: _digest([array]) for name, array in document.arrays.items()}
        self._about = {
            "program": program("attractors"), "case": document.sections, "arrays": arrays, **how,
        }  # fmt: skip
        self._folder = writing.made_folder(folder)

    def of(self, starts: Sequence[State], compute: Callable[[], NDArray]) -> NDArray[np.float64]:
        """Ends of motions from some starts, stored or computed."""
        if self._folder is None:
            return compute()
        numbers = []
        for one in starts:
            numbers += [one.displacement, one.velocity, one.origin and one.origin.displacement]
        about = json.loads(json.dumps({**self._about, "starts": _digest(numbers)}, default=str))
        name = name_of(about)
        file = self._folder / f"{name}.npz"
        found = _KEPT.find(file, name)
        if found is None:
            found = compute()
            _KEPT.keep(file, name, found)
        return found


def _digest(arrays: Sequence[Any]) -> str:
    """Digest of arrays, some of which may be None."""
    found = hashlib.sha256()
    for array in arrays:
        values = np.zeros(0) if array is None else np.ascontiguousarray(array)
        found.update(f"{values.dtype}{values.shape}".encode() + values.tobytes())
    return found.hexdigest()


def _read(file: Path) -> tuple[str, NDArray[np.float64]]:
    if not sound(file):
        raise ValueError
    with np.load(file) as kept:
        return str(kept["stamp"]), kept["ends"]


def _write(file: Path, stamp: str, ends: NDArray[np.float64]) -> None:
    with writing.whole(file) as part:
        np.savez(part, stamp=np.array(stamp), ends=ends)
        seal(part)


_KEPT: Store[NDArray[np.float64]] = Store(_read, _write, warns=False)
