"""OBJ: meshes of polygons, with the creases that origami programs put into it.

Creases are comment lines ``#e a b kind angle``: two vertices counted from 1, what the edge is, and
a fold angle in degrees. They come from Freeform Origami (T. Tachi) and are shared by other programs
(MERLIN2). The kinds of Freeform Origami, as Origami Simulator writes them (js/saveSTL.js), are 0
boundary, 1 flat, 2 valley, 3 mountain. ORIPA (doc/exporter/ExporterOBJ.java) uses other numbers (1
cut, 2 mountain, 3 valley) and screen coordinates with y downwards. Lines without faces (``l a b
c``) are unassigned creases, or of the kind named by their group, object or material: "mountain",
"valley", "boundary", "facet", "cut".
"""

from __future__ import annotations

import re
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.formats.drawing import METERS, Drawing, coordinate
from foldyn.formats.writers import letters
from foldyn.patterns import Pattern
from foldyn.values import parsed, show

FREEFORM = ("B", "F", "V", "M", "U", "C")
"""Letters of the kinds of `#e`; the last two kinds are Foldyn's, for unassigned creases and
cuts."""
ORIPA = ("U", "B", "M", "V", "F")
GROUPS = {"mountain": "M", "valley": "V", "boundary": "B", "border": "B", "facet": "F",
          "flat": "F", "cut": "C"}  # fmt: skip
"""Letters of lines by the first letters of their group's name."""
_UNIT = re.compile(r"#.*\bunits?\b\s*[:=]?\s*([a-z]+)", re.IGNORECASE)
_COMMENT = re.compile(r"(?<=[^\s#])\s+#.*")  # not one that is a line of its own, which may be #e
_NAMES = {"meters": "m", "millimeters": "mm", "centimeters": "cm", "inches": "in", "feet": "ft"}


class _Crease(NamedTuple):
    edge: tuple[int, int]
    letter: str
    angle: float
    place: str


def read(text: str) -> Drawing:
    """Drawing of an OBJ file; groups, textures, normals and materials are ignored.

    Parameters
    ----------
    text : str
        The file's content.

    Returns
    -------
    Drawing
        With the faces of the file. Unlisted edges of faces are left out: they get the letter of
        their dihedral.

    Raises
    ------
    InputError
        A line cannot be read, or a vertex does not exist; the message names the line.
    """
    vertices: list[list[float]] = []
    faces: list[tuple[int, ...]] = []
    creases: list[_Crease] = []
    lines: list[_Crease] = []
    meters, name, letter = None, "", "U"
    oripa = "ORIPA" in text[:200]
    rows = [line.split() or [""] for line in _lines(text)]
    count = sum(row[0] == "v" for row in rows)
    for number, (word, *rest) in enumerate(rows, 1):
        place, known = f"line {number}", (len(vertices), count)
        if word == "v":
            vertices.append(_coordinates(rest, place))
        elif word == "f":
            faces.append(_corners(rest, known, place))
            if len(rest) < 3:
                raise InputError(": a face needs at least three corners", place)
        elif word == "#e":
            creases.append(_crease(rest, known, place, ORIPA if oripa else FREEFORM))
        elif word == "l":
            chain = _corners(rest, known, place)
            lines += [_Crease((a, b), letter, np.nan, place) for a, b in pairwise(chain) if a != b]
        elif word in ("g", "o", "usemtl"):
            group = " ".join(rest)
            found = (own for start, own in GROUPS.items() if group.lower().startswith(start))
            letter = next(found, letter)
            name = group if word == "o" and not name else name
        elif word.startswith("#"):
            meters = meters or _meters(" ".join([word, *rest]))
    if not vertices:
        raise InputError("not an OBJ file of a pattern: it has no vertices (lines v x y z).")
    if faces:  # lines without more information would override letters that follow from dihedrals
        lines = [each for each in lines if each.letter != "U"]
    marked = {tuple(sorted(each.edge)) for each in creases}
    every = [*creases, *(each for each in lines if tuple(sorted(each.edge)) not in marked)]
    points = np.array(vertices)
    if oripa:
        points[:, 1] *= -1.0
        faces = [face if _area(points[list(face)]) > 0.0 else face[::-1] for face in faces]
    edges = np.array([each.edge for each in every], dtype=np.int64).reshape(-1, 2)
    told, places = tuple(each.letter for each in every), tuple(each.place for each in every)
    panels = tuple(faces) or None
    return Drawing(points, edges, told, _angles(every), panels, meters, name=name, places=places)


def _lines(text: str) -> list[str]:
    """Lines without trailing comments; a trailing backslash joins a line with the next.

    The next line becomes empty, so that line numbers do not change.
    """
    lines, begun = [], ""
    for line in text.splitlines():
        whole = begun + _COMMENT.sub("", line)
        begun = f"{whole[:-1]} " if whole.endswith("\\") else ""
        lines.append("" if begun else whole)
    return lines


def _coordinates(words: list[str], place: str) -> list[float]:
    """Coordinates (3,) of a vertex; a weight or color after them is ignored."""
    if len(words) < 2:
        raise InputError(f": v {show(' '.join(words))}: give x y z, three numbers", place)
    return [coordinate(word, place, " ".join(["v", *words])) for word in [*words[:3], "0"][:3]]


def _corners(words: list[str], known: tuple[int, int], place: str) -> tuple[int, ...]:
    """Vertex numbers from 0 of a face or line; each may carry a texture and a normal."""
    return tuple(_vertex(word.partition("/")[0], known, place) for word in words)


def _vertex(word: str, known: tuple[int, int], place: str) -> int:
    """Vertex number from 0; negative numbers count back from the latest vertex.

    known : number of vertices so far, and in the whole file
    """
    before, count = known
    try:
        number = parsed(word, int) if len(word) < 20 else 0
    except ValueError:
        number = 0
    if not (1 <= number <= count or 1 <= -number <= before):
        raise InputError(f": {show(word)} is no vertex; they are counted from 1 to {count}", place)
    return number - 1 if number > 0 else before + number


def _area(corners: NDArray) -> float:
    """Signed area of a polygon (k, 3) in the plane z = 0."""
    x, y = corners[:, 0], corners[:, 1]
    with np.errstate(over="ignore", invalid="ignore"):  # of coordinates that are refused later
        return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def _crease(
    words: list[str], known: tuple[int, int], place: str, kinds: tuple[str, ...]
) -> _Crease:
    """Crease of a line #e a b kind angle; kind and angle are optional."""
    if len(words) < 2:
        raise InputError(": #e needs two vertices, then a kind and an angle", place)
    a, b = (_vertex(word, known, place) for word in words[:2])
    if a == b:
        raise InputError(f": #e joins vertex {words[0]} with itself", place)
    kind = words[2] if len(words) > 2 else "4"
    known_kinds = {str(k): letter for k, letter in enumerate(kinds)} | {k: k for k in "BMVFUCJ"}
    if kind not in known_kinds:
        raise InputError(f": {show(kind)} is no kind of edge: give 0 to {len(kinds) - 1}", place)
    try:
        angle = parsed(words[3]) if len(words) > 3 else np.nan
    except ValueError:
        angle = np.inf
    if not np.isnan(angle) and abs(angle) > 180.0 + 1e-9:
        raise InputError(f": {show(words[3])}: give an angle from -180 to 180 degrees", place)
    # some programs write angles without sign
    angle = -abs(angle) if known_kinds[kind] == "M" else angle
    return _Crease((a, b), known_kinds[kind], float(np.clip(angle, -180.0, 180.0)), place)


def _angles(creases: list[_Crease]) -> NDArray[np.float64]:
    """Fold angles (degrees); if all are 0, the program only filled the column."""
    angles = np.array([each.angle for each in creases])
    return np.full(len(angles), np.nan) if not np.nan_to_num(angles).any() else angles


def _meters(comment: str) -> float | None:
    """Length of the unit (m) that a comment names."""
    found = _UNIT.match(comment)
    word = found[1].lower() if found else ""
    return METERS.get(_NAMES.get(word, word))


def write(pattern: Pattern) -> str:
    """Text of an OBJ file, in meters: vertices, faces, and all edges as #e lines.

    Parameters
    ----------
    pattern : Pattern
        The pattern to write. Angles of edges are its `fold_angles`, and are omitted if not given.

    Returns
    -------
    str
    """
    lines = ["# Foldyn", "# unit: m", "# edges: #e vertex vertex kind angle; kinds: "
             "0 boundary, 1 flat, 2 valley, 3 mountain, 4 unassigned, 5 cut"]  # fmt: skip
    if pattern.name:
        lines.append(f"o {' '.join(pattern.name.split())}")
    lines += ["v " + " ".join(map(repr, point)) for point in pattern.vertices.tolist()]
    lines += ["f " + " ".join(str(v + 1) for v in face) for face in pattern.faces]
    for (a, b), letter, angle in letters(pattern):
        told = "" if np.isnan(angle) else f" {float(np.degrees(angle))!r}"
        lines.append(f"#e {a + 1} {b + 1} {FREEFORM.index(letter)}{told}")
    return "\n".join(lines) + "\n"
