"""`sweep`: compute a case file for many values of its keys, and collect measures in a dataset."""

from __future__ import annotations

import os
import pickle
import re
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np
import tomli_w
import xarray as xr
from numpy.typing import NDArray

from foldyn.analyses.keys import parts
from foldyn.analyses.motion import MotionComputation
from foldyn.cases.units import unit_of
from foldyn.dynamics.gpu.choice import choose
from foldyn.dynamics.motion import Motion
from foldyn.errors import InputError, Told
from foldyn.results.stored_case import CASE_VARIABLES
from foldyn.results.sweep_dataset import POINT, sweep_dataset
from foldyn.sweeps.evaluations import Evaluation, Evaluations
from foldyn.sweeps.job import Job
from foldyn.sweeps.measure import Asked, Measure
from foldyn.sweeps.plan import Plan, plan_of
from foldyn.sweeps.points import GRID, Point
from foldyn.sweeps.pool import Here, Pool, pool_of
from foldyn.threads import processors
from foldyn.values import show, whole

MOST_PROCESSES = 1024
"""Most parallel processes; a larger number is a typing error."""

PREPARING = 0.05
"""Seconds that a core needs to read a point's file, check its motion and measure the result."""

Measures = Sequence[str | Measure | Callable[..., Any]] | Mapping[str, Callable[..., Any]]


@dataclass(frozen=True)
class Course:
    """Progress of a sweep.

    Attributes
    ----------
    done, found, failed, total : int
        Number of finished points, of finished points that were found in the folder, of failed
        points, and of all points.
    seconds : float
        Time (s) since the start.
    left : float
        Remaining time (s) at the pace so far; nan while unknown.
    """

    done: int
    found: int
    failed: int
    total: int
    seconds: float
    left: float


ABOUT: Mapping[str, str] = {
    "failure": "why the point lacks values",
    "warnings": "what was warned of",
    "seconds": "computing time",
}
"""Variables that the dataset has for every point, in addition to measures."""


def names_of(keys: Sequence[str], taken: Sequence[str]) -> list[str]:
    """Short names of keys: the last word of each key, or all its words if that is not unique."""
    short = [_last(key) for key in keys]
    counts = Counter([*short, *taken, *ABOUT, *CASE_VARIABLES, POINT, "case_file", "node", "axis"])
    return [
        name if counts[name] == 1 else re.sub(r"\W+", "_", key).strip("_")
        for key, name in zip(keys, short, strict=True)
    ]


def _last(key: str) -> str:
    """Last word of a key, with the indices after it: "force_2" for "loads[0].force[2]"."""
    words = parts(key)
    start = max(k for k, word in enumerate(words) if isinstance(word, str))
    return "_".join(map(str, words[start:]))


def dataset(plan: Plan, found: Sequence[Evaluation], facts: Mapping[str, Any]) -> xr.Dataset:
    """Dataset of a sweep.

    Parameters
    ----------
    plan : Plan
    found : sequence of Evaluation
        Evaluations of the plan's points.
    facts : mapping
        Attributes.
    """
    measures = plan.job.measures
    own = [dim for one in measures for dim in one.measure.dims]
    names = names_of(plan.job.keys, [*own, *(one.name for one in measures)])
    on_grid = plan.method == GRID
    dims = tuple(names) if on_grid else (POINT,)
    shape = tuple(len(one.values) for one in plan.varied) if on_grid else (len(found),)
    coordinates: dict[str, Any] = {} if on_grid else {POINT: np.arange(len(found))}
    for k, (name, one) in enumerate(zip(names, plan.varied, strict=True)):
        values = one.values if on_grid else [point[k] for point in plan.points]
        word = one.key.rpartition(".")[2]
        about = {"key": one.key, "long_name": name.replace("_", " ")}
        unit = unit_of(word, values[0])
        about |= {"units": unit} if unit else {}
        coordinates[name] = (name if on_grid else POINT, np.array(values), about)
    data: dict[str, Any] = {}
    checked = list(found)
    for one in measures:
        array, checked = _stacked(one, checked)
        inner = one.measure.dims or tuple(f"{one.name}_{k}" for k in range(array.ndim - 1))
        where = [f"{what} {value}" for what, value in one.arguments.items()]
        text = ", ".join([one.measure.doc or one.name, *where])
        about = {"units": one.measure.units, "long_name": text, "measure": one.text}
        about = {key: text for key, text in about.items() if text}
        along = {dim: 1 + np.arange(n) for dim, n in zip(inner, array.shape[1:], strict=True)}
        values = array.reshape(*shape, *array.shape[1:])
        # the dataset pads measures of one dimension to a common length
        data[one.name] = xr.DataArray(values, along, (*dims, *inner), attrs=about)
    for name, text in ABOUT.items():
        array = np.array([getattr(one, name) for one in checked]).reshape(shape)
        units = {"units": "s"} if name == "seconds" else {}
        data[name] = (dims, array, {"long_name": text, **units})
    text = tomli_w.dumps({**plan.job.document, "sweep": plan.section})
    data["case_file"] = ((), text, {"long_name": "the case file (TOML), with its sweep"})
    failed = sum(bool(one.failure) for one in checked)
    facts = {
        "kind": plan.case_file.analysis.kind, "method": plan.method, "points": len(found),
        "failed": failed, "program": plan.job.program,
        "model_choice": plan.case_file.choice.told or None, **facts,
    }  # fmt: skip
    if not on_grid:
        facts |= {"samples": plan.count, "seed": plan.seed}
    return sweep_dataset(plan.case_file.case(), data, coordinates, facts)


def _stacked(one: Asked, found: list[Evaluation]) -> tuple[NDArray[np.float64], list[Evaluation]]:
    """Values of a measure at all points, padded with nan, and evaluations with its failures."""
    there = [point.values[one.name] for point in found if one.name in point.values]
    depth = len(one.measure.dims) or (there[0].ndim if there else 0)
    fitting = [value for value in there if value.ndim == depth]
    longest = tuple(max((v.shape[k] for v in fitting), default=0) for k in range(depth))
    stacked = np.full((len(found), *longest), np.nan)
    checked = list(found)
    for k, point in enumerate(found):
        value = point.values.get(one.name)
        if value is None:
            continue
        if value.ndim != depth:
            why = f"{one.text}: has {value.ndim} dimensions here, {depth} elsewhere"
            checked[k] = replace(point, failure="; ".join(filter(None, (point.failure, why))))
            continue
        stacked[(k, *map(slice, value.shape))] = value
    return stacked, checked


def sweep(
    case: str | os.PathLike[str],
    vary: Mapping[str, Any] | None = None,
    *,
    measures: Measures | None = None,
    samples: int | None = None,
    method: str | None = None,
    seed: int | None = None,
    ties: Mapping[str, str] | None = None,
    processes: int | None = None,
    scheduler: str | None = None,
    folder: str | os.PathLike[str] | None = None,
    progress: Callable[[Course], None] | None = None,
    device: str | None = None,
) -> xr.Dataset:
    """Compute a case file for many values of its keys, and measure each result.

    Parameters
    ----------
    case : path
        A case file of any kind. Arguments that are not given come from its [sweep] table.
    vary : mapping, optional
        Keys of the case file, each with a list of values, or with a text: ``"1:5:9"`` (9 values
        from 1 to 5) or ``"1e-3:1:7:log"``; with `samples`, ``"1:5"`` or ``"1e-3:1:log"``. This
        argument replaces the whole [sweep] table except the measures in it.
    measures : sequence or mapping, optional
        Names of measures with their arguments, such as ``"peak_frequency[8]"``; functions of a
        result and its case that return a number or an array; or `Measure` objects. A mapping gives
        names to functions.
    samples : int, optional
        Draw this many points instead of all combinations of values; with "saltelli" (2 + number of
        keys) times as many.
    method : {"latin_hypercube", "sobol", "saltelli"}, optional
        Sampling method: a Latin hypercube by default, a Sobol sequence, or a design for Sobol
        indices.
    seed : int, optional
        Random seed of the samples, 0 by default.
    ties : mapping of str to str, optional
        Keys that depend on other keys, such as
        ``{"model.fold_law.theta2": "360 - model.fold_law.theta1"}``.
    processes : int, optional
        Number of parallel processes, by default one per processor; 1 means this process.
    scheduler : str, optional
        Address of a Dask scheduler; its workers then compute, instead of this machine.
    folder : path, optional
        Folder that keeps every point, so that an interrupted sweep can resume.
    progress : callable, optional
        Called with a `Course` after every point.
    device : {"auto", "cpu", "gpu"}, optional
        Device for motions, by default the device in the file, or else "auto": in batches on a GPU
        if there is one, if it has the kernels, and if it should be faster.

    Returns
    -------
    xarray.Dataset
        A variable for each measure. For a grid, dimensions are named by the last words of the keys;
        for samples, the dimension is ``point``. Values of the keys are coordinates. For each point,
        `failure` is the reason for missing values (nan), `warnings` holds warnings, and `seconds`
        is the computing time. The attribute `device` names the device of the motions; for "auto",
        `device_reason` explains the choice.

    Warns
    -----
    FoldynWarning
        At the end, each kind of warning is issued once, with the points at which it occurred.

    Raises
    ------
    InputError
        A key, range or measure cannot be used, the unchanged case file is invalid, or it cannot
        hold one of the values. It is raised before anything is computed.
    ComputationError
        The connection to the cluster was lost. Stored points remain.

    Notes
    -----
    Valid values may still give an invalid case or a failing computation. Then only these points
    fail, each with its reason; all other points are computed. A measure that fails does not affect
    other measures of the same point.
    """
    plan = plan_of(case, vary, measures, samples, method, seed, ties, device)
    return swept(plan, processes, scheduler, folder, progress)


def swept(
    plan: Plan,
    processes: int | None = None,
    scheduler: str | None = None,
    folder: str | os.PathLike[str] | None = None,
    progress: Callable[[Course], None] | None = None,
) -> xr.Dataset:
    """Run a plan; arguments as in `sweep`."""
    job, points = plan.job, plan.points
    if processes is not None:
        whole("processes", processes, least=1, most=MOST_PROCESSES)
    count = min(processes or processors(), len(set(points)))
    device, about = _device(plan, count, scheduler)
    if device == "gpu":
        count = 1
    if count > 1 and scheduler is None:
        _check_sendable(job)
    follow = _Follow(len(set(points)), progress)
    chosen: Pool[Point, Evaluation] = pool_of(job, count, scheduler)
    if device == "gpu" and isinstance(plan.compute, MotionComputation):
        chosen = SideBySide(job, plan.compute.motion)
    with chosen as pool:
        found = Evaluations[Point](pool, job.stamp, folder, follow).at(points, _lost, first=True)
    _tell(plan, found)
    facts = {"wall_seconds": time.perf_counter() - follow.began, "processes": count, **about}
    return dataset(plan, found, facts)


AT_ONCE = 512
"""Most motions in a batch; this many are enough for a GPU's full speed."""
ROOM = 2.0**31
"""Most bytes for the samples of a batch."""


class SideBySide(Here[Point, Evaluation]):
    """A pool for points that are motions.

    Parameters
    ----------
    job : Job
        Job whose points are motions. Points without a GPU kernel, or that fail on the GPU, run on
        the CPU.
    like : Motion
        One of the motions, from which the memory for samples is estimated.
    """

    def __init__(self, job: Job, like: Motion) -> None:
        super().__init__(job)
        self.job = job
        size = 16.0 * like.expected_samples * like.case.body.size  # bytes
        self.count = int(max(1, min(AT_ONCE, ROOM / size)))

    def each(
        self, items: Iterable[Point], keep: Callable[[Point, Evaluation], None],
        lost: object = None, first: bool = False,
    ) -> None:  # fmt: skip
        """Compute items in batches."""
        from foldyn.dynamics.gpu.many import integrate_prepared

        left = iter(items)
        while some := list(islice(left, self.count)):
            begun = [(point, self.job.begun(point)) for point in some]
            moving = [one.compute for _, one in begun if isinstance(one.compute, MotionComputation)]
            for k in integrate_prepared([compute.motion for compute in moving]):
                moving[k].integrated = True
            while begun:  # frees the memory of each motion's samples
                point, one = begun.pop(0)
                keep(point, one.finished())


def _tell(plan: Plan, found: Sequence[Evaluation]) -> None:
    """Issue each kind of warning once, with the points at which it occurred."""
    told, names = Told(), [one.key.rpartition(".")[2] for one in plan.varied]
    for point, one in zip(plan.points, found, strict=True):
        values = (f"{name} = {show(value)}" for name, value in zip(names, point, strict=True))
        told.add_kept(one.warnings, " and ".join(values))
    told.issue()


def _device(plan: Plan, cores: int, scheduler: str | None) -> tuple[str, dict[str, str]]:
    """Device for the points, "cpu" or "gpu", and attributes that record it."""
    if not isinstance(plan.compute, MotionComputation):
        return "cpu", {}
    device, motion, why = plan.device, plan.compute.motion, ""
    if scheduler is not None:
        if device == "gpu":
            raise InputError(
                ' = "gpu": workers of a cluster compute on processors; leave scheduler out',
                "device",
            )
        device = "cpu"
    if device == "auto":
        device, why = choose([motion], len(set(plan.points)), cores, PREPARING)
    name = device
    if device == "gpu":
        from foldyn.dynamics.gpu import card

        name = card.name()
    return device, {"device": name} | ({"device_reason": why} if why else {})


def _lost(point: Point, reason: str) -> Evaluation:
    return Evaluation(failure=reason, lasting=False)


class _Follow:
    """Counts points as they finish."""

    def __init__(self, total: int, progress: Callable[[Course], None] | None) -> None:
        self.total, self.progress = total, progress
        self.began = self.first = time.perf_counter()
        self.done = self.found = self.failed = 0

    def __call__(self, point: Point, one: Evaluation, found: bool) -> None:
        now = time.perf_counter()
        self.done += 1
        self.found += found
        self.failed += bool(one.failure)
        computed = self.done - self.found
        if computed == 1:
            self.first = now  # the first point compiles kernels while others wait
        pace = (now - self.first) / (computed - 1) if computed > 1 else float("nan")
        if self.progress is not None:
            left = pace * (self.total - self.done)
            spent = now - self.began
            self.progress(Course(self.done, self.found, self.failed, self.total, spent, left))


def _check_sendable(job: Job) -> None:
    """Refuse functions that cannot be sent to other processes."""
    for one in job.measures:
        try:
            pickle.dumps(one.measure.function)
        except Exception as error:  # pickle may raise anything
            raise InputError(
                f": {one.text} cannot be sent to other processes ({error}); define the function at "
                "the top of a module, or compute with processes=1",
                "measures",
            ) from None
