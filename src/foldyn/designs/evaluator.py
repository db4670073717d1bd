"""Measures of a design, and derivatives of the measures with respect to the design's entries."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.analyses import CaseFile
from foldyn.analyses.keys import parts, replaced
from foldyn.analyses.reading import read_document, validated
from foldyn.cases import Case
from foldyn.designs.problem import Space
from foldyn.errors import ComputationError, FoldynError, InputError, Told, within
from foldyn.gradients.measures import derivative_of, one_number
from foldyn.gradients.run_sensitivity import FUNCTIONS, case_file_at, kind_of, sensitivity
from foldyn.input_files import path_of
from foldyn.store import program
from foldyn.sweeps.evaluations import Evaluation
from foldyn.sweeps.job import ASIDE, Job, code_of
from foldyn.sweeps.measure import Asked
from foldyn.values import show

COMPUTING = ("analyses", "results", "sweeps", "gradients", "designs")
"""Folders that evaluations depend on, in addition to the solvers."""
VALUES, JACOBIAN = "value", "jacobian"
Point = tuple[float, ...]
Source = Callable[..., Case] | str | os.PathLike[str]

UNCHECKED = {"check_model": False}  # the designs of a search are not compared one by one


@dataclass(frozen=True, eq=False)
class Measured:
    """Measures of a case from a function or a case file, with exact derivatives.

    Attributes
    ----------
    build : callable or Path
    analysis : dict or None
        Analysis of built cases.
    measures : tuple of Asked
    space : Space
    """

    build: Any
    analysis: dict[str, Any] | None
    measures: tuple[Asked, ...]
    space: Space
    document: dict[str, Any] = field(default_factory=dict)

    @property
    def stamp(self) -> list[Any]:
        """Everything that the measures depend on, as JSON types."""
        texts = [one.text for one in self.measures]
        return [program(*COMPUTING), self._source(), repr(self.analysis), texts]

    def __call__(self, values: Mapping[str, Any], gradient: bool) -> tuple[NDArray, NDArray | None]:
        """Measures (m,) of a design and, on request, derivatives (m, n) with respect to entries."""
        if not gradient:
            result, case, shared = *self._computed(values), dict[Any, Any]()
            return np.array([_single(one, result, case, shared) for one in self.measures]), None
        width = self.space.values(self.space.upper - self.space.lower)
        sizes = {name: width[name] for name, value in values.items() if not np.any(value)}
        texts = [one.text for one in self.measures]
        asked: dict[str, Any] = {"measures": texts, "analysis": self.analysis, "sizes": sizes}
        found = sensitivity(self.build, dict(values), **asked)
        parts = [found[f"gradient_{name}"].values.reshape(len(texts), -1) for name in values]
        return found["value"].values, np.concatenate(parts, axis=1)

    def case(self, values: Mapping[str, Any]) -> Case:
        """Case of a design."""
        return self._file(values).case() if self.document else self.build(**values)

    def result(self, values: Mapping[str, Any]) -> xr.Dataset:
        """Result of a design."""
        return self._computed(values)[0]

    def _computed(self, values: Mapping[str, Any]) -> tuple[xr.Dataset, Case]:
        if self.document:
            file = self._file(values)
            own: dict[str, Any] = UNCHECKED if "check_model" in file.analysis.arguments else {}
            return file.computation(**own).result(), file.case()
        case, arguments = self.build(**values), dict(self.analysis or {})
        if arguments["kind"] in ("modes", "frf", "effective"):
            arguments = {**UNCHECKED, **arguments}
        return FUNCTIONS[arguments.pop("kind")](case, **arguments), case

    def _file(self, values: Mapping[str, Any]) -> CaseFile:
        return case_file_at(self.build, self.document, values)

    def _source(self) -> Any:
        """Source of the case: a function or a file."""
        if not self.document:
            return code_of(self.build)
        return Job(self.build, self.document, (), (), (), "").stamp(())[1:3]


def measured(
    build: Source, analysis: Mapping[str, Any] | None, places: Mapping[str, str], space: Space,
    gradient: bool,
) -> Measured:  # fmt: skip
    """Check the analysis and the measures of designs.

    places : measures, each with the argument that requests it.
    gradient : whether derivatives are needed.

    Raises
    ------
    InputError
        No such analysis, or no such measure of it.
    """
    document: dict[str, Any] = {}
    if isinstance(build, str | os.PathLike):
        if analysis is not None:
            raise InputError(": a case file has its own; leave this out", "analysis")
        build = path_of(build, "build")
        document = read_document(build)
        kind = document.get("analysis", {}).get("kind")
        _check_keys(build, document, space)
    elif callable(build):
        kind, analysis = kind_of(analysis), dict(analysis or {})
    else:
        raise InputError(f" = {show(build)}: give a function or a case file", "build")
    measures = []
    for name, place in places.items():
        with within(place):
            measures.append(one_number(name, kind))
            if gradient:
                derivative_of(measures[-1])
    return Measured(build, analysis, tuple(measures), space, document)


def _check_keys(path: Path, document: Mapping[str, Any], space: Space) -> None:
    """Refuse keys that this kind of case file cannot have, and bounds that it cannot hold."""
    for ends in (space.lower, space.upper):
        for name, part in space.parts(ends).items():
            if parts(name)[0] in ASIDE:
                raise InputError(f": {name} changes no result; leave it out", "bounds")
            value = part.tolist() if space.shapes[name] else float(part[0])
            validated(path, replaced(document, {name: value}))


def _single(one: Asked, result: xr.Dataset, case: Case, shared: dict[Any, Any]) -> float:
    value = one.number(result, case, shared)
    if not np.isfinite(value):
        raise ComputationError(f"{one.text}: has no value")
    return value


@dataclass(frozen=True, eq=False)
class Evaluate:
    """Evaluates points of a space; errors become part of the evaluation."""

    evaluator: Measured
    space: Space
    gradient: bool

    def stamp(self, point: Point) -> list[Any]:
        """Everything that a point's evaluation depends on."""
        shapes = {name: list(shape) for name, shape in self.space.shapes.items()}
        return [self.evaluator.stamp, shapes, list(point), self.gradient]

    def __call__(self, point: Point) -> Evaluation:
        """Evaluate a point."""
        began, values, failure, lasting = time.perf_counter(), {}, "", True
        told = Told()
        with told.noting():
            try:
                value, jacobian = self.evaluator(self.space.values(point), self.gradient)
                values = {VALUES: value} | ({} if jacobian is None else {JACOBIAN: jacobian})
            except FoldynError as error:
                failure = str(error)
            except Exception as error:  # an error in a user's function affects only this point
                failure, lasting = f"{type(error).__name__}: {error}", False
        bad = [name for name, array in values.items() if not np.isfinite(array).all()]
        if bad:
            values, failure = {}, f"gave a {bad[0]} that is not finite"
        return Evaluation(values, failure, told.kept(), time.perf_counter() - began, lasting)
