"""Results of a design search."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from io import StringIO
from typing import Any

import numpy as np
import xarray as xr

import foldyn
from foldyn.arguments import brief
from foldyn.designs.problem import Problem, Space
from foldyn.designs.search import Row
from foldyn.errors import InputError
from foldyn.results import netcdf
from foldyn.values import show, suggest
from foldyn.writing import plain, target_of, write_json, write_text

PARAMETER, GRADIENT = "parameter_", "gradient_"
"""Prefixes of parameter names in datasets, for values and gradients."""


@dataclass(frozen=True)
class End:
    """End of one search.

    Attributes
    ----------
    search : int
    objective, violation : float
        Values of the best design of this search; nan if no design could be computed. The violation
        is the largest one of all constraints, each relative to the constraint's scale.
    feasible : bool
        Whether the violation is small enough to be accepted.
    evaluations : int
    message : str
        Why the search ended.
    converged : bool
    """

    search: int
    objective: float
    violation: float
    feasible: bool
    evaluations: int
    message: str
    converged: bool


@brief
@dataclass(frozen=True, eq=False)
class Design:
    """The best design found, and the searches; ``design["parameters"]`` is `design.parameters`.

    Attributes
    ----------
    parameters : dict
        Value of each parameter by name: a number, or an array.
    objective : float
        Value of the expression that was minimized or maximized.
    feasible : bool
        Whether all constraints hold, up to the slack.
    constraints : dict of str to float
        Violation of each constraint, in the unit of its sides; 0 if it is within the slack.
    measures : dict of str to float
        All measures of the best design.
    gradient : dict
        Derivatives of the objective with respect to the parameters; empty if not computed.
    ends : tuple of End
        How each search ended.
    history : xarray.Dataset
        A row for each evaluation, see `foldyn.design`.
    evaluations : int
        Number of evaluations of all searches.
    seconds : float
    """

    parameters: dict[str, Any]
    objective: float
    feasible: bool
    constraints: dict[str, float]
    measures: dict[str, float]
    gradient: dict[str, Any]
    ends: tuple[End, ...] = field(repr=False)
    history: xr.Dataset = field(repr=False)
    evaluations: int
    seconds: float

    def __getitem__(self, name: str) -> Any:
        """Attribute by its name."""
        known = list(type(self).__dataclass_fields__)
        if name not in known:
            hint = suggest(name, known) if isinstance(name, str) else ""
            raise InputError(f"{show(name)}: {hint}a design has {', '.join(known)}")
        return getattr(self, name)

    def summary(self) -> dict[str, Any]:
        """All attributes except the history, as JSON types (nan becomes null)."""
        own = {name: value for name, value in vars(self).items() if name not in ("ends", "history")}
        ends = [vars(one) for one in self.ends]
        return plain({"foldyn_version": foldyn.__version__, **own, "ends": ends})

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the best design (``*.json``), or history and best design (``*.nc``, ``*.csv``).

        Raises
        ------
        InputError
            The file name has another ending, or its folder does not exist.
        """
        path = target_of(path)
        if path.suffix == ".json":
            write_json(self.summary(), path)
        elif path.suffix == ".nc":
            netcdf.write(self.history, path)
        elif path.suffix == ".csv":
            columns = dict(_columns(self.history))
            text = StringIO()
            table = csv.writer(text, lineterminator="\n")
            table.writerow(columns)
            table.writerows(zip(*columns.values(), strict=True))
            write_text(text.getvalue(), path)
        else:
            raise InputError(
                f"{path}: a design is written as .json, .nc or .csv; choose one of them"
            )


def _columns(history: xr.Dataset) -> Iterator[tuple[str, list[Any]]]:
    """Name and values of each table column; a value for each evaluation."""
    for name, one in history.items():
        if one.dims[:1] != ("evaluation",):
            continue
        if one.ndim == 1:
            yield str(name), one.values.tolist()
            continue
        for k, label in enumerate(one[one.dims[1]].values.tolist()):
            own = f"{name}[{k}]" if one.dims[1] != "constraint" else label
            yield own, one.values[:, k].tolist()


def history_of(
    rows: Sequence[Row], best: Row, space: Space, problem: Problem, facts: dict[str, Any]
) -> xr.Dataset:
    """Dataset of all evaluations."""
    entries = np.array([row.point for row in rows])
    numbers = np.array([row.numbers for row in rows])
    along = "evaluation"
    about: dict[str, dict[str, str]] = {
        "search": {}, "iteration": {},
        "objective": {"long_name": problem.objective.text},
        "violation": {"long_name": "largest violation, relative to the size of the constraint"},
        "feasible": {}, "seconds": {"units": "s"}, "failure": {}, "warnings": {},
    }  # fmt: skip
    data: dict[str, Any] = {
        name: (along, np.array([getattr(row, name) for row in rows]), text)
        for name, text in about.items()
    }
    data["best"] = (), rows.index(best)
    coordinates: dict[str, Any] = {along: np.arange(len(rows))}
    if problem.constraints:
        told = {"long_name": "left minus right side"}
        data["constraints"] = ((along, "constraint"), numbers[:, 1:], told)
        coordinates["constraint"] = [one.text for one in problem.constraints]
    lowers, uppers = space.parts(space.lower), space.parts(space.upper)
    for name, values in space.parts(entries).items():
        lower, upper = lowers[name], uppers[name]
        array = bool(space.shapes[name])
        dims = (along, f"{name}_entry") if array else (along,)
        one = lower.size == 1 or (np.ptp(lower) == np.ptp(upper) == 0.0)
        bounds: dict[str, Any] = {"lower": lower, "upper": upper}
        bounds = {word: float(end[0]) for word, end in bounds.items()} if one else bounds
        data[f"{PARAMETER}{name}"] = (dims, values if array else values[:, 0], bounds)
        if array:
            coordinates[f"{name}_entry"] = np.arange(lower.size)
    if best.slopes is not None:
        for name, part in space.parts(best.slopes[0]).items():
            dims = (f"{name}_entry",) if space.shapes[name] else ()
            data[f"{GRADIENT}{name}"] = (dims, part if dims else part[0])
    facts = {"foldyn_version": foldyn.__version__, **facts}
    return xr.Dataset(data, coordinates, facts)
