"""Fuzzers of pattern files that hold panels: FOLD and OBJ."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path

from fuzz_target import Target

from foldyn.errors import InputError
from foldyn.formats import Frame, diagnose, fold, obj
from foldyn.patterns import GENERATORS, miura

FOLD_WORDS = (
    "vertices_coords", "faces_vertices", "edges_vertices", "edges_assignment", "edges_foldAngle",
    "edges_foldAngles", "file_frames", "frame_inherit", "frame_parent", "frame_unit", "frame_title",
    "foldyn:families", "a:b", "mm", "in", "M", "V", "F", "B", "U", "C", "J",
)  # fmt: skip
OBJ_WORDS = (
    "v", "f", "l", "#e", "vt", "vn", "g", "o", "usemtl", "mountain", "cut", "# unit: mm", "1/2/3",
    "1//2", "-1", "ORIPA", "#", "\\\n", "180", "-90.5",
)  # fmt: skip
ORIPA = "# Created by ORIPA\nv 0 0 0\nv 9 0 0\nv 9 9 0\nv 0 9 0\nf 1 2 3\nf 3 4 1\n#e 1 3 2 180\n"
LINES = "# unit: mm\nv 0 0\nv 9 0\nv 9 9\nv 0 9\ng boundary\nl 1 2 3 4 1\ng mountain\nl 1 3\n"


def _patterns() -> list:
    """Every pattern that there is, and a flat one with all that one can have."""
    flat = miura(cells=(2, 1), dihedral=180)
    angles = [0.1 * k if k % 3 else None for k in range(len(flat.creases))]
    told = flat.changed(
        fold_angles=angles, families={"a": flat.creases[:2]}, custom={"a:b": [1, None]}
    )
    return [*(make() for make in GENERATORS.values()), told]


def _fold(_: Path) -> list[bytes]:
    texts = [fold.write(pattern).replace('"m"', '"mm"') for pattern in _patterns()]
    flat, folded = miura(dihedral=180), miura()
    texts.append(fold.write(flat, [Frame("a", folded.vertices), Frame("b", flat.vertices)]))
    lines = json.loads(texts[-1])
    del lines["faces_vertices"]
    return [text.encode() for text in (*texts, json.dumps(lines).replace("]]", ",]]"))]


def _obj(_: Path) -> list[bytes]:
    return [text.encode() for text in (*map(obj.write, _patterns()), ORIPA, LINES)]


def _read(file: Path) -> str:
    """Read a file, with all that is said of it."""
    return str(diagnose(file).diagnosis)


def _read_frames(file: Path) -> str:
    """Read the first two frames of a file; the key frame must be sound if the other is."""
    with suppress(InputError):
        diagnose(file, frame=1)
    return _read(file)


TARGETS = (
    Target("fold", _fold, _read_frames, ".fold", FOLD_WORDS),
    Target("obj", _obj, _read, ".obj", OBJ_WORDS),
)
