"""[pattern] of a case file: a generator with its arguments, a file, or vertices and panels."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from foldyn.arguments import Placed
from foldyn.cases.decode import signature
from foldyn.errors import Faults, InputError
from foldyn.json_schema import Schema, any_of, closed, described, explained, of_call
from foldyn.patterns import GENERATORS, Pattern
from foldyn.patterns.facets import FACETS as KINDS_OF_FACETS
from foldyn.tables import check_keys
from foldyn.values import choice, nearest, number_or_list, numbers, show

HINGES, FACES = "hinge_offset", "faces"
"""Key of [pattern] for thick panels, and the value of that key for hinges in panel faces."""
FACETS = "facets"
"""Key of [pattern] for the meaning of lines assigned "F"."""
READING = ("scale", "unit", "frame", FACETS, "tolerance", "flat_foldable")
"""Keys of [pattern] in addition to `file`: arguments of `read_pattern`."""
INLINE = ("vertices", "faces", "assignments", "fold_angles", "families", "welds")
"""Keys of [pattern] for a pattern that is written out in the case file."""


class PatternOf(Placed):
    """The table of a pattern."""

    def __init__(self) -> None:
        super().__init__(checked_pattern)

    def schema(self, hint: Any, definitions: dict[str, Schema]) -> Schema:
        """See `Check`."""
        from foldyn.formats import read_pattern  # imported late: it loads many libraries

        more = {
            FACETS: described({"enum": [*KINDS_OF_FACETS]}, 'What lines assigned "F" are.'),
            HINGES: described({}, f'Thick panels: "{FACES}", or heights (m) of their hinges.'),
        }
        made = [of_call(make, word, more) for word, make in GENERATORS.items()]
        options, texts = of_call(read_pattern, "", {})["properties"], explained(Pattern)
        file = {"file": {"type": "string"}, **{key: options[key] for key in READING}, **more}
        own = {key: described({}, texts.get(key)) for key in INLINE}
        inline = closed({**own, **more}, INLINE[:2], Pattern)
        return any_of([*made, closed(file, ["file"], read_pattern), inline])


def checked_pattern(value: Any) -> dict[str, Any]:
    """The table if it describes a pattern; otherwise InputError."""
    if not isinstance(value, Mapping):
        raise InputError(f" = {show(value)}: must be a table, written [pattern]")
    sources = [key for key in ("kind", "file", "vertices") if key in value]
    if len(sources) > 1:
        raise InputError(f": give only one of {' and '.join(sources)}")
    if not sources:
        if "faces" in value:
            raise InputError(".vertices: missing; faces need vertices")
        raise InputError(": give kind (a generator), file, or vertices and faces")
    if "kind" in value:
        _check_generator(value)
    elif "file" in value:
        check_keys(value, ["file", *READING, HINGES])
        if not isinstance(value["file"], str) or not value["file"]:
            raise InputError(f".file = {show(value['file'])}: must be the path of a pattern file")
    else:
        check_keys(value, [*INLINE, FACETS, HINGES])
        if "faces" not in value:
            raise InputError(".faces: missing; give the vertex numbers of every panel")
        _inline(value)
    if FACETS in value:
        choice(f".{FACETS}", value[FACETS], KINDS_OF_FACETS)
    if HINGES in value and value[HINGES] != FACES:
        if isinstance(value[HINGES], str):
            raise InputError(
                f' = {show(value[HINGES])}: give "{FACES}", or heights (m): one for all, one per '
                "crease, or by name",
                f".{HINGES}",
            )
        if not isinstance(value[HINGES], Mapping):
            number_or_list(f".{HINGES}", value[HINGES], "crease")
    return dict(value)


def _check_generator(value: Mapping[str, Any]) -> None:
    """Refuse an unknown generator, and keys that it (or the one with the nearest name) lacks."""
    faults, kind = Faults(), value["kind"]
    with faults.collected():
        choice(".kind", kind, GENERATORS)
    meant = nearest(kind, GENERATORS) if isinstance(kind, str) else None
    if meant is not None:
        with faults.collected():
            check_keys(value, [*signature(GENERATORS[meant]).parameters, "kind", FACETS, HINGES])
    faults.raise_all()


def _inline(value: Mapping[str, Any]) -> None:
    vertices = numbers(".vertices", value["vertices"])
    if vertices.ndim != 2 or vertices.shape[1] not in (2, 3):
        raise InputError(".vertices: must be a list of points [x, y, z]")
    faces = value["faces"]
    if not isinstance(faces, list) or not faces:
        raise InputError(f".faces = {show(faces)}: must be a list of panels, as in [[0, 1, 2]]")
    for i, face in enumerate(faces):
        if not isinstance(face, list) or any(type(vertex) is not int for vertex in face):
            raise InputError(f".faces[{i}] = {show(face)}: must be a list of vertex numbers")
    letters = value.get("assignments", [])
    if not _all(letters, str):
        raise InputError(
            f'.assignments = {show(letters)}: must be a list of letters "M", "V", "F", "U", one '
            'per crease, or a table by family, as { zigzag = "M" }'
        )
    angles = value.get("fold_angles", [])
    if not _all(angles, int, float):
        raise InputError(
            f".fold_angles = {show(angles)}: must be a list of angles (degrees, valleys positive, "
            "nan for none), one per crease, or a table of sizes by family, as { zigzag = 90 }"
        )
    families = value.get("families", {})
    if not isinstance(families, Mapping) or not all(isinstance(f, list) for f in families.values()):
        raise InputError(
            f".families = {show(families)}: must be a table of lists of vertex pairs, as in "
            "{ zigzag = [[0, 1], [1, 2]] }"
        )


def _all(given: Any, *types: type) -> bool:
    """Whether all entries of a list or table have one of the types."""
    if not isinstance(given, list | Mapping):
        return False
    entries = given.values() if isinstance(given, Mapping) else given
    return all(type(entry) in types for entry in entries)
