"""The dataset of a sweep from its evaluations."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import tomli_w
import xarray as xr
from numpy.typing import NDArray

from foldyn.analyses.keys import parts
from foldyn.cases.units import unit_of
from foldyn.results.stored_case import CASE_VARIABLES
from foldyn.results.sweep_dataset import POINT, sweep_dataset
from foldyn.sweeps.evaluations import Evaluation
from foldyn.sweeps.measure import Asked
from foldyn.sweeps.plan import Plan
from foldyn.sweeps.points import GRID

ABOUT: Mapping[str, str] = {
    "failure": "why the point lacks values",
    "warnings": "what was warned of",
    "seconds": "computing time",
}
"""Variables of every point."""


def names_of(keys: Sequence[str], taken: Sequence[str]) -> list[str]:
    """Short names of keys: their last words, or all words if these are not unique."""
    short = [_last(key) for key in keys]
    counts = Counter([*short, *taken, *ABOUT, *CASE_VARIABLES, POINT, "case_file"])
    return [
        name if counts[name] == 1 else re.sub(r"\W+", "_", key).strip("_")
        for key, name in zip(keys, short, strict=True)
    ]


def _last(key: str) -> str:
    """Last word of a key, with the following indices: "force_2" for "loads[0].force[2]"."""
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
        about = {"units": one.measure.units, "long_name": text}
        about |= {"measure": one.text}
        about = {key: text for key, text in about.items() if text}
        data[one.name] = ((*dims, *inner), array.reshape(*shape, *array.shape[1:]), about)
        for dim, length in zip(inner, array.shape[1:], strict=True):
            longest = max(length, len(coordinates.get(dim, ())))
            coordinates[dim] = 1 + np.arange(longest)
    data = _even(data, coordinates)
    for name, text in ABOUT.items():
        array = np.array([getattr(one, name) for one in checked]).reshape(shape)
        units = {"units": "s"} if name == "seconds" else {}
        data[name] = (dims, array, {"long_name": text, **units})
    text = tomli_w.dumps({**plan.job.document, "sweep": plan.section})
    data["case_file"] = ((), text, {"long_name": "the case file (TOML), with its sweep"})
    failed = sum(bool(one.failure) for one in checked)
    facts = {
        "kind": plan.case_file.analysis.kind, "method": plan.method, "points": len(found),
        "failed": failed, "program": plan.job.program, **facts,
    }  # fmt: skip
    if not on_grid:
        facts |= {"samples": plan.count, "seed": plan.seed}
    return sweep_dataset(plan.case_file.case(), data, coordinates, facts)


def _stacked(one: Asked, found: list[Evaluation]) -> tuple[NDArray[np.float64], list[Evaluation]]:
    """Values at all points, padded with nan, and failures due to missing values."""
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


def _even(data: Mapping[str, Any], coordinates: Mapping[str, Any]) -> dict[str, Any]:
    """Pad variables with nan to a common length along each dimension."""
    even = {}
    for name, (dims, array, about) in data.items():
        lengths = [
            len(coordinates[dim]) if isinstance(coordinates[dim], np.ndarray) else array.shape[k]
            for k, dim in enumerate(dims)
        ]
        missing = [(0, length - size) for length, size in zip(lengths, array.shape, strict=True)]
        even[name] = (dims, np.pad(array, missing, constant_values=np.nan), about)
    return even
