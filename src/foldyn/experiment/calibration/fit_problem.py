"""The model of a fit: from values of the parameters to predictions of every measurement."""

from __future__ import annotations

import hashlib
import json
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.analyses import CaseFile
from foldyn.analyses.keys import files_of, replaced, value_at
from foldyn.analyses.reading import case_of_document, read_document, validated
from foldyn.cases import Case
from foldyn.cases.models import SHELL
from foldyn.dynamics.methods import method_of
from foldyn.errors import FoldynWarning, InputError
from foldyn.experiment.calibration.measurement import Measurement
from foldyn.experiment.calibration.modal import ModalParameters, ModeShapes
from foldyn.experiment.calibration.parameters import Parameter, Space, space
from foldyn.experiment.calibration.responses import FrequencyResponse
from foldyn.experiment.camera import Sight
from foldyn.input_files import path_of
from foldyn.program import program
from foldyn.values import listed, show

STEADY = "generalized_alpha"
"""Integrator of a fit where the case file leaves the choice open."""
ASIDE = ("name", "label", "sigma", "held_out", "case", "force")
"""Fields of measurements that do not change what is predicted."""
VIBRATIONS = ("modes", "frf")
"""Analyses whose results are looked at before a search."""
MESH_ORDER = 2
"""Order of a shell's elements."""


@dataclass(frozen=True, eq=False)
class PredictedRun:
    """One path or motion that predicts several measurements.

    Attributes
    ----------
    path : Path
        Its case file.
    document : dict
        Its content, with the changes of these measurements.
    members : tuple of int
        Numbers of the measurements.
    """

    path: Path
    document: dict[str, Any]
    members: tuple[int, ...]

    @property
    def kind(self) -> str:
        """Kind of its analysis."""
        return self.document["analysis"]["kind"]


@dataclass(frozen=True, eq=False)
class Problem:
    """Cases, parameters and measurements of a fit.

    Attributes
    ----------
    path : Path
        The case file.
    document : dict
        Its content.
    space : Space
    measurements : tuple of Measurement
    runs : tuple of PredictedRun
    """

    path: Path
    document: dict[str, Any]
    space: Space
    measurements: tuple[Measurement, ...]
    runs: tuple[PredictedRun, ...]

    def predict(self, values: Sequence[float] | NDArray) -> list[NDArray[np.float64]]:
        """Values that the model gives for each measurement.

        Raises
        ------
        InputError
            The case does not allow these values.
        ComputationError
            A path or motion cannot be computed.
        """
        predicted: dict[int, NDArray[np.float64]] = {}
        for run in self.runs:
            case_file = self.case_file(run, values)
            result = _result(case_file, [self.measurements[i] for i in run.members])
            for i in run.members:
                predicted[i] = self.measurements[i].predicted(result, case_file.case())
        return [predicted[i] for i in range(len(self.measurements))]

    def case_file(self, run: PredictedRun, values: Sequence[float] | NDArray) -> CaseFile:
        """Case file at given values; its warnings were given when it was checked."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FoldynWarning)
            return case_of_document(run.path, replaced(run.document, self.space.changes(values)))

    def result(
        self,
        run: PredictedRun,
        values: Sequence[float] | NDArray,
        members: Sequence[Measurement] | None = None,
    ) -> Any:
        """Path or motion at given values, for its own measurements or others."""
        own = [self.measurements[i] for i in run.members]
        return _result(self.case_file(run, values), members or own)

    def observed(self) -> list[NDArray[np.float64]]:
        """Measured values of each measurement."""
        return [one.observed() for one in self.measurements]

    def digest(self) -> str:
        """Digest of everything that predictions depend on, except the parameters' values."""
        digest = hashlib.sha256(program("experiment").encode())
        names = [self.space.keys, [(tie.key, tie.expression) for tie in self.space.ties]]
        digest.update(json.dumps(names).encode())
        for run in self.runs:
            digest.update(json.dumps(run.document, sort_keys=True, default=str).encode())
            state = self.case_file(run, self.space.column("start")).initial()
            for array in () if state is None else (state.displacement, state.velocity):
                digest.update(b"" if array is None else np.asarray(array).tobytes())
            for file in sorted(files_of(run.document, "initial")):
                there = run.path.parent / file
                digest.update(there.read_bytes() if there.is_file() else b"")
        for one in self.measurements:
            for part in _parts(one):
                array = isinstance(part, np.ndarray)
                digest.update(part.tobytes() if array else repr(part).encode())
        return digest.hexdigest()

    def examine(self, values: Sequence[float] | NDArray) -> None:
        """Refuse values at which vibrations leave open what the measured ones are.

        What an analysis warns of is told, as of a motion or path it is not.
        """
        for run in self.runs:
            if run.kind in VIBRATIONS:
                case_file = self.case_file(run, values)
                members = [self.measurements[i] for i in run.members]
                result = _computed(case_file, members)
                for one in members:
                    one.examine(result, case_file.case())

    def finer(self, values: Sequence[float] | NDArray) -> list[Finer]:
        """The same model with half the time step, and with half the size of a shell's elements."""
        steps: dict[int, dict[str, float]] = {}
        meshes: dict[int, dict[str, float]] = {}
        orders = []
        for k, run in enumerate(self.runs):
            if run.kind == "dynamics":
                motion = self._motion(run, values)
                orders.append(motion.method.order)
                steps[k] = {"analysis.dt": 0.5 * motion.plan.dt}
                steps[k]["output.every"] = 0.5 * motion.plan.interval
            if run.document.get("model", {}).get("kind") == SHELL:
                divisions = self.case_file(run, values).case().structure.options.divisions
                meshes[k] = {"model.divisions": 2 * divisions}
        found = []
        if steps:
            longest = 2.0 * max(one["analysis.dt"] for one in steps.values())
            remedy = f"analysis.dt below {longest:.3g} s"
            half = self._changed(steps)
            quarters = {k: {key: 0.5 * x for key, x in one.items()} for k, one in steps.items()}
            quarter = self._changed(quarters)
            found.append(Finer("time step", remedy, min(orders), half, quarter, 4))
        if meshes:
            most = max(one["model.divisions"] for one in meshes.values())
            remedy, half = f"model.divisions = {most:g}", self._changed(meshes)
            found.append(Finer("mesh", remedy, MESH_ORDER, half, half, 2))
        return found

    def _motion(self, run: PredictedRun, values: Sequence[float] | NDArray) -> Any:
        """The motion that a run computes, before it begins."""
        case_file = self.case_file(run, values)
        return case_file.computation(**_steady(case_file)).compute.motion  # type: ignore[attr-defined]

    def _changed(self, changes: Mapping[int, Mapping[str, float]]) -> Problem:
        runs = [
            replace(run, document=replaced(run.document, changes.get(k, {})))
            for k, run in enumerate(self.runs)
        ]
        return replace(self, runs=tuple(runs))


class Finer(NamedTuple):
    """A problem that is discretized twice as finely as another.

    what : "time step" or "mesh".
    remedy : what a case file would say for it.
    order : with which the error falls.
    proof : one as many times finer as `times`, to prove what the two tell of still finer ones.
    """

    what: str
    remedy: str
    order: int
    problem: Problem
    proof: Problem
    times: int


def problem(
    case: Any,
    measurements: Sequence[Measurement],
    parameters: Sequence[Parameter],
    ties: Mapping[str, str],
) -> Problem:
    """Check the arguments of a fit, and make its model.

    Raises
    ------
    InputError
        One cannot be used: a case file at the values to start from, a measurement that its case
        cannot predict, a parameter that the case file does not have.
    ComputationError
        Modes or a frequency response cannot be computed at the values to start from.
    """
    path = path_of(case, "case")
    document = read_document(path)
    measurements = listed("data", measurements, "measurements")
    if not measurements:
        raise InputError("data: none; give at least one measurement")
    for number, one in enumerate(measurements):
        if not isinstance(one, Measurement):
            raise InputError(f"data[{number}]: got {show(one)}, give a measurement")
    _check_sigmas(measurements)
    _check_keys(path, document, parameters, ties)
    made = Problem(
        path, document, space(document, parameters, ties), tuple(measurements),
        tuple(_runs(path, document, measurements)),
    )  # fmt: skip
    start = made.space.column("start")
    for run in made.runs:
        case_file = case_of_document(run.path, replaced(run.document, made.space.changes(start)))
        for i in run.members:
            _check(measurements[i], case_file)
    made.examine(start)
    fitted = sum(len(one.observed()) - one.absorbed for one in measurements if not one.held_out)
    if fitted < len(parameters):
        raise InputError(
            f"data: {fitted} values that are not held out cannot give {len(parameters)} "
            "parameters; measure more, or fit fewer"
        )
    return made


def _check_keys(
    path: Path, document: dict[str, Any], parameters: Sequence[Parameter], ties: Mapping[str, str]
) -> None:
    """Refuse keys that no case file has, before it is asked what the file says of them."""
    starts = {one.key: one.start for one in parameters if isinstance(one, Parameter)}
    for key, start in (starts | dict.fromkeys(ties)).items():
        if value_at(document, key) is None:
            validated(path, replaced(document, {key: 1.0 if start is None else start}))


def _check_sigmas(measurements: Sequence[Measurement]) -> None:
    fitted = [one for one in measurements if not one.held_out]
    without = [one for one in fitted if one.sigma is None]
    if len(fitted) > 1 and without:
        raise InputError(
            f"{without[0].name}: sigma: missing; several measurements are weighted by the standard "
            "errors of their values, so each needs its own"
        )


def _runs(
    path: Path, document: dict[str, Any], measurements: Sequence[Measurement]
) -> list[PredictedRun]:  # fmt: skip
    """Measurements with the same case and the same changes, together."""
    groups: dict[str, tuple[Path, dict[str, Any], list[int]]] = {}
    for i, one in enumerate(measurements):
        own = path if one.case is None else Path(one.case)
        key = json.dumps([str(own), dict(one.changes)], sort_keys=True, default=str)
        if key not in groups:
            content = document if one.case is None else read_document(own)
            groups[key] = own, replaced(content, one.changes), []
        groups[key][2].append(i)
    return [PredictedRun(own, content, tuple(members)) for own, content, members in groups.values()]


def _check(one: Measurement, case_file: CaseFile) -> None:
    kind = case_file.analysis.kind
    if kind != one.analysis:
        raise InputError(
            f'{one.name}: kind = "{one.kind}" needs a case of kind "{one.analysis}", but '
            f"{case_file.path} is of kind {show(kind)}"
        )
    if kind == "dynamics":
        _steady(case_file)
    one.check(case_file.case(), case_file.analysis.arguments)


def _result(case_file: CaseFile, members: Sequence[Measurement]) -> Any:
    """What a case file asks for, without its warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        return _computed(case_file, members)


def _computed(case_file: CaseFile, members: Sequence[Measurement]) -> Any:
    """What a case file asks for, at the load factors, modes or frequencies that are measured."""
    case, given = case_file.case(), case_file.analysis.arguments
    if case_file.analysis.kind == "dynamics":
        changes: dict[str, Any] = _steady(case_file)
    elif case_file.analysis.kind == "modes":
        counts = [one.count for one in members if isinstance(one, ModeShapes | ModalParameters)]
        changes = {"count": min(max(given["count"], *counts), len(case.free_dofs))}
    elif case_file.analysis.kind == "frf":
        lines = [one.frequency for one in members if isinstance(one, FrequencyResponse)]
        changes = {"frequencies": np.unique(np.concatenate(lines))}
    else:
        changes = {
            "method": "newton", "load_factors": _path(case, members), "first_step": None,
            "until": None, "settings": replace(given["settings"], stability=False),
        }  # fmt: skip
    return case_file.computation(**changes).result()


def _parts(one: Measurement) -> Iterator[Any]:
    """What predictions of a measurement depend on, but for the model."""
    for item in fields(one):
        value = getattr(one, item.name)
        if item.name in ASIDE:
            continue
        if isinstance(value, Measurement):
            yield from _parts(value)
        elif isinstance(value, Sight):
            yield from value
        else:
            yield np.isfinite(value) if item.name == "values" and not one.adapts else value


def _path(case: Case, members: Sequence[Measurement]) -> list[float]:
    """Load factors at which a case is measured; in the order of a test in which creases yield."""
    given = [one.factors(case) for one in members]
    if all(part.law.relaxes for part in case.remembering):
        factors = np.unique(np.concatenate(given))
        return [*factors[factors < 0.0][::-1], *factors[factors >= 0.0]]
    if any(not np.array_equal(one, given[0]) for one in given[1:]):
        raise InputError(
            "data: creases that yield depend on the way, and these measurements have different "
            "ones: give what was measured along one path, or fit them apart"
        )
    return given[0][np.append(True, np.diff(given[0]) != 0.0)].tolist()


def _steady(case_file: CaseFile) -> dict[str, Any]:
    """Arguments of `simulate` for steps that do not depend on the parameters.

    Steps chosen by their error would make the misfit jump between neighboring values.
    """
    given = dict(case_file.analysis.arguments)
    if given["method"] == "auto":
        given["method"] = STEADY
    method = method_of(given["method"])
    if method.adaptive:
        raise InputError(
            f"{case_file.path}: analysis.method = {show(method.name)}: chooses its steps by their "
            "error, which makes a misfit jump; fit with rk4, newmark or generalized_alpha"
        )
    if method.implicit:
        given["tolerance"] = None
        if given["dt"] is None:
            if not isinstance(given["every"], float):
                raise InputError(
                    f"{case_file.path}: analysis.dt: missing; a fit needs fixed steps: give dt, or "
                    "output.every in seconds, which is then the step"
                )
            given["dt"] = given["every"]
    return given
