"""Reading a case file: a TOML text that is checked whole before anything runs."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from foldyn.cases.actuation import Actuate
from foldyn.cases.analyses import DynamicsSection, StaticsSection
from foldyn.cases.case import Case
from foldyn.cases.casefile import Analysis, CaseFile, Output, build, placed
from foldyn.cases.damping import Rayleigh
from foldyn.cases.decode import call_from
from foldyn.cases.initial import Initial
from foldyn.cases.kinds import KINDS, schema_of
from foldyn.cases.limits import check_values
from foldyn.cases.loads import Force, Gravity
from foldyn.cases.messages import describe
from foldyn.cases.models import MODELS, SHELL, remodeled
from foldyn.cases.schema import LoadSection, SupportSection
from foldyn.cases.selection import resolve_nodes
from foldyn.cases.supports import BaseMotion, Fix, Impose, Support
from foldyn.cases.until import Reached
from foldyn.cases.vibrations import DriveSection, FrfSection
from foldyn.errors import FoldynWarning, InputError
from foldyn.formats import read_pattern
from foldyn.input_files import from_toml, read_text
from foldyn.patterns import GENERATORS, Pattern
from foldyn.structures import Sheet

SAMPLES = 2000
"""Samples that a motion keeps when the file does not say."""
MOST = 2
"""Size of a case file (MiB)."""
SETTINGS = ("tolerance", "largest_turn", "stability")
"""Keys of a path's analysis that are settings of its solver."""


def read_case(
    path: str | os.PathLike[str], model: str | None = None, divisions: int | None = None
) -> CaseFile:
    """Read a case file and check it whole.

    Parameters
    ----------
    path : path
        A TOML file; see the documentation for its keys. Relative paths in it start at its folder.
    model : {"bars_and_hinges", "shell"}, optional
        Model instead of that of the file. Creases, supports, loads and output stay; what means
        nothing to the other model is left out: keys of [model] that it does not have, the mass
        rules, and for a shell an explicit method with its step, and a secant amplitude.
    divisions : int, optional
        Pieces of every edge of a shell, instead of those of the file.

    Returns
    -------
    CaseFile

    Raises
    ------
    InputError
        The file cannot be read or anything in it cannot be used; the message names the file, the
        key, the value and what to do.
    """
    path = Path(path)
    document = read_document(path)
    if model is not None or divisions is not None:
        validated(path, document)
        with placed(path, ""):
            document = remodeled(document, model, divisions)
    return case_of_document(path, document)


def validated(path: Path, document: Mapping[str, Any]) -> Any:
    """Sections of a case file, checked one by one and with each other."""
    shape: Any = schema_of(document)
    try:
        return shape.model_validate(document, context={"folder": path.parent})
    except ValidationError as error:
        raise InputError(f"{path}: {describe(error, shape, KINDS)}") from None


def case_of_document(path: Path, document: Mapping[str, Any]) -> CaseFile:
    """Check what a case file says and make its cases; see `read_case`."""
    schema = validated(path, document)
    with placed(path, "pattern"):
        pattern = _pattern(schema.pattern, path.parent)
    if schema.model.kind == SHELL:
        with placed(path, ""):
            _check_vertices(schema, len(pattern.vertices))
    with placed(path, ""):
        sheet = Sheet(**schema.sheet.model_dump())
    if sheet.density is None and schema.analysis.kind != "statics":
        what = {"dynamics": "a motion needs", "modes": "modes need"}
        needed = what.get(schema.analysis.kind, "a frequency response needs")
        raise InputError(f"{path}: sheet.density: missing; {needed} it (kg/m3)")
    parts: dict[str, Any] = {
        "model": schema.model.kind,
        "options": schema.model.options,
    }
    masses = list(schema.model.mass or [MODELS[schema.model.kind].mass])
    with placed(path, "damping."):
        parts["damping"] = Rayleigh(**schema.damping.model_dump())
    parts["supports"] = []
    for i, item in enumerate(schema.supports):
        with placed(path, f"supports[{i}]."):
            parts["supports"].append(_support(item))
    parts["loads"] = [_load(item) for item in schema.loads]

    cases = {masses[0]: build(path, pattern, sheet, masses[0], parts)}
    with warnings.catch_warnings():  # the other rules would only repeat them
        warnings.simplefilter("ignore", FoldynWarning)
        for rule in masses[1:]:
            cases[rule] = build(path, pattern, sheet, rule, parts)
    case = cases[masses[0]]
    with placed(path, ""):
        analysis = _analysis(schema, case)
        nodes = _output_nodes(case, schema.output.nodes, analysis)
    output = {name: value for name, value in schema.output if name not in ("nodes", "every")}
    output["every"] = analysis.arguments.get("every") if analysis.kind == "dynamics" else None
    case_file = CaseFile(
        path=path,
        title=schema.title,
        pattern=pattern,
        sheet=sheet,
        model=schema.model.kind,
        masses=masses,
        analysis=analysis,
        output=Output(nodes, schema.output.nodes is not None, **output),
        start=None if schema.initial is None else Initial(**schema.initial.model_dump()),
        _parts=parts,
        _cases=cases,
    )
    if case_file.start is not None and case_file.start.file is None:
        for rule in masses:
            case_file.initial(rule)  # a support may hold what the rigid motion moves
    return case_file


def read_document(path: Path) -> dict[str, Any]:
    """Read what a case file says, unchecked."""
    text = read_text(path, "a case file (TOML)", MOST, "put long tables into files of their own")
    try:
        document = from_toml(text)
        check_values(document)
        return document
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _pattern(table: Mapping[str, Any], folder: Path) -> Pattern:
    if "kind" in table:
        arguments = {name: value for name, value in table.items() if name != "kind"}
        return call_from(GENERATORS[table["kind"]], arguments)
    try:
        if "file" in table:
            return read_pattern(folder / table["file"])
        return Pattern(table["vertices"], table["faces"], table.get("assignments"))
    except InputError as error:
        place = f'.file = "{table["file"]}": ' if "file" in table else ": "
        raise InputError(f"{place}{error}") from None


def _check_vertices(schema: Any, count: int) -> None:
    """Refuse nodes of a shell's mesh: what a case file says is meant for every mesh."""
    places = {f"supports[{i}].nodes": item.nodes for i, item in enumerate(schema.supports)}
    places |= {f"loads[{i}].nodes": item.nodes for i, item in enumerate(schema.loads)}
    drive = getattr(schema, "drive", None) or []
    places |= {f"drive[{i}].nodes": item.nodes for i, item in enumerate(drive)}
    until = getattr(schema.analysis, "until", None)
    places |= {} if until is None else {"analysis.until.node": (until.node,)}
    places["output.nodes"] = schema.output.nodes
    for place, nodes in places.items():
        if nodes is None or isinstance(nodes, str):
            continue
        beyond = [node for node in nodes if not 0 <= node < count]
        if beyond:
            raise InputError(
                f"{place}: {beyond[0]} is no vertex of the pattern, which has 0 to {count - 1}; a "
                "case file names nodes of a shell by vertex, whatever its divisions"
            )


def _support(item: SupportSection) -> Support:
    if item.base is not None:
        value = 1.0 if item.displacement is None else item.displacement
        return BaseMotion(item.base, item.history, value)
    if item.axis is not None:
        return Impose(item.nodes, item.axis, item.displacement, item.history)
    return Fix(item.nodes, item.axes)


def _load(item: LoadSection) -> Force | Gravity | Actuate:
    if item.gravity is not None:
        return Gravity(item.gravity, item.history)
    if item.creases is not None:
        return Actuate(item.creases, item.angle, item.history)
    return Force(item.nodes, item.force, item.history)


def _drive(item: DriveSection) -> Force | BaseMotion:
    if item.base is not None:
        return BaseMotion(item.base, value=item.displacement)
    return Force(item.nodes, item.force)


def _analysis(schema: Any, case: Case) -> Analysis:
    section = schema.analysis
    arguments = {name: value for name, value in section if name != "kind"}
    settings: dict[str, Any] = {}
    if isinstance(section, DynamicsSection):
        every = schema.output.every
        arguments["every"] = section.duration / SAMPLES if every is None else every
    elif isinstance(section, StaticsSection):
        if section.until is not None:
            resolve_nodes(case.structure, (section.until.node,), "analysis.until.node")
            arguments["until"] = Reached(**section.until.model_dump())
        settings = {name: arguments.pop(name) for name in SETTINGS}
    else:
        arguments["state"] = None if section.state == "rest" else section.state
    if isinstance(section, FrfSection):
        shared = ("frequencies", "state", "method", "secant", "amplitude")
        arguments = {**{name: arguments[name] for name in shared}, **section.options()}
        arguments["drive"] = [_drive(item) for item in schema.drive]
    return Analysis(section.kind, arguments, settings)


def _output_nodes(case: Case, chosen: Any, analysis: Analysis) -> NDArray[np.int64]:
    """Nodes to show: those chosen, else those with a force, else every vertex that can move.

    The forces of a frequency response are those that drive it. Of a path without forces, those
    that supports move come before every vertex.
    """
    if chosen is not None:
        return resolve_nodes(case.structure, chosen, "output.nodes")
    loaded = case.loaded_nodes
    if analysis.kind == "frf":
        forces = enumerate(analysis.arguments["drive"])
        driven = [
            resolve_nodes(case.structure, part.nodes, f"drive[{i}].nodes")
            for i, part in forces
            if isinstance(part, Force)
        ]
        loaded = np.unique(np.concatenate(driven)) if driven else loaded[:0]
    if loaded.size:
        return loaded
    if analysis.kind == "statics" and case.imposed.any():
        return np.flatnonzero(case.imposed.any(axis=1))
    vertices = len(case.structure.pattern.vertices)
    return np.flatnonzero(~case.fixed[:vertices].all(axis=1))
