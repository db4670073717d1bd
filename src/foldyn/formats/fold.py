"""FOLD (Flexible Origami List Datastructure), specification 1.x, with given faces.

Only the key frame is read: the fields at the top level of the file. The geometry comes from
`vertices_coords` and `faces_vertices`, the letters of creases from `edges_assignment`;
`edges_foldAngle` is written but not read: the vertices say how far a crease is folded.
Source of the format: https://github.com/edemaine/fold (doc/spec.md).
"""

from __future__ import annotations

import json
import re
import warnings
from collections import Counter
from typing import Any

import numpy as np

from foldyn.errors import FoldynWarning, InputError
from foldyn.input_files import from_json
from foldyn.patterns import Pattern
from foldyn.patterns.geometry import seams
from foldyn.patterns.topology import Edge, edge_lookup, edge_of

_ASSIGNMENTS = ("B", "M", "V", "F", "U", "C", "J")
# Units per meter of `frame_unit`; "unit" means none, taken as meters.
_PER_METER = {
    "unit": 1.0,
    "m": 1.0,
    "cm": 1e2,
    "mm": 1e3,
    "um": 1e6,
    "nm": 1e9,
    "in": 1 / 0.0254,
    "pt": 72 / 0.0254,
}
_FIELDS = {
    "vertices": "vertices_coords",
    "faces": "faces_vertices",
    "assignments": "edges_assignment",
}


def read(text: str) -> Pattern:
    """Pattern of the key frame of a FOLD file.

    Parameters
    ----------
    text : str
        The file's content.

    Returns
    -------
    Pattern
        Coordinates in meters: `frame_unit` is converted; absent or "unit" counts as meters.
        Creases that the file does not list get the letter of their dihedral.

    Raises
    ------
    InputError
        Not a FOLD file, or one without faces, or inconsistent; the message names the field.

    Warns
    -----
    FoldynWarning
        Parts of the file that a pattern cannot hold (edges of no face, a mountain or valley on
        the boundary, an unknown unit) and letters that contradict the geometry.
    """
    frame = _frame(text)
    vertices = _vertices(frame) / _scale(frame.get("frame_unit", "unit"))
    faces = _list(frame, "faces_vertices")
    title = frame.get("frame_title") or frame.get("file_title") or ""
    try:
        # Twice, as only sound faces tell which listed edges are creases.
        with warnings.catch_warnings():  # what the second one says again
            warnings.simplefilter("ignore", FoldynWarning)
            bare = Pattern(vertices, faces)
        letters = _letters(frame, bare)
        return Pattern(vertices, faces, letters, name=str(title))
    except InputError as error:
        message = re.sub(r"^\w+", lambda m: _FIELDS.get(m[0], m[0]), str(error))
        raise InputError(message) from None


def write(pattern: Pattern) -> str:
    """Text of a FOLD file; reading it gives the same pattern to the last digit.

    Parameters
    ----------
    pattern : Pattern
        What to write.

    Returns
    -------
    str
        JSON with vertices (two coordinates when all z are 0), faces, edges, their assignment
        and fold angle (180 minus the dihedral, degrees; 0 on the boundary), in meters.
    """
    if pattern.boards is not None:
        warnings.warn(
            "pattern: the file has no place for the thickness of its panels and holds the planes "
            "through their hinge lines; write the thin pattern, and thicken what is read",
            FoldynWarning,
            stacklevel=4,
        )
    flat = not np.any(pattern.vertices[:, 2])
    folded = bool(np.any(np.abs(pattern.dihedrals - np.pi) > 1e-6)) or not flat
    row = edge_lookup(pattern.creases)
    pairs = seams(pattern.vertices, pattern.faces, pattern.face_normals, pattern.boundary)
    cuts = {edge for pair in pairs for edge in pair}
    edges = [edge_of(a, b) for a, b in pattern.edges.tolist()]
    rows = [row.get(edge) for edge in edges]
    angles = 180.0 - np.degrees(pattern.dihedrals) + np.degrees(pattern.flat_dihedrals - np.pi)
    fields: dict[str, Any] = {
        "file_spec": 1.1,
        "file_creator": "Foldyn",
        "file_classes": ["singleModel"],
        **({"frame_title": pattern.name} if pattern.name else {}),
        "frame_classes": ["foldedForm" if folded else "creasePattern"],
        "frame_attributes": ["2D" if flat else "3D"],
        "frame_unit": "m",
        "vertices_coords": pattern.vertices[:, : 2 if flat else 3].tolist(),
        "faces_vertices": [list(face) for face in pattern.faces],
        "edges_vertices": pattern.edges.tolist(),
        "edges_assignment": [
            pattern.assignments[k] if k is not None else "C" if edge in cuts else "B"
            for k, edge in zip(rows, edges, strict=True)
        ],
        "edges_foldAngle": [0.0 if k is None else float(angles[k]) for k in rows],
    }
    return "{\n" + ",\n".join(f"  {json.dumps(k)}: {_json(v)}" for k, v in fields.items()) + "\n}\n"


def _json(value: Any) -> str:
    """JSON with one line for each row of a table."""
    if isinstance(value, list) and value and isinstance(value[0], list):
        return "[\n" + ",\n".join(f"    {json.dumps(row)}" for row in value) + "\n  ]"
    return json.dumps(value)


def _frame(text: str) -> dict[str, Any]:
    try:
        frame = from_json(text)
    except InputError as error:
        raise InputError(f"{error}, as a FOLD file must be.") from None
    if not isinstance(frame, dict):
        raise InputError("not a FOLD file: its top level must be a JSON object with named fields.")
    for field, what in (("vertices_coords", "coordinates"), ("faces_vertices", "faces")):
        if field not in frame:
            hint = f"export the pattern with its {what}"
            frames = frame.get("file_frames")
            if isinstance(frames, list) and any(isinstance(f, dict) and field in f for f in frames):
                hint = (
                    "only other frames (file_frames) have it, and only the key frame is read: "
                    "export the wanted frame as a file of its own"
                )
            raise InputError(f"{field} is missing: {hint}.")
    return frame


def _list(frame: dict[str, Any], field: str) -> list[Any]:
    value = frame[field]
    if not isinstance(value, list):
        raise InputError(f"{field} must be a list, not {_short(value)}.")
    return value


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _vertices(frame: dict[str, Any]) -> np.ndarray:
    rows = _list(frame, "vertices_coords")
    result = np.zeros((len(rows), 3))
    for v, row in enumerate(rows):
        if not isinstance(row, list) or len(row) not in (2, 3) or not all(map(_is_number, row)):
            raise InputError(
                f"vertices_coords[{v}] = {_short(row)}: give 2 or 3 numbers for each vertex."
            )
        try:
            result[v, : len(row)] = row
        except OverflowError:
            result[v] = np.inf
        if not np.isfinite(result[v]).all():
            raise InputError(
                f"vertices_coords[{v}] = {_short(row)}: coordinates must be finite numbers."
            )
    return result


def _scale(unit: Any) -> float:
    if isinstance(unit, str) and unit in _PER_METER:
        return _PER_METER[unit]
    warnings.warn(
        f"frame_unit = {_short(unit)} is unknown: coordinates are taken as meters; known units "
        f"are {', '.join(_PER_METER)}.",
        FoldynWarning,
        stacklevel=5,
    )
    return 1.0


def _letters(frame: dict[str, Any], bare: Pattern) -> dict[Edge, str]:
    """Letters of the creases, and "B" for edges that meet others without being joined."""
    if "edges_assignment" not in frame and "edges_vertices" not in frame:
        return {}
    if "edges_vertices" not in frame:
        raise InputError("edges_vertices is missing: edges_assignment has nothing to refer to.")
    edges = _list(frame, "edges_vertices")
    for field in ("edges_assignment", "edges_foldAngle"):
        if field in frame and len(_list(frame, field)) != len(edges):
            raise InputError(
                f"{field} has {len(frame[field])} entries for {len(edges)} in edges_vertices: "
                "give one for each edge."
            )
    pairs = [_pair(e, edge, len(bare.vertices)) for e, edge in enumerate(edges)]
    creases, boundary = edge_lookup(bare.creases), edge_lookup(bare.boundary)
    letters: dict[Edge, str] = {}
    ignored: Counter[str] = Counter()
    for e, pair in enumerate(pairs):
        letter = frame["edges_assignment"][e] if "edges_assignment" in frame else None
        if letter is not None and letter not in _ASSIGNMENTS:
            raise InputError(
                f"edges_assignment[{e}] = {_short(letter)}: give one of {', '.join(_ASSIGNMENTS)}."
            )
        if pair in creases:
            if letter is not None and letters.setdefault(pair, letter) != letter:
                raise InputError(
                    f"edges_assignment[{e}]: edge {pair} is given both {letters[pair]!r} and "
                    f"{letter!r}; list it once."
                )
        elif pair not in boundary:
            ignored["belong to no face"] += 1
        elif letter == "C" or (letter == "B" and bare.vertices[:, 2].any()):
            letters[pair] = "B"  # a cut, or edges that meet where the sheet is folded
        elif letter in ("M", "V"):
            ignored["are mountains or valleys although only one face has them"] += 1
    for what, count in ignored.items():
        warnings.warn(
            f"edges_vertices: {count} edges {what}; they are ignored.", FoldynWarning, stacklevel=5
        )
    return letters


def _pair(e: int, edge: Any, n_vertices: int) -> Edge:
    known = range(n_vertices)
    pair = isinstance(edge, list) and len(edge) == 2 and edge[0] != edge[1]
    if not pair or not all(type(v) is int and v in known for v in edge):
        raise InputError(
            f"edges_vertices[{e}] = {_short(edge)}: give two different vertex numbers from 0 to "
            f"{n_vertices - 1}."
        )
    return edge_of(*edge)
