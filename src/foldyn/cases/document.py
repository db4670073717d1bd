"""Conversion of a case to a document (a table for TOML) with named arrays, and back.

The document has the sections of a case file. Long data are in the arrays, and the document refers
to them by ``{ array = "name" }``: the pattern's vertices and faces, values per crease, tables of
histories. Numbers are preserved exactly.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.air import Air
from foldyn.cases.case import Case
from foldyn.cases.contact import Contact
from foldyn.cases.damping import DampingSection, damping_table
from foldyn.cases.decode import laws_from
from foldyn.cases.histories import HISTORIES, Table
from foldyn.cases.history import STEADY, History, as_history
from foldyn.cases.loads import LOAD, Load
from foldyn.cases.masses import MASS
from foldyn.cases.models import BARS_AND_HINGES, MODELS, SHELL
from foldyn.cases.supports import SUPPORT
from foldyn.errors import InputError, quietly
from foldyn.materials import BAR_LAWS, HINGE_LAWS, HingeLaw
from foldyn.patterns import Boards, Pattern
from foldyn.structures import Sheet, discretize
from foldyn.structures.discretized import Discretized
from foldyn.structures.strip import Strip
from foldyn.tables import read
from foldyn.values import plain

LAWS: Mapping[str, Mapping[str, type]] = {
    "bar_law": BAR_LAWS,
    "fold_law": HINGE_LAWS,
    "bend_law": HINGE_LAWS,
}
T = TypeVar("T")
PER_CREASE = ("crease_stiffness", "crease_rest")


@dataclass(frozen=True, eq=False)
class Document:
    """A case as plain tables and arrays.

    Attributes
    ----------
    sections : dict
        Sections of a case file, of plain Python values.
    arrays : dict of str to ndarray
        Arrays that the sections refer to, by name.
    obstacles : tuple of str
        Reasons why the case cannot be rebuilt from the document; empty if it can be rebuilt.
    """

    sections: dict[str, Any]
    arrays: dict[str, NDArray]
    obstacles: tuple[str, ...]


def to_document(case: Case, stage_times: NDArray[np.float64] | None = None) -> Document:
    """Convert a case to a document.

    Parameters
    ----------
    case : Case
    stage_times : ndarray, shape (n,), optional
        Times (s) for sampling functions of time; without them a case with such functions cannot be
        rebuilt.

    Returns
    -------
    Document
    """
    return _Writer(stage_times).document(case)


def pattern_document(pattern: Pattern) -> Document:
    """Convert a pattern without a sheet to a document, which is not a complete case."""
    writer = _Writer(None)
    sections = {
        "pattern": writer.pattern(pattern),
        "nodes": writer.store("rest_position", pattern.vertices),
    }
    obstacles = (*writer.obstacles, "it is of a pattern alone, which has no sheet")
    return Document(sections, writer.arrays, obstacles)


def from_document(sections: Mapping[str, Any], arrays: Mapping[str, NDArray]) -> Case:
    """Rebuild a case from its document.

    Raises
    ------
    InputError
        The document is damaged.
    """
    return _undamaged(_read, sections, arrays)


def pattern_from_document(sections: Mapping[str, Any], arrays: Mapping[str, NDArray]) -> Pattern:
    """Pattern of a document, even if the case cannot be rebuilt.

    Raises
    ------
    InputError
        The document is damaged, or has no pattern.
    """
    if not sections.get("pattern"):
        raise InputError("the stored case has no pattern")
    with quietly():
        return _undamaged(_stored_pattern, sections["pattern"], arrays)


def _undamaged(read: Callable[[Any], T], table: Any, arrays: Mapping[str, NDArray]) -> T:
    try:
        return read(_resolve(table, arrays))
    except InputError:
        raise
    except Exception as error:  # any error that damaged numbers or tables cause
        raise InputError(f"the stored case is damaged ({type(error).__name__}: {error})") from error


class _Writer:
    """Makes the sections, and collects arrays and obstacles."""

    def __init__(self, stage_times: NDArray[np.float64] | None) -> None:
        self.stage_times = stage_times
        self.arrays: dict[str, NDArray] = {}
        self.obstacles: list[str] = []
        self.histories: list[tuple[History, bool, dict[str, Any]]] = []

    def document(self, case: Case) -> Document:
        structure = case.structure
        sections: dict[str, Any] = {
            "pattern": self.pattern(structure.pattern),
            "nodes": self.store("rest_position", structure.nodes),
            "sheet": self._sheet(structure.sheet),
            "model": self._model(structure),
            "damping": damping_table(case.dampings),
            "supports": [self._part(support) for support in case.supports],
            "loads": [self._part(load) for load in case.loads],
        }
        if case.masses:
            sections["masses"] = [self._part(mass) for mass in case.masses]
        if case.contact is not None:
            sections["contact"] = self._contact(case.contact)
        if case.air is not None:
            sections["air"] = self._part(case.air)
        if not self.obstacles and not structure.as_made:
            self.obstacles.append(
                "its structure differs from what discretize makes of its pattern, sheet and options"
            )
        return Document(sections, self.arrays, tuple(dict.fromkeys(self.obstacles)))

    def store(self, name: str, values: Any) -> dict[str, str]:
        self.arrays[name] = np.asarray(values)
        return {"array": name}

    def pattern(self, pattern: Pattern | None) -> dict[str, Any]:
        if pattern is None:
            self.obstacles.append("its structure has no pattern")
            return {}
        lengths = [len(face) for face in pattern.faces]
        flat = [vertex for face in pattern.faces for vertex in face]
        return {
            "name": pattern.name,
            "vertices": self.store("vertices", pattern.vertices),
            "faces": self.store("faces", np.array(flat, dtype=np.int64)),
            "face_offsets": self.store(
                "face_offsets", np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
            ),
            "assignments": self.store("assignments", np.array(pattern.assignments, dtype="<U1")),
            **self._more(pattern),
        }

    def _more(self, pattern: Pattern) -> dict[str, Any]:
        """Further data of a pattern: boards, fold angles, welds, families, periods, custom data."""
        table: dict[str, Any] = {}
        for name in ("corners", "thickness") if pattern.boards else ():
            table[f"board_{name}"] = self.store(f"board_{name}", getattr(pattern.boards, name))
        if not np.isnan(pattern.fold_angles).all():
            table["fold_angles"] = self.store("fold_angles", pattern.fold_angles)
        if len(pattern.welds):
            table["welds"] = self.store("welds", pattern.welds)
        for key, what in (("family", "creases"), ("rim_family", "edges")):
            plural = key.replace("family", "families")
            if named := getattr(pattern, plural):
                table[plural] = [
                    {"name": name, what: self.store(f"tables_{key}{i}_{what}", rows)}
                    for i, (name, rows) in enumerate(named.items())
                ]
        if pattern.periods:
            table["periods"] = [
                self.store(f"tables_period{k}_vertices", pairs.ravel())
                for k, pairs in enumerate(pattern.periods)
            ]
        if pattern.custom:
            try:
                table["custom"] = json.dumps(pattern.custom)
            except (TypeError, ValueError):
                self.obstacles.append("its pattern has custom data that JSON cannot hold")
        return table

    def _sheet(self, sheet: Sheet) -> dict[str, Any]:
        given = {name: value for name, value in vars(sheet).items() if name != "panels"}
        section = _material(given)
        if sheet.panels:
            section["panels"] = [
                {
                    "panels": self.store(f"tables_sheet{i}_panels", part.panels),
                    **_material(part.own),
                }
                for i, part in enumerate(sheet.panels)
            ]
        return section

    def _model(self, structure: Discretized) -> dict[str, Any]:
        section: dict[str, Any] = {}
        options = structure.options
        for option in dataclasses.fields(options):
            name, value = option.name, getattr(options, option.name)
            if value is None or value == ():
                continue
            if name in LAWS:
                section[name] = self._law(name, value)
            elif isinstance(value, Strip):
                section[name] = _material(vars(value))
            elif name in PER_CREASE and isinstance(value, Mapping):
                section[name] = {
                    word: _material(vars(own)) if isinstance(own, Strip) else own
                    for word, own in value.items()
                }
            elif name in PER_CREASE:
                array = np.asarray(value, dtype=np.float64)
                section[name] = self.store(f"tables_{name}", array) if array.ndim else float(value)
            else:
                section[name] = plain(value)
        if structure.kind != BARS_AND_HINGES:
            section["kind"] = structure.kind
        return section

    def _law(self, name: str, law: Any) -> Any:
        if isinstance(law, str):
            return law
        if isinstance(law, Mapping):
            return {word: self._law(name, own) for word, own in law.items()}
        if isinstance(law, tuple):
            return [self._law(name, own) for own in law]
        kind = next((kind for kind, built_in in LAWS[name].items() if type(law) is built_in), None)
        if kind is None:
            self.obstacles.append(
                f'{name} is "{law.name}", a user\'s own law, of which only the name is stored'
            )
            return {"kind": "user", "name": str(law.name)}
        names = [f.name for f in dataclasses.fields(law) if f.init and f.name != "name"]
        values = {}
        for part in names:
            value = getattr(law, part)
            values[part] = self._law(name, value) if isinstance(value, HingeLaw) else plain(value)
        return {"kind": kind, **{k: value for k, value in values.items() if value is not None}}

    def _contact(self, contact: Contact) -> dict[str, Any]:
        table = {key: value for key, value in contact.table().items() if key != "planes"}
        if contact.planes:
            table["planes"] = [self._part(plane) for plane in contact.planes]
        return table

    def _part(self, part: Any) -> dict[str, Any]:
        section = part.table()
        if "bar_law" in section:
            section["bar_law"] = self._law("bar_law", section["bar_law"])
        for name in filter(lambda key: key.endswith("history"), part.by_key()):
            history = as_history(getattr(part, name))
            if history != STEADY or name in part.missing:
                moves = not isinstance(part, Load) or part.moves
                section[name] = self._history(history, moves)
        return section

    def _history(self, history: History, moves: bool) -> dict[str, Any]:
        for other, moved, table in self.histories:
            if other == history and moved == moves:
                return table
        table = self._new_history(history, moves)
        self.histories.append((history, moves, table))
        return table

    def _new_history(self, history: History, moves: bool) -> dict[str, Any]:
        if HISTORIES.get(history.kind) is not type(history):  # a user's function
            if self.stage_times is None:
                self.obstacles.append(
                    f"a {'motion' if moves else 'load'} has a function of time as history, and "
                    "the time step of the run, at which it would be sampled, is not known"
                )
                return {"kind": "user"}
            try:  # motions have velocities, which must not jump at every sample
                history = Table(self.stage_times, history(self.stage_times), smooth=moves)
            except InputError as error:
                self.obstacles.append(str(error))
                return {"kind": "user"}
        table: dict[str, Any] = {"kind": history.kind}
        for item in dataclasses.fields(cast(Any, history)):
            value = getattr(history, item.name)
            if isinstance(value, np.ndarray):
                value = self.store(f"tables_{len(self.histories)}_{item.name}", value)
            table[item.name] = plain(value)
        return table


def _read(sections: Mapping[str, Any]) -> Case:
    supports = [SUPPORT("", item) for item in sections["supports"]]
    loads = [LOAD("", item) for item in sections["loads"]]
    masses = [MASS("", item) for item in sections.get("masses", ())]
    contact = read(Contact, "", sections["contact"]) if "contact" in sections else None
    air = read(Air, "", sections["air"]) if "air" in sections else None
    structure = _structure(sections)
    with quietly():  # warnings were issued when the case was first made
        damping = read(DampingSection, "", sections["damping"]).made()
        return Case(structure, supports, loads, damping, masses, contact, air)


def _structure(sections: Mapping[str, Any]) -> Any:
    model = dict(sections["model"])
    for name, laws in LAWS.items():
        if name in model:
            model[name] = laws_from(model[name], laws)
    nodes = sections["nodes"]
    with quietly():
        pattern = _stored_pattern(sections["pattern"])
        sheet = read(Sheet, "sheet", sections["sheet"])
        kind = model.pop("kind", BARS_AND_HINGES)
        pieces = model.get("divisions", 1) if kind == SHELL else 1
        least = len(pattern.vertices) + len(pattern.edges) * (pieces - 1)
        _check_whole(least <= len(nodes), nodes, f"at least {least} nodes")  # before it is meshed
        structure = MODELS[kind].make(pattern, sheet, **model)
        shape = structure.nodes.shape
        _check_whole(nodes.shape == shape, nodes, f"the shape {shape}")
        centers = {k: nodes[c] for k, c in enumerate(structure.centers) if c >= 0}
        if centers and not np.array_equal(nodes, structure.nodes):
            # centers were given, or computed with other last digits on another machine
            structure = discretize(pattern, sheet, **model, centers=centers)
    return structure


def _check_whole(whole: bool, nodes: NDArray, own: str) -> None:
    if not whole:
        raise InputError(
            f"the result holds rest positions of shape {nodes.shape}, its structure has {own}: use "
            "the whole result, not a selection of its nodes"
        )


def _stored_pattern(table: Mapping[str, Any]) -> Pattern:
    flat = table["faces"].tolist()
    faces = [flat[start:end] for start, end in pairwise(table["face_offsets"].tolist())]
    letters = [str(letter) for letter in table["assignments"]]
    boards = None
    if "board_corners" in table:
        boards = Boards(table["face_offsets"], table["board_corners"], table["board_thickness"])
    pattern = Pattern(
        table["vertices"], faces, letters, table["name"], boards, table.get("fold_angles"),
        custom=json.loads(table.get("custom", "{}")), welds=table.get("welds", ()),
        periods=[np.reshape(pairs, (-1, 2)) for pairs in table.get("periods", ())],
    )  # fmt: skip
    named = {each["name"]: pattern.creases[each["creases"]] for each in table.get("families", ())}
    rim = {each["name"]: pattern.boundary[each["edges"]] for each in table.get("rim_families", ())}
    return pattern.changed(families=named, rim_families=rim) if named or rim else pattern


def _resolve(value: Any, arrays: Mapping[str, NDArray]) -> Any:
    """Replace references by the arrays that they name."""
    if isinstance(value, Mapping):
        if set(value) == {"array"}:
            if value["array"] not in arrays:
                raise InputError(f"the stored case lacks its array {value['array']}")
            return arrays[value["array"]]
        return {key: _resolve(item, arrays) for key, item in value.items()}
    return [_resolve(item, arrays) for item in value] if isinstance(value, list) else value


def _material(given: Mapping[str, Any]) -> dict[str, Any]:
    """Table of a material; plies are tables, too."""
    found = {name: plain(value) for name, value in given.items() if value not in (None, ())}
    if "plies" in found:
        found["plies"] = [_material(vars(ply)) for ply in found["plies"]]
    return found
