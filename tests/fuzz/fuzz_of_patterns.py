"""Fuzzer of FOLD files."""

from __future__ import annotations

from pathlib import Path

from fuzz_target import Target

from foldyn.formats import fold, read_pattern
from foldyn.patterns import GENERATORS

WORDS = (
    "vertices_coords", "faces_vertices", "edges_vertices", "edges_assignment", "edges_foldAngle",
    "file_frames", "frame_unit", "frame_title", "mm", "in", "M", "V", "F", "B", "U", "C", "J",
)  # fmt: skip


def seeds(_: Path) -> list[bytes]:
    """Every pattern that there is, as we write it."""
    patterns = [make() for make in GENERATORS.values()]
    return [fold.write(pattern).replace('"m"', '"mm"').encode() for pattern in patterns]


TARGET = Target("fold", seeds, read_pattern, ".fold", WORDS)
