"""`sweep`: a case file at many values of its keys, measured at each."""

from __future__ import annotations

import os
import pickle
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import xarray as xr

from foldyn.analyses.casefile import Moving
from foldyn.dynamics.gpu.choice import choose
from foldyn.errors import InputError, Told
from foldyn.sweeps.evaluations import Evaluation, Evaluations
from foldyn.sweeps.job import Job
from foldyn.sweeps.measure import Measure
from foldyn.sweeps.plan import Plan, plan_of
from foldyn.sweeps.points import Point
from foldyn.sweeps.pool import Pool, pool_of
from foldyn.sweeps.side_by_side import SideBySide
from foldyn.sweeps.table import dataset
from foldyn.threads import processors
from foldyn.values import show, whole

MOST_PROCESSES = 1024
"""Processes at a time: more are a slip of the finger."""

PREPARING = 0.05
"""Seconds in which a core reads the file of a point, checks its motion and measures it."""

Measures = Sequence[str | Measure | Callable[..., Any]] | Mapping[str, Callable[..., Any]]


@dataclass(frozen=True)
class Course:
    """How far a sweep is.

    Attributes
    ----------
    done, found, failed, total : int
        Points that are there, those of them that were kept from before, those that failed, and
        all there are.
    seconds : float
        Time since the beginning.
    left : float
        Time (s) that the others will take, at the pace so far; nan while it is not known.
    """

    done: int
    found: int
    failed: int
    total: int
    seconds: float
    left: float


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
    """Compute a case file at many values of its keys, and measure each result.

    Parameters
    ----------
    case : path
        A case file of any kind. What is not given here is that of its table [sweep].
    vary : mapping, optional
        Keys of the case file, each with values, or with a text: ``"1:5:9"`` (9 values from 1 to 5),
        ``"1e-3:1:7:log"``, and with `samples` ``"1:5"`` or ``"1e-3:1:log"``. Takes the place of all
        of [sweep] but its measures.
    measures : sequence or mapping, optional
        Names of `foldyn.sweeps.MEASURES` with their arguments, ``"peak_frequency[8]"``; functions
        of a result and its case, which give a number or an array; `Measure` objects. A mapping
        names its functions.
    samples : int, optional
        Draw so many points instead of all combinations; with "saltelli" (2 + keys) times as many.
    method : {"latin_hypercube", "sobol", "saltelli"}, optional
        How: a Latin hypercube by default, a Sobol sequence, or a design for Sobol indices.
    seed : int, optional
        Of the samples, 0 by default.
    ties : mapping of str to str, optional
        Keys that follow others, ``{"model.fold_law.theta2": "360 - model.fold_law.theta1"}``.
    processes : int, optional
        How many points are computed at a time; by default one per processor. 1: in this process.
    scheduler : str, optional
        Address of a Dask scheduler, whose workers compute instead.
    folder : path, optional
        Keeps every point: a sweep that was cut off goes on where it stopped.
    progress : callable, optional
        Called with a `Course` after every point.
    device : {"auto", "cpu", "gpu"}, optional
        Where motions are computed, by default as the file says, else "auto": side by side on a GPU
        where there is one, it has kernels for them, and they should be done sooner.

    Returns
    -------
    xarray.Dataset
        A variable for each measure. Of a grid over dimensions that have the last words of the keys
        as names, of samples over ``point``; values of the keys are coordinates. `failure` says why
        a point lacks values (they are nan), `warnings` what was warned of, and `seconds` how long
        it took. The attribute `device` says where motions were computed, of "auto" with the reason
        (`device_reason`).

    Warns
    -----
    FoldynWarning
        Of each kind once, at the end, with the points.

    Raises
    ------
    InputError
        A key, range or measure cannot be used, the case file is not sound as it is, or it cannot
        hold one of the values. Nothing was computed then.
    ComputationError
        The cluster is gone. Points that were kept are.

    Notes
    -----
    Values that a case file can hold may still not make a case, or not compute: such points fail one
    by one, with their reasons, and the others are computed all the same. A measure that cannot be
    taken of a result leaves the others of its point.
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
    """Compute what was planned; arguments as of `sweep`."""
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
    if device == "gpu" and isinstance(plan.compute, Moving):
        chosen = SideBySide(job, plan.compute.motion)
    with chosen as pool:
        evaluations = Evaluations[Point](pool, job.stamp, folder, follow)
        found = evaluations.at(points, _lost, first=True)
    _tell(plan, found)
    facts = {"wall_seconds": time.perf_counter() - follow.began, "processes": count, **about}
    return dataset(plan, found, facts)


def _tell(plan: Plan, found: Sequence[Evaluation]) -> None:
    """Warn of what points were warned of, of each kind once, with the points."""
    told, names = Told(), [one.key.rpartition(".")[2] for one in plan.varied]
    for point, one in zip(plan.points, found, strict=True):
        values = (f"{name} = {show(value)}" for name, value in zip(names, point, strict=True))
        told.add_kept(one.warnings, " and ".join(values))
    told.issue()


def _device(plan: Plan, cores: int, scheduler: str | None) -> tuple[str, dict[str, str]]:
    """Where points are computed, "cpu" or "gpu", and attributes that say so."""
    if not isinstance(plan.compute, Moving):
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
    """Counts points as they come."""

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
            self.first = now  # it compiles kernels, and others wait for it
        pace = (now - self.first) / (computed - 1) if computed > 1 else float("nan")
        if self.progress is not None:
            left = pace * (self.total - self.done)
            spent = now - self.began
            self.progress(Course(self.done, self.found, self.failed, self.total, spent, left))


def _check_sendable(job: Job) -> None:
    """Refuse functions that other processes cannot have."""
    for one in job.measures:
        try:
            pickle.dumps(one.measure.function)
        except Exception as error:  # pickle raises what it likes
            raise InputError(
                f": {one.text} cannot be sent to other processes ({error}); define the function at "
                "the top of a module, or compute with processes=1",
                "measures",
            ) from None
