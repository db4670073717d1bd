"""The model of a fit: maps parameter values to predictions of every measurement."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.analyses import CaseFile
from foldyn.analyses.keys import files_of, replaced, value_at
from foldyn.analyses.pattern_section import HINGES
from foldyn.analyses.reading import case_of_document, read_document, validated
from foldyn.cases.models import SHELL
from foldyn.errors import FoldynError, InputError, quietly
from foldyn.experiment.calibration import predicted_run
from foldyn.experiment.calibration.measurement import Measurement
from foldyn.experiment.calibration.parameters import Beside, Parameter, Space, space
from foldyn.experiment.calibration.predicted_run import PredictedRun
from foldyn.experiment.camera import Sight
from foldyn.input_files import path_of
from foldyn.store import program
from foldyn.values import listed, show

# Fields of measurements that do not affect predictions.
ASIDE = ("name", "label", "sigma", "held_out", "case", "force")
# Tables of a case file that define its structure.
STRUCTURAL = "pattern", "sheet", "model", "supports"
VIBRATIONS = ("modes", "frf")  # kinds of analysis whose results are checked before a search
MESH_ORDER = 2  # order of convergence of a shell's elements
Predicted = dict[int, NDArray[np.float64]]  # predictions by the number of the measurement


@dataclass(frozen=True, eq=False)
class Problem:
    """Cases, parameters and measurements of a fit.

    Attributes
    ----------
    path : Path
        The case file.
    document : dict
        Content of the case file.
    space : Space
    measurements : tuple of Measurement
    runs : tuple of PredictedRun
    """

    path: Path
    document: dict[str, Any]
    space: Space
    measurements: tuple[Measurement, ...]
    runs: tuple[PredictedRun, ...]

    def predict(
        self, values: Sequence[float] | NDArray, runs: Sequence[int] | None = None
    ) -> list[NDArray[np.float64]]:
        """Predictions for each measurement; nan for measurements whose run is left out.

        Raises
        ------
        InputError
            The case does not allow these values.
        ComputationError
            A path or motion cannot be computed.
        """
        predicted = [np.full(len(one), np.nan) for one in self.observed()]
        for k in range(len(self.runs)) if runs is None else runs:
            for i, own in self._computed(self.runs[k], values).items():
                predicted[i] = own
        return predicted

    def differentiate(
        self, values: NDArray, second: bool = True
    ) -> tuple[list[NDArray], list[NDArray]]:
        """Predictions, and their derivatives (n, p) with respect to the parameters.

        second : whether derivatives have second-order accuracy in the parameter steps.

        Derivatives are nan for runs whose neighbors cannot be computed along with them, and 0 for
        measurements that are not fitted.
        """
        predicted: dict[int, NDArray[np.float64]] = {}
        slopes: dict[int, NDArray[np.float64]] = {}
        for run in self.runs:
            fitted = [i for i in run.members if not self.measurements[i].held_out]
            try:
                own, beside = self._beside(run, values, second, fitted)
            except FoldynError:
                own, beside = self._computed(run, values), None
            predicted |= own
            for i, one in own.items():
                lost = beside is None and i in fitted
                slopes[i] = np.full((len(one), len(values)), np.nan if lost else 0.0)
            for part, there in beside or ():
                for i in fitted:
                    slopes[i][:, part.place] += part.weight * there[i]
        every = range(len(self.measurements))
        return [predicted[i] for i in every], [slopes[i] for i in every]

    def _computed(self, run: PredictedRun, values: Sequence[float] | NDArray) -> Predicted:
        """Predictions of a run at given values."""
        case_file, members = self.case_file(run, values), run.those_of(self.measurements)
        with quietly():
            result = predicted_run.seen(run, case_file, members)
            return self._predicted(result, case_file, run.members)

    def _predicted(
        self, result: xr.Dataset, case_file: CaseFile, members: Sequence[int]
    ) -> Predicted:
        case = case_file.case()
        return {i: self.measurements[i].predicted(result, case) for i in members}

    def _beside(
        self, run: PredictedRun, values: NDArray, second: bool, fitted: Sequence[int]
    ) -> tuple[Predicted, list[tuple[Beside, Predicted]]]:
        """Predictions of a run at given values, and of `fitted` measurements at nearby points.

        Raises
        ------
        FoldynError
            Differences can only be computed from whole runs.
        """
        if not fitted:
            return self._computed(run, values), []
        parts = self.space.differences(values, second)
        points = {tuple(part.point): part.point for part in parts}
        if run.kind not in predicted_run.REFINED:
            points.pop(tuple(values), None)
        with quietly():
            one = self.case_file(run, values)
            like = Like(values, one)
            others = [
                one if np.array_equal(each, values) else self.case_file(run, each, like)
                for each in points.values()
            ]
            members = run.those_of(self.measurements)
            result, found = predicted_run.with_neighbors(run, one, others, members, second)
        own = self._predicted(result, one, run.members)
        beside = {tuple(values): own} | {
            point: self._predicted(there, other, fitted)
            for point, there, other in zip(points, found, others, strict=True)
        }
        return own, [(part, beside[tuple(part.point)]) for part in parts]

    def case_file(
        self, run: PredictedRun, values: Sequence[float] | NDArray, like: Like | None = None
    ) -> CaseFile:
        """Case file at given values; its warnings were already shown when it was checked.

        like : case file at other values, whose structure is reused if it is the same.
        """
        changes = self.space.changes(values)
        of_pattern = [key for key in changes if key.startswith("pattern")]
        fixed = HINGES not in run.document["pattern"] and not of_pattern
        pattern = run.patterns[0] if fixed and run.patterns else None
        structures = None
        if like is not None:
            before = self.space.changes(like.values)
            moved = [key for key, value in changes.items() if value != before[key]]
            if not any(key.startswith(STRUCTURAL) for key in moved):
                structures = like.case_file.structures
        with quietly():
            document = replaced(run.document, changes)
            made = case_of_document(
                run.path, document, pattern=pattern, structures=structures,
                choice=run.choices[0] if run.choices else None,
            )  # fmt: skip
        if fixed and not run.patterns:
            run.patterns.append(made.pattern)
        return made

    def result(
        self,
        run: PredictedRun,
        values: Sequence[float] | NDArray,
        members: Sequence[Measurement] | None = None,
    ) -> Any:
        """Result of a run at given values, for the measurements of the run or for `members`."""
        case_file = self.case_file(run, values)
        with quietly():
            own = members or run.those_of(self.measurements)
            return predicted_run.computed(run, case_file, own)

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
            state = run.start(self.case_file(run, self.space.column("guess")))
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
        """Refuse parameter values at which the measured modes cannot be identified in the model.

        Warnings of the analysis are shown here; warnings of motions or paths are not.
        """
        for run in self.runs:
            if run.kind in VIBRATIONS:
                case_file = self.case_file(run, values)
                members = run.those_of(self.measurements)
                result = predicted_run.computed(run, case_file, members)
                for one in members:
                    one.examine(result, case_file.case())

    def finer(self, values: Sequence[float] | NDArray) -> list[Finer]:
        """The same model with half the time step, and with half the element size of a shell."""
        steps: dict[int, dict[str, float]] = {}
        meshes: dict[int, dict[str, float]] = {}
        orders = []
        for k, run in enumerate(self.runs):
            if run.kind == "dynamics":
                motion = predicted_run.motion_of(run, self.case_file(run, values))
                orders.append(motion.method.order)
                steps[k] = {"analysis.dt": 0.5 * motion.plan.dt}
                if "every_steps" not in run.document.get("output", {}):
                    steps[k]["output.interval"] = 0.5 * motion.plan.interval
            if run.document.get("model", {}).get("kind") == SHELL:
                divisions = self.case_file(run, values).case().structure.options.divisions
                meshes[k] = {"model.divisions": 2 * divisions}
        found = []
        if steps:
            longest = 2.0 * max(one["analysis.dt"] for one in steps.values())
            remedy = f"analysis.dt below {longest:.3g} s"
            half = self._changed(steps)
            quarters = {k: {key: 0.5 * x for key, x in one.items()} for k, one in steps.items()}
            found.append(Finer("time step", remedy, min(orders), half, self._changed(quarters), 4))
        if meshes:
            most = max(one["model.divisions"] for one in meshes.values())
            remedy, half = f"model.divisions = {most:g}", self._changed(meshes)
            found.append(Finer("mesh", remedy, MESH_ORDER, half, half, 2))
        return found

    def _changed(self, changes: Mapping[int, Mapping[str, float]]) -> Problem:
        runs = [
            replace(run, document=replaced(run.document, changes.get(k, {})))
            for k, run in enumerate(self.runs)
        ]
        return replace(self, runs=tuple(runs))


class Like(NamedTuple):
    """A case file, and the parameter values with which it was made."""

    values: NDArray[np.float64]
    case_file: CaseFile


class Finer(NamedTuple):
    """A problem discretized twice as finely as another.

    what : "time step" or "mesh".
    remedy : the corresponding setting in a case file.
    order : order of convergence of the discretization.
    proof : a problem that is `times` times finer, to check the extrapolation from the other two.
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
    """Check the arguments of a fit, and create its model.

    Raises
    ------
    InputError
        An argument cannot be used: an invalid case file at the starting values, a measurement that
        its case cannot predict, a parameter that the case file lacks.
    ComputationError
        Modes or a frequency response cannot be computed at the starting values.
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
    guess = made.space.column("guess")
    for run in made.runs:
        case_file = case_of_document(run.path, replaced(run.document, made.space.changes(guess)))
        run.choices.append(case_file.choice)
        for i in run.members:
            _check(measurements[i], case_file)
    made.examine(guess)
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
    """Refuse keys that case files cannot have, before looking up their values."""
    guesses = {one.key: one.guess for one in parameters if isinstance(one, Parameter)}
    for key, guess in (guesses | dict.fromkeys(ties)).items():
        if value_at(document, key) is None:
            validated(path, replaced(document, {key: 1.0 if guess is None else guess}))


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
    """Group measurements with the same case and the same changes."""
    groups: dict[str, tuple[Path, dict[str, Any], list[int]]] = {}
    for i, one in enumerate(measurements):
        own = path if one.case is None else Path(one.case)
        key = json.dumps([str(own), dict(one.changes)], sort_keys=True, default=str)
        if key not in groups:
            content = document if one.case is None else read_document(own)
            content = replaced(content, {**_mass_rule(content), **one.changes})
            groups[key] = own, content, []
        groups[key][2].append(i)
    return [PredictedRun(own, content, tuple(members)) for own, content, members in groups.values()]


def _mass_rule(document: Mapping[str, Any]) -> dict[str, Any]:
    """Choose the first mass rule of a file that lists several."""
    rules = value_at(document, "model.mass")
    return {"model.mass": rules[0]} if isinstance(rules, list) and rules else {}


def _check(one: Measurement, case_file: CaseFile) -> None:
    kind = case_file.analysis.kind
    if kind != one.analysis:
        raise InputError(
            f'{one.name}: kind = "{one.kind}" needs a case of kind "{one.analysis}", but '
            f"{case_file.path} is of kind {show(kind)}"
        )
    if kind == "dynamics":
        predicted_run.steady(case_file)
    one.check(case_file.case(), case_file.analysis.arguments)


def _parts(one: Measurement) -> Iterator[Any]:
    """Everything that predictions of a measurement depend on, except the model."""
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
