"""The fit file: a TOML text that names a case, its parameters and its measurements."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, PlainValidator, ValidationError

from foldyn.analyses.messages import describe
from foldyn.analyses.reading import read_document
from foldyn.analyses.sections import Count, Section
from foldyn.cases.decode import unknown_key
from foldyn.errors import InputError
from foldyn.experiment.calibration.measured_files import READERS, read_measurement
from foldyn.experiment.calibration.measured_motions import History, Spectrum
from foldyn.experiment.calibration.measured_paths import ForceDisplacement, Shapes
from foldyn.experiment.calibration.measurement import Measurement
from foldyn.experiment.calibration.parameters import Parameter
from foldyn.values import MOST, choice

CLASSES = {one.kind: one for one in (ForceDisplacement, Shapes, History, Spectrum)}
MADE = (
    "kind",
    "case",
    "changes",
    "held_out",
    "displacement",
    "force",
    "values",
    "time",
    "frequency",
)
"""Fields of measurements that come from their file, or have another name in a fit file."""


class ParameterSection(Section):
    """One of the [[parameters]]: arguments of `Parameter`."""

    key: str
    start: float | None = None
    lower: float | None = None
    upper: float | None = None
    scale: float | None = None


class DataSection(Section):
    """One of the [[data]]; what else it may say depends on its kind."""

    kind: Annotated[str, PlainValidator(lambda value: choice("", value, READERS))]
    file: str
    case: str | None = None
    set: dict[str, Any] = Field(default_factory=dict)
    held_out: bool = False


class SolverSection(Section):
    """[solver]: other arguments of `fit`."""

    starts: Count = 1
    seed: Annotated[int, Field(ge=0, le=MOST)] = 0
    processes: Count = 1
    confidence: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.95


class FitSchema(Section):
    """A fit file."""

    title: str = ""
    case: str
    parameters: list[ParameterSection] = Field(min_length=1)
    ties: dict[str, str] = Field(default_factory=dict)
    data: list[dict[str, Any]] = Field(min_length=1)
    solver: SolverSection = SolverSection()


@dataclass(frozen=True, eq=False)
class FitFile:
    """A fit file that has been read: the arguments of `fit`.

    Attributes
    ----------
    path : Path
    title : str
    case : Path
    data : tuple of Measurement
    parameters : tuple of Parameter
    ties : dict of str to str
    solver : dict
        Arguments starts, seed, processes and confidence.
    """

    path: Path
    title: str
    case: Path
    data: tuple[Measurement, ...]
    parameters: tuple[Parameter, ...]
    ties: dict[str, str]
    solver: dict[str, Any]


def is_fit_file(path: str | os.PathLike[str]) -> bool:
    """Whether a TOML file names parameters, as a case file never does."""
    return "parameters" in read_document(Path(path))


def read_fit(
    path: str | os.PathLike[str], find: Callable[[str], Path] | None = None
) -> FitFile:  # fmt: skip
    """Read a fit file, its measurements too.

    Parameters
    ----------
    path : path
    find : callable, optional
        Finds a case by a name that is no file beside the fit file.

    Raises
    ------
    InputError
        Anything in it, or in a file that it names, cannot be used.
    """
    path = Path(path)
    document = read_document(path)
    schema = _checked(path, "", FitSchema, document)
    place = f"{path}: "

    def case_of(name: str) -> Path:
        there = path.parent / name
        if os.path.isfile(there) or find is None:  # false where a name is too long
            return there
        try:
            return find(name)
        except InputError as error:
            raise InputError(f"{place}case: {error}") from None

    data = []
    for i, table in enumerate(schema.data):
        try:
            data.append(_measurement(path, i, table, case_of))
        except InputError as error:
            known = str(error).startswith(place)
            raise InputError(f"{'' if known else f'{place}data[{i}]: '}{error}") from None
    parameters = []
    for i, item in enumerate(schema.parameters):
        given = {key: value for key, value in item.model_dump().items() if value is not None}
        try:
            parameters.append(Parameter(**given))
        except InputError as error:
            raise InputError(f"{place}parameters[{i}]: {error}") from None
    return FitFile(
        path, schema.title, case_of(schema.case), tuple(data), tuple(parameters),
        dict(schema.ties), schema.solver.model_dump(),
    )  # fmt: skip


def _measurement(
    path: Path, number: int, table: Mapping[str, Any], case_of: Callable[[str], Path]
) -> Measurement:
    own = DataSection.model_fields
    common = {key: value for key, value in table.items() if key in own}
    section = _checked(path, f"data[{number}]", DataSection, common)
    given = {key: value for key, value in table.items() if key not in own}
    known = _known(section.kind)
    for key in given:
        if key not in known:
            raise InputError(f"{key}: {unknown_key(key, (*own, *known))}")
    if "nodes" not in given and section.kind in (History.kind, Spectrum.kind):
        raise InputError("nodes: missing; name the nodes that were measured")
    return read_measurement(
        section.kind,
        path.parent / section.file,
        **{"name": Path(section.file).stem, **given},
        case=None if section.case is None else case_of(section.case),
        changes=section.set,
        held_out=section.held_out,
    )


def _known(kind: str) -> list[str]:
    """Keys that a measurement of a kind may have in a fit file."""
    reader = inspect.signature(READERS[kind]).parameters.values()
    own = [one.name for one in reader if one.kind is not one.VAR_KEYWORD and one.name != "file"]
    if kind == Spectrum.kind:
        own += [key for key in _known(History.kind) if key not in own]
    made = {*MADE, "load_factor", "axes"} if kind == Shapes.kind else {*MADE}
    return own + [
        item.name
        for item in fields(CLASSES[kind])
        if item.name not in made and item.name not in own
    ]


def _checked(path: Path, place: str, shape: Any, table: Mapping[str, Any]) -> Any:
    try:
        return shape.model_validate(table)
    except ValidationError as error:
        told = describe(error, shape, {})
        raise InputError(f"{path}: {place}{'.' if place else ''}{told}") from None
