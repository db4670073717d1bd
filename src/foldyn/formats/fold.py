"""FOLD (Flexible Origami List Datastructure), specifications 1.0 to 1.2.

Source of the format: https://github.com/edemaine/fold (doc/spec.md). The reader takes from one
frame the coordinates, edges with their assignments and fold angles, faces if given, the unit, and
data of other programs (keys with a colon).
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.formats.drawing import METERS, Drawing, count
from foldyn.formats.writers import letters
from foldyn.input_files import from_json
from foldyn.patterns import Pattern
from foldyn.patterns.frames import Frame, fold_angles
from foldyn.patterns.topology import edge_rows
from foldyn.patterns.transforms import FACE_ORDERS
from foldyn.values import choice, show, whole

ASSIGNMENTS = ("B", "M", "V", "F", "U", "C", "J")
FAMILIES = "foldyn:families"
"""Key of the families of creases: lists of vertex pairs by name."""
WELDS = "foldyn:welds"
"""Key of the flat edges that are welds: vertex pairs; other flat edges are hinges."""
_OLD = {"edges_foldAngles": "edges_foldAngle", "edges_lengths": "edges_length"}  # spec 1.0
_COMMA = re.compile(r'("(?:[^"\\]|\\.)*+")|,(?=\s*+[\]}])')
_OF_ELEMENTS = re.compile(r"(?:vertices|edges|faces)_")
_ANCESTORS = 1000


def read(text: str, frame: int | str | None = None) -> Drawing:
    """Drawing of one frame of a FOLD file.

    Parameters
    ----------
    text : str
        The file's content.
    frame : int or str, optional
        Number of the frame (0 is the key frame, the top level of the file) or its title; by
        default the key frame.

    Returns
    -------
    Drawing
        With faces if the file has them. Unassigned edges of faces are left out: they get the letter
        of their dihedral.

    Raises
    ------
    InputError
        The text is not a FOLD file, lacks the frame, or is inconsistent; the message names the
        field.
    """
    document, repairs = _document(text)
    fields = _frame(document, frame)
    for field, what in (("vertices_coords", "coordinates"), ("edges_vertices", "edges")):
        if field not in fields and not (what == "edges" and "faces_vertices" in fields):
            raise InputError(f"{field} is missing: {_with_field(document, field, what)}.")
    vertices = _vertices(_list(fields, "vertices_coords"))
    faces = _faces(fields, len(vertices))
    repairs += _mend_letters(fields)
    edges, assignments, angles = _edges(fields, len(vertices), faces is not None)
    custom, dropped = _custom(fields)
    if dropped:
        repairs.append(f"{', '.join(dropped)} left out: they list elements by number")
    unit = fields.get("frame_unit", document.get("frame_unit", "unit"))
    if unit != "unit" and not (isinstance(unit, str) and unit in METERS):
        repairs.append(f"frame_unit = {show(unit)} is unknown, and left out")
        unit = "unit"
    title = fields.get("frame_title") or document.get("file_title") or ""
    places = tuple(f"edges_vertices[{e}]" for e in range(len(assignments)))
    welds = _pairs(WELDS, _list(fields, WELDS), len(vertices)) if WELDS in fields else None
    return Drawing(
        vertices, edges, assignments, angles, faces, METERS.get(unit), name=str(title),
        places=places, repairs=tuple(repairs), doubts=_angle_doubts(angles),
        families=_families(fields.get(FAMILIES, {}), len(vertices)),
        welds=welds, custom=custom,
    )  # fmt: skip


def _document(text: str) -> tuple[dict[str, Any], list[str]]:
    """Top level of the file, and repairs needed to read it."""
    repairs: list[str] = []
    repeated: list[str] = []
    try:
        document = from_json(text, repeated)
    except InputError as error:
        mended = _COMMA.sub(lambda found: found[1] or "", text)
        commas = len(text) - len(mended)
        try:
            document = from_json(mended if commas else text, repeated)
        except InputError:
            raise InputError(f"{error}, as a FOLD file must be.") from None
        repairs.append(f"{count(commas, 'comma')} before a closing bracket removed")
    repairs += [f"{show(key)} is there twice, of which the last counts" for key in repeated]
    if not isinstance(document, dict):
        raise InputError("not a FOLD file: its top level must be a JSON object with named fields.")
    return document, repairs


def _frame(document: dict[str, Any], chosen: int | str | None) -> dict[str, Any]:
    """Fields of a frame, including inherited fields."""
    others = document.get("file_frames", [])
    if not isinstance(others, list) or not all(isinstance(each, dict) for each in others):
        raise InputError("file_frames must be a list of JSON objects, one for each frame.")
    frames = [{key: value for key, value in document.items() if key != "file_frames"}, *others]
    number = _number(frames, chosen)
    fields: dict[str, Any] = {}
    seen: set[int] = set()
    while True:
        if number in seen or len(seen) > _ANCESTORS:
            raise InputError(
                f"file_frames[{number - 1}].frame_parent: the frame inherits from itself; correct "
                "its frame_parent."
            )
        seen.add(number)
        own = {_OLD.get(key) or key: value for key, value in frames[number].items()}
        fields = {**own, **fields}
        if number == 0 or own.get("frame_inherit") is not True:
            return fields
        parent = own.get("frame_parent", 0)
        if type(parent) is not int or not 0 <= parent < len(frames):
            raise InputError(
                f"file_frames[{number - 1}].frame_parent = {show(parent)}: give the number of a "
                f"frame, from 0 to {len(frames) - 1}."
            )
        number = parent


def _number(frames: Sequence[dict[str, Any]], chosen: int | str | None) -> int:
    """Number of the requested frame."""
    if chosen is None:
        return 0
    titles = [each.get("frame_title", "") for each in frames]
    if isinstance(chosen, str):
        found = [k for k, title in enumerate(titles) if title == chosen]
        if len(found) == 1:
            return found[0]
        has = f"{len(found)} frames" if found else "no frame"
        known = ", ".join(show(title) for title in titles[:12] if title) or "none"
        raise InputError(
            f": the file has {has} with the title {show(chosen)}; titles are {known}", "frame"
        )
    what = "the number of a frame of the file; or give its title"
    return whole("frame", chosen, least=0, most=len(frames) - 1, what=what)


def _with_field(document: dict[str, Any], field: str, what: str) -> str:
    """Say which frames have a field, or how to add it."""
    frames = document.get("file_frames") or []
    having = [str(k) for k, each in enumerate(frames, 1) if field in each]
    if not having:
        return f"export the pattern with its {what}"
    listed = ", ".join(having[:6]) + (", ..." if len(having) > 6 else "")
    return f"only other frames have it; choose one by frame = {listed}"


def _list(fields: dict[str, Any], name: str) -> list[Any]:
    value = fields[name]
    if not isinstance(value, list):
        raise InputError(f"{name} must be a list, not {show(value)}.")
    return value


def _check(name: str, rows: list[Any], sound: Callable[[Any], bool], give: str) -> None:
    """Refuse the first invalid row, and say what to give."""
    for k, row in enumerate(rows):
        if not sound(row):
            raise InputError(f"{name}[{k}] = {show(row)}: give {give}.")


def _is_number(value: Any) -> bool:
    """Whether a value is a finite number that fits a Python float."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300


def _are_below(row: Any, count: int) -> bool:
    """Whether a row is a list of whole numbers from 0 to below a count."""
    return isinstance(row, list) and all(type(n) is int and 0 <= n < count for n in row)


def _vertices(rows: list[Any]) -> NDArray[np.float64]:
    def sound(row: Any) -> bool:
        return isinstance(row, list) and len(row) in (2, 3) and all(map(_is_number, row))

    _check("vertices_coords", rows, sound, "2 or 3 numbers for each vertex, all finite")
    return np.array([[*row, 0.0][:3] for row in rows], np.float64).reshape(-1, 3)


def _faces(fields: dict[str, Any], count: int) -> tuple[tuple[int, ...], ...] | None:
    if "faces_vertices" not in fields:
        return None
    faces = _list(fields, "faces_vertices")
    give = f"at least three vertex numbers from 0 to {count - 1}"
    _check("faces_vertices", faces, lambda row: _are_below(row, count) and len(row) > 2, give)
    return tuple(map(tuple, faces)) or None  # some programs write an empty list


def _mend_letters(fields: dict[str, Any]) -> list[str]:
    """Capitalize small letters and replace null by "U"; return what was repaired."""
    given = fields.get("edges_assignment")
    if not isinstance(given, list):
        return []
    letters = ["U" if each is None else each for each in given]
    letters = [each.upper() if isinstance(each, str) else each for each in letters]
    fields["edges_assignment"] = letters
    missing = sum(each is None for each in given)
    small = sum(one != other for one, other in zip(given, letters, strict=True)) - missing
    found = (missing, "null", "U, unassigned"), (small, "small letter", "large")
    told = [f"{count(times, what)} taken as {meant}" for times, what, meant in found if times]
    return [f"edges_assignment: {each}" for each in told]


def _angle_doubts(angles: NDArray[np.float64]) -> tuple[str, ...]:
    """Doubts about fold angles that look like radians."""
    largest = float(np.abs(np.nan_to_num(angles)).max(initial=0.0))
    if abs(largest - np.pi) > 1e-3:
        return ()
    return (
        f"edges_foldAngle: the largest is {largest:.5g}, as if they were radians; they are "
        "read as degrees, the unit of FOLD",
    )


def _edges(
    fields: dict[str, Any], count: int, with_faces: bool
) -> tuple[NDArray[np.int64], tuple[str, ...], NDArray[np.float64]]:
    """Edges with their letters and fold angles (degrees)."""
    lists = "edges_assignment", "edges_foldAngle"
    if "edges_vertices" not in fields:
        orphan = next((name for name in lists if name in fields), None)
        if orphan is not None:
            raise InputError(f"edges_vertices is missing: {orphan} has nothing to refer to.")
        return np.zeros((0, 2), dtype=np.int64), (), np.zeros(0)
    edges = _list(fields, "edges_vertices")
    for name in lists:
        if name in fields and len(_list(fields, name)) != len(edges):
            raise InputError(
                f"{name} has {len(fields[name])} entries for {len(edges)} in edges_vertices: "
                "give one for each edge."
            )
    pairs = _pairs("edges_vertices", edges, count)
    letters = [
        choice(f"edges_assignment[{e}]", letter, ASSIGNMENTS)
        for e, letter in enumerate(fields.get("edges_assignment", ()))
    ]
    given = fields.get("edges_foldAngle", [None] * len(edges))
    give = "degrees from -180 (a closed mountain) to 180 (a closed valley), or null"
    _check("edges_foldAngle", given, _is_angle, give)
    angles = np.array([np.nan if angle is None else angle for angle in given], np.float64)
    if "edges_assignment" not in fields:  # edges of faces get their letter from the dihedral
        letters = ["V" if a > 0 else "M" if a < 0 else "" if with_faces else "U" for a in angles]
    told = [e for e, letter in enumerate(letters) if letter]
    ends = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    return ends[told], tuple(letters[e] for e in told), np.clip(angles[told], -180.0, 180.0)


def _pairs(name: str, rows: list[Any], count: int) -> list[tuple[int, int]]:
    """Pairs of vertices."""

    def sound(row: Any) -> bool:
        return _are_below(row, count) and len(row) == 2 and row[0] != row[1]

    _check(name, rows, sound, f"two different vertex numbers from 0 to {count - 1}")
    return [(a, b) for a, b in rows]


def _is_angle(angle: Any) -> bool:
    return angle is None or (_is_number(angle) and abs(angle) <= 180.0 + 1e-9)


def _custom(fields: dict[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """Data of other programs, and the keys of such data that would not fit a repaired pattern."""
    keys = [key for key in fields if ":" in key and key not in (FAMILIES, WELDS)]
    dropped = [key for key in keys if _OF_ELEMENTS.match(key)]
    custom = {key: fields[key] for key in keys if key not in dropped}
    if FACE_ORDERS in fields:
        custom[FACE_ORDERS] = _face_orders(fields)
    return custom, dropped


def _face_orders(fields: dict[str, Any]) -> list[list[int]]:
    """Order of the layers: rows (f, g, s), panel f above (1) or below (-1) g, 0 if unknown."""
    count, rows = len(fields.get("faces_vertices", ())), _list(fields, FACE_ORDERS)

    def sound(row: Any) -> bool:
        pair = isinstance(row, list) and len(row) == 3 and _are_below(row[:2], count)
        return pair and type(row[2]) is int and abs(row[2]) < 2

    _check(FACE_ORDERS, rows, sound, f"two face numbers from 0 to {count - 1}, and 1, -1 or 0")
    return rows


def _families(given: Any, count: int) -> dict[str, list[tuple[int, int]]]:
    """Vertex pairs of the creases of each family."""
    if not isinstance(given, dict) or not all(isinstance(pairs, list) for pairs in given.values()):
        raise InputError(f"{FAMILIES}: give a list of vertex pairs for each name.")
    return {name: _pairs(f"{FAMILIES}[{show(name)}]", rows, count) for name, rows in given.items()}


def write(pattern: Pattern, frames: Sequence[Frame] = ()) -> str:
    """Text of a FOLD file (1.2), from which the same pattern can be read to the last digit.

    Parameters
    ----------
    pattern : Pattern
        The key frame. Written fold angles are the angles to fold to, if given, or else the current
        angles of a folded pattern; a flat pattern without angles gets none.
    frames : sequence of Frame, optional
        Further states, which inherit all but coordinates and fold angles from the key frame.

    Returns
    -------
    str
        JSON with vertices (two coordinates when all z are 0), faces, edges, their assignment
        and fold angle (degrees, valleys positive; 0 on the boundary), in meters.
    """
    flat = not pattern.vertices[:, 2].any()
    there = fold_angles(pattern)
    folded = not flat or bool(np.any(np.abs(there) > 1e-6))
    row = {edge: rows[0] for edge, rows in edge_rows(pattern.creases).items() if len(rows) == 1}
    edges = letters(pattern)
    named = {name: pattern.creases[own].tolist() for name, own in pattern.families.items()}
    rows = [row.get(edge) for edge, *_ in edges]
    wanted = pattern.fold_angles
    angles = there if np.isnan(wanted).all() and folded else wanted
    fields: dict[str, Any] = {
        "file_spec": 1.2,
        "file_creator": "Foldyn",
        "file_classes": ["animation" if frames else "singleModel"],
        **({"frame_title": pattern.name} if pattern.name else {}),
        "frame_classes": ["foldedForm" if folded else "creasePattern"],
        "frame_attributes": ["2D" if flat else "3D"],
        "frame_unit": "m",
        "vertices_coords": pattern.vertices[:, : 2 if flat else 3].tolist(),
        "faces_vertices": [list(face) for face in pattern.faces],
        "edges_vertices": pattern.edges.tolist(),
        "edges_assignment": [letter for _, letter, _ in edges],
        **({} if np.isnan(angles).all() else {"edges_foldAngle": _degrees(angles, rows)}),
        **({FAMILIES: named} if named else {}),
        **({WELDS: pattern.welds.tolist()} if any(letter == "F" for _, letter, _ in edges) else {}),
        **pattern.custom,
    }
    lines = [f"  {json.dumps(key)}: {_json(value)}" for key, value in fields.items()]
    if frames:
        inside = ",\n".join(f"    {json.dumps(_state(pattern, f, rows))}" for f in frames)
        lines.append(f'  "file_frames": [\n{inside}\n  ]')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _state(pattern: Pattern, frame: Frame, rows: Sequence[int | None]) -> dict[str, Any]:
    """Fields of a frame that inherits the rest from the key frame."""
    return {
        "frame_title": frame.title,
        "frame_classes": ["foldedForm"],
        "frame_attributes": ["3D"],
        "frame_parent": 0,
        "frame_inherit": True,
        "vertices_coords": frame.vertices.tolist(),
        "edges_foldAngle": _degrees(fold_angles(pattern, frame.vertices), rows),
    }


def _degrees(angles: NDArray, rows: Sequence[int | None]) -> list[float | None]:
    """Angles of all edges from the angles of creases; 0 on the boundary, None if unknown."""
    found = [0.0 if k is None else float(np.degrees(angles[k])) for k in rows]
    return [None if np.isnan(angle) else angle for angle in found]


def _json(value: Any) -> str:
    """JSON with one line for each row of a table."""
    if isinstance(value, list) and value and isinstance(value[0], list):
        return "[\n" + ",\n".join(f"    {json.dumps(row)}" for row in value) + "\n  ]"
    return json.dumps(value)
