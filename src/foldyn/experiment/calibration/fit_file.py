"""The fit file: a TOML text that names a case, its parameters and its measurements."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from inspect import signature
from pathlib import Path
from typing import Annotated, Any

from foldyn.analyses.reading import read_document
from foldyn.analyses.sections import Anything, Count, Seed, Switch, Text, one_of, text
from foldyn.arguments import Check, Placed
from foldyn.cases.decode import call_from
from foldyn.errors import InputError, within
from foldyn.experiment.calibration.histories import Spectrum, TimeHistory
from foldyn.experiment.calibration.measured_files import READERS
from foldyn.experiment.calibration.measurement import Measurement
from foldyn.experiment.calibration.modal import FrequencyResponse, ModalParameters
from foldyn.experiment.calibration.parameters import Parameter
from foldyn.tables import ListOf, Section, check_keys, check_table, keys, read, told
from foldyn.values import number, show

CLASSES = {one.kind: one for one in READERS}
# Fields of measurements that come from a data file, or have another name in a fit file.
MADE = (
    "kind", "case", "changes", "held_out", "displacement", "force", "values", "time", "frequency",
    "axes", "mode", "damping_ratio",
)  # fmt: skip
# Kinds whose nodes a fit file must name.
NAMED = (TimeHistory.kind, Spectrum.kind, FrequencyResponse.kind)


def _case(name: str, value: Any, folder: Path, find: Callable[[str], Path] | None) -> Path:
    """Case file relative to the fit file, or found by its name."""
    case = text(name, value)
    if os.path.isfile(folder / case) or find is None:  # False if the name is too long for a file
        return folder / case
    with within(f"{name}: "):
        return find(case)


class DataSection(Section):
    """A [[data]] table; its other keys depend on its kind."""

    kind: Annotated[str, one_of(CLASSES)]
    file: Text
    case: Annotated[Path | None, Check(_case)] = None
    set: Anything | None = None
    held_out: Switch = False


def _measurement(name: str, value: Any, folder: Path, find: Any) -> Measurement:
    common = {key: one for key, one in check_table(name, value).items() if key in keys(DataSection)}
    section = read(DataSection, name, common, folder, find)
    given = {key: one for key, one in value.items() if key not in common}
    check_keys(given, [*keys(DataSection), *_known(section.kind)], name)
    if "nodes" not in given and section.kind in NAMED:
        raise InputError(": missing; name the nodes that were measured", f"{name}.nodes")
    kind = CLASSES[section.kind]
    if issubclass(kind, ModalParameters) and "shapes" in given:
        shapes = given["shapes"]
        if not isinstance(shapes, str):
            raise InputError(f" = {show(shapes)}: must be the name of a file", f"{name}.shapes")
        given = {**given, "shapes": folder / shapes}
    named = {"name": Path(section.file).stem, **given}
    own = {"case": section.case, "changes": section.set or {}, "held_out": section.held_out}
    with within(f"{name}: "):
        return READERS[kind](folder / section.file, **named, **own)


def _known(kind: str) -> list[str]:
    """Keys of a fit file for measurements of one kind."""
    reader = signature(READERS[CLASSES[kind]]).parameters.values()
    keys = [one.name for one in reader if one.kind is not one.VAR_KEYWORD and one.name != "file"]
    if kind == Spectrum.kind:
        keys += _known(TimeHistory.kind)
    keys += [item.name for item in fields(CLASSES[kind]) if item.name not in MADE]
    return list(dict.fromkeys(keys))


class SolverSection(Section):
    """[solver]: further arguments of `fit`."""

    searches: Count = 1
    seed: Seed = 0
    processes: Count = 1
    confidence: Annotated[float, Check(number, above=0.0, below=1.0)] = 0.95


def _parameter(value: Any) -> Parameter:
    return call_from(Parameter, check_table("", value))


def _tied(name: str, value: Any) -> dict[str, str]:
    return {key: text(f"{name}.{key}", one) for key, one in check_table(name, value).items()}


class FitSchema(Section):
    """A fit file."""

    title: Text = ""
    case: Annotated[Path, Check(_case)]
    parameters: Annotated[Sequence[Parameter], ListOf(Placed(_parameter), least=1)]
    ties: Annotated[Mapping[str, str] | None, Check(_tied)] = None
    data: Annotated[Sequence[Measurement], ListOf(Check(_measurement), least=1)]
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
        Arguments searches, seed, processes and confidence.
    """

    path: Path
    title: str
    case: Path
    data: tuple[Measurement, ...]
    parameters: tuple[Parameter, ...]
    ties: dict[str, str]
    solver: dict[str, Any]


def is_fit_file(path: str | os.PathLike[str]) -> bool:
    """Whether a TOML file has fit parameters, which a case file never has."""
    return "parameters" in read_document(Path(path))


def read_fit(
    path: str | os.PathLike[str], find: Callable[[str], Path] | None = None
) -> FitFile:  # fmt: skip
    """Read a fit file and its measurements.

    Parameters
    ----------
    path : path
    find : callable, optional
        Finds a case by name if no such file exists next to the fit file.

    Raises
    ------
    InputError
        Something in the fit file, or in a file that it names, cannot be used.
    """
    path = Path(path)
    try:
        schema = read(FitSchema, "", read_document(path), path.parent, find)
    except InputError as error:
        raise told(error, path) from None
    return FitFile(
        path, schema.title, schema.case, tuple(schema.data), tuple(schema.parameters),
        dict(schema.ties or {}), schema.solver.values(),
    )  # fmt: skip
