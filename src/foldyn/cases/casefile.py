"""Reading a case file: a TOML text that is checked whole before anything runs."""

from __future__ import annotations

import os
import tomllib
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from foldyn.cases.actuation import Actuate
from foldyn.cases.analyses import KINDS, StaticsSection, schema_of
from foldyn.cases.case import Case
from foldyn.cases.damping import Rayleigh
from foldyn.cases.decode import call_from
from foldyn.cases.initial import Initial, rigid_motion
from foldyn.cases.loads import Force, Gravity
from foldyn.cases.messages import describe
from foldyn.cases.schema import LoadSection, SupportSection
from foldyn.cases.selection import resolve_nodes
from foldyn.cases.state import State
from foldyn.cases.supports import BaseMotion, Fix, Impose, Support
from foldyn.cases.until import Reached
from foldyn.cases.values import choice, show
from foldyn.errors import FoldynWarning, InputError
from foldyn.formats import read_pattern
from foldyn.patterns import GENERATORS, Pattern
from foldyn.structures import MASS_RULES, ModelOptions, Sheet, discretize

SAMPLES = 2000
"""Samples that a motion keeps when the file does not say."""
SETTINGS = ("tolerance", "largest_turn", "stability")
"""Keys of a path's analysis that are settings of its solver."""


@dataclass(frozen=True)
class Analysis:
    """What to compute.

    Attributes
    ----------
    kind : str
        "dynamics" or "statics".
    arguments : dict
        Keyword arguments of its function: `simulate` or `trace`.
    settings : dict
        Of a path: arguments of its `foldyn.statics.Settings`.
    """

    kind: str
    arguments: dict[str, Any]
    settings: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Output:
    """What to keep and show.

    Attributes
    ----------
    nodes : ndarray of int64
        Nodes that figures and spectra show.
    axis : str or None
        Component that figures show, "x", "y" or "z", of a path also "-x", "-y" or "-z"; None: the
        one in which a node moves most.
    animation : str
        "gif" or "mp4".
    every : int, float or None
        Of a motion: interval between samples, steps (int) or seconds (float).
    max_frequency : float or None
        Of a motion: where the axes of spectra end (Hz); None: at half the sampling rate.
    shapes : int, tuple of int or None
        Of a path: how many deformed shapes are drawn, or the numbers of their points.
    """

    nodes: NDArray[np.int64]
    axis: str | None = None
    animation: str = "gif"
    every: int | float | None = None
    max_frequency: float | None = None
    shapes: int | tuple[int, ...] | None = None


@dataclass(frozen=True, eq=False)
class CaseFile:
    """A case file that has been read and checked.

    Attributes
    ----------
    path : Path
        The file.
    title : str
        Its title, or "".
    pattern : Pattern
    sheet : Sheet
    masses : list of str
        Mass rules, one or several to compare.
    analysis : Analysis
    output : Output
    start : Initial or None
        How the motion or path starts if not at rest; `initial` makes a state of it.
    """

    path: Path
    title: str
    pattern: Pattern
    sheet: Sheet
    masses: list[str]
    analysis: Analysis
    output: Output
    start: Initial | None
    _parts: Mapping[str, Any] = field(repr=False)
    _cases: dict[str, Case] = field(repr=False)

    def case(self, mass: str | None = None) -> Case:
        """Case with one of the mass rules, by default the first that the file names."""
        rule = self.masses[0] if mass is None else choice("mass", mass, MASS_RULES)
        if rule not in self._cases:
            self._cases[rule] = _build(self.path, self.pattern, self.sheet, rule, self._parts)
        return self._cases[rule]

    def initial(
        self, mass: str | None = None, read: Callable[[Path, int], State] | None = None
    ) -> State | None:
        """State that the motion or path starts from; None for rest.

        Parameters
        ----------
        mass : str, optional
            Mass rule, by default the first that the file names: it decides where the center of
            mass is.
        read : callable, optional
            Gives the state of a result's file at a sample, for files that start from one:
            ``lambda path, at: fd.initial_state(fd.load(path), at)``.

        Raises
        ------
        InputError
            A support holds a node that the rigid motion moves; the result cannot be read or has
            other nodes.
        """
        if self.start is None:
            return None
        case = self.case(mass)
        if self.start.file is None:
            with _placed(self.path, "initial: "):
                return rigid_motion(case, self.start)
        if read is None:
            raise InputError(
                f"{self.path}: initial.file: needs a reader: case_file.initial(read=lambda path, "
                "at: foldyn.initial_state(foldyn.load(path), at))"
            )
        place = f"{self.path}: initial.file = {show(self.start.file)}: "
        try:
            state = read(self.path.parent / self.start.file, self.start.at)
        except InputError as error:
            of_sample = str(error).startswith("at =")
            raise InputError(
                f"{self.path}: initial.{error}" if of_sample else f"{place}{error}"
            ) from None
        wanted = len(case.structure.nodes)
        for array in (state.displacement, state.velocity):
            if array is not None and len(np.asarray(array)) != wanted:
                raise InputError(
                    f"{place}holds a motion of {len(np.asarray(array))} nodes, but this structure "
                    f"has {wanted}; give a result of the same pattern and scheme"
                )
        return state


def read_case(path: str | os.PathLike[str]) -> CaseFile:
    """Read a case file and check it whole.

    Parameters
    ----------
    path : path
        A TOML file; see the documentation for its keys. Relative paths in it start at its folder.

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
    document = _read_toml(path)
    shape: Any = schema_of(document)
    try:
        schema = shape.model_validate(document, context={"folder": path.parent})
    except ValidationError as error:
        raise InputError(f"{path}: {describe(error, shape, KINDS)}") from None
    with _placed(path, "pattern"):
        pattern = _pattern(schema.pattern, path.parent)
    with _placed(path, ""):
        sheet = Sheet(**schema.sheet.model_dump())
    if sheet.density is None and schema.analysis.kind == "dynamics":
        raise InputError(f"{path}: sheet.density: missing; a motion needs it (kg/m3)")
    parts: dict[str, Any] = {
        "options": {name: getattr(schema.model, name) for name in schema.model.model_fields_set},
    }
    named = parts["options"].pop("mass", None)
    masses = [ModelOptions().mass] if named is None else list(named)
    with _placed(path, "damping."):
        parts["damping"] = Rayleigh(**schema.damping.model_dump())
    parts["supports"] = []
    for i, item in enumerate(schema.supports):
        with _placed(path, f"supports[{i}]."):
            parts["supports"].append(_support(item))
    parts["loads"] = [_load(item) for item in schema.loads]

    cases = {masses[0]: _build(path, pattern, sheet, masses[0], parts)}
    with warnings.catch_warnings():  # the other rules would only repeat them
        warnings.simplefilter("ignore", FoldynWarning)
        for rule in masses[1:]:
            cases[rule] = _build(path, pattern, sheet, rule, parts)
    case = cases[masses[0]]
    with _placed(path, ""):
        analysis = _analysis(schema, case)
        nodes = _output_nodes(case, schema.output.nodes, analysis.kind)
    output = {name: value for name, value in schema.output if name not in ("nodes", "every")}
    case_file = CaseFile(
        path=path,
        title=schema.title,
        pattern=pattern,
        sheet=sheet,
        masses=masses,
        analysis=analysis,
        output=Output(nodes, every=analysis.arguments.get("every"), **output),
        start=None if schema.initial is None else Initial(**schema.initial.model_dump()),
        _parts=parts,
        _cases=cases,
    )
    if case_file.start is not None and case_file.start.file is None:
        for rule in masses:
            case_file.initial(rule)  # a support may hold what the rigid motion moves
    return case_file


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        text = path.read_bytes().decode("utf-8-sig")  # some editors begin with a mark
        return tomllib.loads(text)
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file") from None
    except IsADirectoryError:
        raise InputError(f"{path}: is a folder; give a case file (TOML)") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not a text file in UTF-8; give a case file (TOML)") from None
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"{path}: is not valid TOML: {error}") from None


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


def _analysis(schema: Any, case: Case) -> Analysis:
    section = schema.analysis
    arguments = {name: value for name, value in section if name != "kind"}
    if not isinstance(section, StaticsSection):
        every = schema.output.every
        every = section.duration / SAMPLES if every is None else every
        return Analysis(section.kind, {**arguments, "every": every})
    if section.until is not None:
        resolve_nodes(case.structure, (section.until.node,), "analysis.until.node")
        arguments["until"] = Reached(**section.until.model_dump())
    settings = {name: arguments.pop(name) for name in SETTINGS}
    return Analysis(section.kind, arguments, settings)


def _build(path: Path, pattern: Pattern, sheet: Sheet, mass: str, parts: Mapping[str, Any]) -> Case:
    with _placed(path, "model: "):
        structure = discretize(pattern, sheet, mass=mass, **parts["options"])
        if sheet.density is not None:
            _ = structure.mass  # a rule may refuse this pattern: say so before anything runs
    with _placed(path, ""):
        return Case(structure, parts["supports"], parts["loads"], parts["damping"])


def _output_nodes(case: Case, chosen: Any, kind: str) -> NDArray[np.int64]:
    """Nodes to show: those chosen, else those with a force, else every vertex that can move.

    Of a path without forces, those that supports move come before every vertex.
    """
    if chosen is not None:
        return resolve_nodes(case.structure, chosen, "output.nodes")
    if case.loaded_nodes.size:
        return case.loaded_nodes
    if kind == "statics" and case.imposed.any():
        return np.flatnonzero(case.imposed.any(axis=1))
    vertices = len(case.structure.pattern.vertices)
    return np.flatnonzero(~case.fixed[:vertices].all(axis=1))


@contextmanager
def _placed(path: Path, place: str) -> Iterator[None]:
    """Put the file and the place in front of an error from a lower layer."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{path}: {place}{error}") from None
