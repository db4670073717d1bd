"""The fit file: a TOML text that names a case, its parameters and its measurements."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, fields
from inspect import signature
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, ConfigDict, Field, ValidationError, ValidationInfo

from foldyn.analyses.messages import describe
from foldyn.analyses.reading import read_document
from foldyn.analyses.sections import Count, Section, one_of
from foldyn.cases.decode import call_from, check_keys
from foldyn.errors import InputError, within
from foldyn.experiment.calibration.histories import Spectrum, TimeHistory
from foldyn.experiment.calibration.measured import ForceDisplacement, Shapes
from foldyn.experiment.calibration.measured_files import READERS
from foldyn.experiment.calibration.measurement import Measurement
from foldyn.experiment.calibration.modal import (
    DampingRatios,
    ModalParameters,
    ModeShapes,
    NaturalFrequencies,
)
from foldyn.experiment.calibration.parameters import Parameter
from foldyn.experiment.calibration.responses import FrequencyResponse
from foldyn.values import MOST, show

CLASSES = {
    one.kind: one
    for one in (
        ForceDisplacement, Shapes, TimeHistory, Spectrum, NaturalFrequencies, DampingRatios,
        ModeShapes, FrequencyResponse,
    )
}  # fmt: skip
MADE = (
    "kind", "case", "changes", "held_out", "displacement", "force", "values", "time", "frequency",
    "axes", "mode", "damping_ratio",
)  # fmt: skip
"""Fields of measurements that come from their file, or have another name in a fit file."""
NAMED = (TimeHistory.kind, Spectrum.kind, FrequencyResponse.kind)
"""Kinds whose nodes a fit file must name."""


def _case(name: str, info: ValidationInfo) -> Path:
    """Case file beside the fit file, or one that is found by its name."""
    folder, find = info.context["folder"], info.context["find"]  # type: ignore[index]
    if os.path.isfile(folder / name) or find is None:  # false where a name is too long
        return folder / name
    with within(": "):
        return find(name)


class DataSection(Section):
    """One of the [[data]]; its other keys depend on its kind."""

    model_config = ConfigDict(extra="allow")

    kind: Annotated[str, one_of(READERS)]
    file: str
    case: Annotated[str, AfterValidator(_case)] | None = None
    set: dict[str, Any] = Field(default_factory=dict)
    held_out: bool = False


def _measurement(section: DataSection, info: ValidationInfo) -> Measurement:
    given = section.model_extra or {}
    check_keys(given, [*DataSection.model_fields, *_known(section.kind)])
    if "nodes" not in given and section.kind in NAMED:
        raise InputError(": missing; name the nodes that were measured", ".nodes")
    folder: Path = info.context["folder"]  # type: ignore[index]
    if issubclass(CLASSES[section.kind], ModalParameters) and "shapes" in given:
        if not isinstance(given["shapes"], str):
            raise InputError(f" = {show(given['shapes'])}: must be the name of a file", ".shapes")
        given = {**given, "shapes": folder / given["shapes"]}
    with within(": "):
        return READERS[section.kind](
            folder / section.file,
            **{"name": Path(section.file).stem, **given},
            case=section.case,
            changes=section.set,
            held_out=section.held_out,
        )


def _known(kind: str) -> list[str]:
    """Keys of a fit file that are for measurements of one kind."""
    reader = signature(READERS[kind]).parameters.values()
    keys = [one.name for one in reader if one.kind is not one.VAR_KEYWORD and one.name != "file"]
    if kind == Spectrum.kind:
        keys += _known(TimeHistory.kind)
    keys += [item.name for item in fields(CLASSES[kind]) if item.name not in MADE]
    return list(dict.fromkeys(keys))


class SolverSection(Section):
    """[solver]: other arguments of `fit`."""

    starts: Count = 1
    seed: Annotated[int, Field(ge=0, le=MOST)] = 0
    processes: Count = 1
    confidence: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.95


def _parameter(table: dict[str, Any]) -> Parameter:
    return call_from(Parameter, table)


class FitSchema(Section):
    """A fit file."""

    title: str = ""
    case: Annotated[str, AfterValidator(_case)]
    parameters: list[Annotated[dict[str, Any], AfterValidator(_parameter)]] = Field(min_length=1)
    ties: dict[str, str] = Field(default_factory=dict)
    data: list[Annotated[DataSection, AfterValidator(_measurement)]] = Field(min_length=1)
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
        Something in it, or in a file that it names, cannot be used.
    """
    path = Path(path)
    context = {"folder": path.parent, "find": find}
    try:
        schema: Any = FitSchema.model_validate(read_document(path), context=context)
    except ValidationError as error:
        raise InputError(describe(error, FitSchema, {}), file=path) from None
    return FitFile(
        path, schema.title, schema.case, tuple(schema.data), tuple(schema.parameters),
        schema.ties, schema.solver.model_dump(),
    )  # fmt: skip
