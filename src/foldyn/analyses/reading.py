"""Reading of case files (TOML), which are checked completely before anything runs."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from foldyn.analyses.casefile import CaseFile, Output
from foldyn.analyses.conversion import converted, flagged, remodeled
from foldyn.analyses.keys import dotted, replaced
from foldyn.analyses.model_choice import check_vertices, choice_of
from foldyn.analyses.motion import SAMPLING
from foldyn.analyses.pattern_section import FACES, FACETS, HINGES, READING
from foldyn.analyses.registry import ANALYSES, schema_of
from foldyn.analyses.sections import Choice, ImperfectionSection
from foldyn.cases import Case, resolve_nodes
from foldyn.cases.clamped_edges import straightened
from foldyn.cases.decode import call_from
from foldyn.cases.models import MODELS, SHELL
from foldyn.errors import Faults, InputError, quietly, renamed, warn, within
from foldyn.input_files import from_toml, path_of, read_text
from foldyn.patterns import GENERATORS, Pattern, convex, imperfect, thicken, welded
from foldyn.patterns.facets import HINGE, LINE, WELD, what_was_cut
from foldyn.results import load
from foldyn.structures import Sheet
from foldyn.tables import read, told
from foldyn.values import LARGEST, MOST, SMALLEST, show

WANTED: Mapping[str, tuple[tuple[str, ...], str]] = {
    "frf": (("frequencies",), "at which frequencies? Give --frequencies FIRST LAST COUNT (Hz)"),
    "random": (("base", "forces"), "under which noise? Give --base AXIS UNIT F:DENSITY ..."),
}
"""Keys of [analysis] of which commands need one, and what to say without them."""
MOST_MIB = 2
"""Largest case file (MiB)."""


def read_case(
    path: str | os.PathLike[str], model: str | None = None, *, divisions: int | None = None
) -> CaseFile:
    """Read a case file and check it completely.

    Parameters
    ----------
    path : path
        A TOML file; the documentation lists its keys. Relative paths in it start at its folder.
    model : {"bars_and_hinges", "shell"}, optional
        Model to use instead of the file's. Creases, supports, loads and output stay; parts without
        a meaning for the other model are left out: its unknown keys of [model], the mass rules, and
        for a shell an explicit method with its step, and secant amplitudes.
    divisions : int, optional
        Divisions of every edge of a shell, instead of the file's.

    Returns
    -------
    CaseFile

    Raises
    ------
    InputError
        The file cannot be read or used; the message names the file, the key, the value and the
        remedy.
    """
    path = path_of(path)
    text, document = _read(path)
    if model is not None or divisions is not None:
        validated(path, document)
        with within("", path):
            document = remodeled(document, model, divisions)
    return case_of_document(path, document, text)


def read_as(
    path: Path,
    kind: str,
    flags: Mapping[str, Any],
    model: str | None = None,
    divisions: int | None = None,
) -> CaseFile:
    """Read a case file of any kind as another kind of analysis.

    Parameters
    ----------
    path : Path
    kind : {"modes", "frf", "buckling", "random", "response", "bands", "effective",
        "fidelity"}
    flags : mapping
        Keys of [analysis] from the command line, which override the file; `state` may also be the
        file of a result.
    model, divisions
        As in `read_case`.

    Warns
    -----
    FoldynWarning
        Loads, motions of the base or a start have no meaning in that kind of analysis and are left
        out.
    """
    text, document = _read(path)
    flags = {key: value for key, value in flags.items() if value is not None}
    own = schema_of(document) is ANALYSES[kind].schema
    if not own:  # otherwise flags may provide missing keys
        validated(path, document)
    with within("", path):
        document = remodeled(document, model, divisions)
    if not own:
        document = converted(path, document, kind, flags.get("state", "rest"))
    keys, wanted = WANTED.get(kind, ((), ""))
    if keys and not {*keys} & {*flags, *document["analysis"]}:
        raise InputError(wanted, "", path)
    return case_of_document(path, flagged(document, flags), text)


def validated(path: Path, document: Mapping[str, Any]) -> Any:
    """Sections of a case file, checked individually and together."""
    others = {kind: analysis.schema for kind, analysis in ANALYSES.items()}
    try:
        return read(schema_of(document), "", document, path.parent, others=others)
    except InputError as error:
        raise told(error, path) from None


def case_of_document(
    path: Path, document: Mapping[str, Any], text: str = "", pattern: Any = None,
    structures: Mapping[str, Any] | None = None, choice: Choice | None = None,
) -> CaseFile:  # fmt: skip
    """Check the content of a case file and make its cases; see `read_case`.

    text : text of the file, if the document was read from one.
    pattern, structures : pattern and structures (by mass rule) made from this document before;
        both are made if not given.
    choice : the model if the document leaves it open; decided here if not given.
    """
    schema = validated(path, document)
    kind, faults = ANALYSES[schema.analysis.kind], Faults()
    made = pattern is not None
    sheet, resolved = schema.sheet, None
    with faults.collected():
        pattern = pattern if made else _pattern(schema.pattern, path.parent)
    if schema.imperfection is not None and not made and not faults.found:
        with faults.collected(), within("imperfection."):
            pattern = _imperfect(pattern, schema.imperfection, path.parent)
    if HINGES in schema.pattern and not made and not faults.found:
        with faults.collected():
            pattern = _thick(pattern, sheet, schema.pattern[HINGES])
    if schema.sheet.density is None and kind.needs_density and not schema.masses:
        faults.add(InputError(f": missing; {kind.needs_density} it (kg/m3)", "sheet.density"))
    with within("", path):
        choice = choice_of(schema, pattern, choice)
        model, given = MODELS[choice.kind], schema.model.options(choice.kind)
        with faults.collected(), within("model: "):
            resolved = model.options(**given)
        faults.raise_all()
        with within("model: "):
            straight = straightened(resolved, pattern, schema.supports)
        options = {**given, **straight}
        masses = list(schema.model.mass or [resolved.mass])[: None if kind.by_mass else 1]
        if choice.kind == SHELL:
            check_vertices(schema, len(pattern.vertices))
        with within("damping"):
            damping = schema.damping.made()

    def make(mass: str) -> Case:
        """Make the case with one mass rule."""
        with within("model: ", path):
            structure = (structures or {}).get(mass)
            if structure is None:
                structure = model.make(pattern, sheet, mass=mass, **options)
            if sheet.density is not None:
                _ = structure.mass  # a rule may refuse this pattern: say so before anything runs
        with within("", path):
            return Case(
                structure, schema.supports, schema.loads, damping, schema.masses, schema.contact,
                schema.air,
            )  # fmt: skip

    case = make(masses[0])
    cases = {masses[0]: case}
    with quietly():  # further rules would only repeat warnings
        cases |= {mass: make(mass) for mass in masses[1:]}
    with within("", path):
        analysis = kind.of(schema, case)
        chosen = getattr(schema.output, "nodes", None)
        if chosen is None:
            nodes = analysis.shown(case)
        else:
            nodes = resolve_nodes(case.structure, chosen, "output.nodes")
    shown = {k: v for k, v in schema.output.values().items() if k not in ("nodes", *SAMPLING)}
    case_file = CaseFile(
        path, schema.title, pattern, sheet, choice, masses, analysis,
        Output(nodes, chosen is not None, **shown), schema, make,
        lambda values: case_of_document(path, replaced(document, values), text, choice=choice),
        cases, text,
    )  # fmt: skip
    start = getattr(schema, "initial", None)
    if start is not None and start.file is None:
        for mass in masses:
            case_file.start(mass)  # a support may hold what the rigid motion moves
    return case_file


def read_document(path: Path) -> dict[str, Any]:
    """Read the content of a case file without checks."""
    return _read(path)[1]


def _read(path: Path) -> tuple[str, dict[str, Any]]:
    """Text and content of a case file."""
    remedy = "put long tables into files of their own"
    text = read_text(path, "a case file (TOML)", MOST_MIB, remedy)
    with within("", path):
        document = from_toml(text)
        check_values(document)
    return text, document


def check_values(document: Mapping[str, Any]) -> None:
    """Refuse numbers that are too large or too small for computations.

    The checks of the keys handle numbers that are not finite. Small numbers in lists are accepted,
    as in the tail of a tabulated pulse.
    """
    for place, value in _values(document):
        words = ""
        if isinstance(value, int) and not -MOST - 1 <= value <= MOST:
            words = "a whole number of at most 64 bits"
        elif isinstance(value, float) and LARGEST < abs(value) < math.inf:
            words = f"in size at most {LARGEST:g}"
        elif isinstance(value, float) and 0.0 < abs(value) < SMALLEST:
            words = "" if isinstance(place[-1], int) else f"0 or in size at least {SMALLEST:g}"
        if words:
            raise InputError(f"{dotted(place)} = {show(value)}: must be {words}")


def _values(document: Mapping[str, Any]) -> Iterator[tuple[tuple[str | int, ...], Any]]:
    """All values other than tables and lists, each with its place."""
    waiting: list[tuple[tuple[str | int, ...], Any]] = [((), document)]
    while waiting:
        place, value = waiting.pop()
        if isinstance(value, Mapping | list):
            inside = value.items() if isinstance(value, Mapping) else enumerate(value)
            waiting += reversed([((*place, key), item) for key, item in inside])
        else:
            yield place, value


def _pattern(table: Mapping[str, Any], folder: Path) -> Pattern:
    if "kind" in table:
        arguments = {name: table[name] for name in table if name not in ("kind", FACETS, HINGES)}
        with within("pattern"):
            return _facets(call_from(GENERATORS[table["kind"]], arguments), table)
    if "file" in table:
        from foldyn.formats import read_pattern  # imported late: it loads many libraries

        with within(f'pattern.file = "{table["file"]}": '):
            given = {key: table[key] for key in READING if key in table}
            return read_pattern(folder / table["file"], **given)
    with within("pattern: "):
        pattern = Pattern(
            table["vertices"], table["faces"], table.get("assignments"),
            fold_angles=_radians(table.get("fold_angles")),
            families=table.get("families"), welds=table.get("welds", ()),
        )  # fmt: skip
        return _facets(pattern, table)


def _radians(angles: Any) -> Any:
    """Angles (degrees) of a list or table in radians; None stays None."""
    if isinstance(angles, Mapping):
        return {word: math.radians(angle) for word, angle in angles.items()}
    return None if angles is None else np.radians(angles)


def _facets(pattern: Pattern, table: Mapping[str, Any]) -> Pattern:
    """The pattern with convex panels, and flat creases as the file defines (default: hinges)."""
    wanted = table.get(FACETS, HINGE)
    pattern = pattern if wanted == HINGE else welded(pattern, join=wanted == WELD)
    parts = pattern if wanted == LINE else convex(pattern)
    if parts is not pattern:
        warn(f"pattern: {what_was_cut(pattern, parts)}", "facets.md#panels-that-are-not-convex")
    return parts


def _imperfect(pattern: Pattern, section: ImperfectionSection, folder: Path) -> Pattern:
    """The pattern with the imperfection of a section."""
    size = section.amplitude
    if section.file is None:
        return imperfect(pattern, size, correlation=section.correlation, seed=section.seed)
    place = f"file = {show(section.file)}"
    with within(f"{place}: "):
        shapes = load(folder / section.file)
    with renamed({"shapes": place}):
        return imperfect(pattern, size, shapes=shapes, modes=section.modes)


def _thick(pattern: Pattern, sheet: Sheet, offset: Any) -> Pattern:
    """The pattern with panels of the sheet's thickness, with hinges at the given heights."""
    thickness = sheet.values("thickness", len(pattern.faces))
    with renamed({"offsets": f"pattern.{HINGES}", "thickness": "sheet.thickness"}):
        return thicken(pattern, thickness.tolist(), offsets=None if offset == FACES else offset)
