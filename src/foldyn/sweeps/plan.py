"""The plan of a sweep, completely checked before anything runs."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from foldyn.analyses import CaseFile
from foldyn.analyses.casefile import Compute
from foldyn.analyses.keys import parts
from foldyn.analyses.model_choice import bound
from foldyn.analyses.motion import MotionAnalysis
from foldyn.analyses.ranges import Varied
from foldyn.analyses.reading import case_of_document, read_document, validated
from foldyn.analyses.sections import Choice, SweepSection
from foldyn.cases.models import BARS_AND_HINGES
from foldyn.dynamics.gpu.choice import DEVICES
from foldyn.errors import Faults, InputError, within
from foldyn.input_files import path_of
from foldyn.sweeps.job import ASIDE, Job, this_program
from foldyn.sweeps.measure import Asked, Measure, asked, of_callable
from foldyn.sweeps.measures import MEASURES
from foldyn.sweeps.points import GRID, Point, grid, samples
from foldyn.tables import read, told
from foldyn.values import choice, listed, show

MASS = "model.mass"


@dataclass(frozen=True, eq=False)
class Plan:
    """A checked sweep.

    Attributes
    ----------
    case_file : CaseFile
        The unchanged file.
    varied : tuple of Varied
    method : str
        "grid", or the sampling method.
    count : int
        Number of samples, or of base samples for Sobol indices; 0 for a grid.
    seed : int
    points : list of tuple
        Values of the keys at each point, in the order of `varied`.
    job : Job
    compute : callable
        The computation of the unchanged file.
    device : str
        Where motions are computed: "cpu", "gpu", or "auto".
    """

    case_file: CaseFile
    varied: tuple[Varied, ...]
    method: str
    count: int
    seed: int
    points: list[Point]
    job: Job
    compute: Compute
    device: str = "auto"

    @property
    def section(self) -> dict[str, Any]:
        """The equivalent [sweep] table."""
        table: dict[str, Any] = {}
        if self.method != GRID:
            table = {"samples": self.count, "method": self.method, "seed": self.seed}
        if self.job.ties:
            table["ties"] = {tie.key: tie.expression for tie in self.job.ties}
        table["measures"] = [one.text for one in self.job.measures]
        table["vary"] = {one.key: _written(one) for one in self.varied}
        return table


def _written(one: Varied) -> Any:
    if one.values:
        return list(one.values)
    return f"{one.lower!r}:{one.upper!r}{':log' if one.log else ''}"


def plan_of(
    case: str | os.PathLike[str],
    vary: Mapping[str, Any] | None,
    measures: Sequence[Any] | Mapping[str, Any] | None,
    count: int | None,
    method: str | None,
    seed: int | None,
    ties: Mapping[str, str] | None,
    device: str | None = None,
) -> Plan:
    """Check the arguments of `foldyn.sweep`; raises `InputError`."""
    path = path_of(case, "case")
    document, device = _with_device(read_document(path), device)
    case_file = case_of_document(path, document)
    table = case_file.sweep
    if measures is None and table is not None:
        measures = table.measures
    if vary is not None:
        chosen = _chosen(vary, count, method, seed, ties)
    elif table is not None:
        given = {"samples": count, "method": method, "seed": seed, "ties": ties}
        changed = {key: value for key, value in given.items() if value is not None}
        own = {**document["sweep"], **changed}
        chosen = validated(path, {**document, "sweep": own}).sweep if changed else table
    else:
        raise InputError(": missing; name what to vary, here or in a table [sweep]", "vary", path)
    sampled = chosen.samples is not None
    keys = _with_masses(chosen.vary, case_file, sampled)
    how = chosen.samples or 0, chosen.method, chosen.seed
    points = samples(keys, *how) if sampled else grid(keys)
    names = tuple(one.key for one in keys)
    if case_file.choice.open and (own := [name for name in names if bound(name)]):
        other = Choice(BARS_AND_HINGES, f"do not have {own[0]}, which varies", open=True)
        case_file = case_of_document(path, document, choice=other)
    job = Job(
        path, document, names, tuple(chosen.ties), _measures(measures), this_program(),
        case_file.choice,
    )  # fmt: skip
    _check_keys(job, keys, points[0])
    faults = Faults()
    for one in job.measures:
        with faults.collected():
            one.check(case_file)
    faults.raise_all()
    compute = case_file.computation().compute  # refuses a file that cannot be computed unchanged
    number, drawn, start = how
    return Plan(
        case_file, keys, drawn if sampled else GRID, number, start, points, job, compute, device
    )  # fmt: skip


def _with_device(document: dict[str, Any], device: str | None) -> tuple[dict[str, Any], str]:
    """The document with the requested device (if it computes motions), and the device."""
    if device is not None:
        choice("device", device, DEVICES)
    section = document.get("analysis")
    if not isinstance(section, dict) or section.get("kind") != MotionAnalysis.kind:
        if device == "gpu":
            raise InputError(' = "gpu": only motions are computed on a GPU; leave it out', "device")
        return document, "cpu"
    own = device or section.get("device", "auto")
    given = {} if device is None else {"device": "gpu" if device == "gpu" else "cpu"}
    return {**document, "analysis": section | given}, own


def _chosen(
    vary: Mapping[str, Any], count: int | None, method: str | None, seed: int | None,
    ties: Mapping[str, str] | None,
) -> SweepSection:  # fmt: skip
    """Build a [sweep] table from arguments."""
    if count is None and (method is not None or seed is not None):
        raise InputError(
            ": is for samples only; give samples too, or leave it out for a grid",
            "method" if method is not None else "seed",
        )
    given = {"samples": count, "method": method, "seed": seed, "vary": vary, "ties": ties}
    try:
        return read(SweepSection, "", {key: one for key, one in given.items() if one is not None})
    except InputError as error:
        raise told(error, None) from None


def _with_masses(
    keys: tuple[Varied, ...], case_file: CaseFile, sampled: bool
) -> tuple[Varied, ...]:
    """Add the file's mass rules to the keys, if it lists several."""
    masses = case_file.masses
    if len(masses) == 1 or any(one.key == MASS for one in keys):
        return keys
    if sampled:
        raise InputError(
            f" lists {len(masses)} rules, and samples would not tell them apart: name one of them",
            MASS,
            case_file.path,
        )
    return (*keys, Varied(MASS, tuple(masses)))


def _measures(wanted: Sequence[Any] | Mapping[str, Any] | None) -> tuple[Asked, ...]:
    """Measures from names, functions or a mapping; refuse an empty list, and repeated names."""
    if isinstance(wanted, str) or callable(wanted):
        wanted = [wanted]
    if wanted is None or not (asked_for := listed("measures", wanted, "measures")):
        raise InputError(
            f": none; give at least one of {', '.join(MEASURES)}, or a function", "measures"
        )
    if isinstance(wanted, Mapping):
        found = [of_callable(name, function) for name, function in wanted.items()]
    else:
        found = [_measure(one, k) for k, one in enumerate(asked_for)]
    names = [one.name for one in found]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f": {name} is asked for twice", "measures")
    return tuple(found)


def _measure(one: Any, k: int) -> Asked:
    if isinstance(one, Asked):
        return one
    if isinstance(one, Measure):
        return Asked(one.name, one, {}, one.name)
    if callable(one):
        name = getattr(one, "__name__", show(one))
        if name == "<lambda>":
            raise InputError(
                ': a function without a name; give it one, as in {"tip": function}', "measures"
            )
        return of_callable(name, one)
    with within(f"measures[{k}]"):
        return asked(one, MEASURES)


def _check_keys(job: Job, keys: Sequence[Varied], first: Point) -> None:
    """Before any computation, refuse keys and values that this kind of case file cannot have."""
    names = [*job.keys, *(tie.key for tie in job.ties)]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f": {name} is named twice, to vary or to tie", "vary")
        if parts(name)[0] in ASIDE:
            raise InputError(f": {name} changes no result; leave it out", "vary")
    faults = Faults()
    for k, one in enumerate(keys):
        for value in one.tried():
            point = (*first[:k], value, *first[k + 1 :])
            with faults.collected():
                validated(job.path, job.changed(point))
            if faults.found:
                break
    faults.raise_all()
