"""FOLD writer: version 1.2, in meters, with frames for the states of a result."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.formats.fold import FAMILIES, WELDS
from foldyn.formats.writers import is_plane, letters
from foldyn.patterns import Pattern
from foldyn.patterns.frames import Frame, fold_angles
from foldyn.patterns.topology import edge_lookup


def write(pattern: Pattern, frames: Sequence[Frame] = ()) -> str:
    """Text of a FOLD file (1.2), from which the same pattern can be read to the last digit.

    Parameters
    ----------
    pattern : Pattern
        The key frame. Its fold angles are the ones to fold to, if given, or else the current angles
        of a folded pattern; a flat pattern without angles has none.
    frames : sequence of Frame, optional
        Further states, which inherit all but coordinates and fold angles from the key frame.

    Returns
    -------
    str
        JSON with vertices (two coordinates when all z are 0), faces, edges, their assignment
        and fold angle (degrees, valleys positive; 0 on the boundary), in meters.
    """
    flat = is_plane(pattern)
    there = fold_angles(pattern)
    folded = not flat or bool(np.any(np.abs(there) > 1e-6))
    row = edge_lookup(pattern.creases)
    edges = letters(pattern)
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
        **({FAMILIES: _named(pattern)} if pattern.families else {}),
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
    """Angles of all edges from those of the creases; 0 on the boundary, None if unknown."""
    found = [0.0 if k is None else float(np.degrees(angles[k])) for k in rows]
    return [None if np.isnan(angle) else angle for angle in found]


def _named(pattern: Pattern) -> dict[str, list[list[int]]]:
    """Vertex pairs of the creases of each family."""
    return {name: pattern.creases[rows].tolist() for name, rows in pattern.families.items()}


def _json(value: Any) -> str:
    """JSON with one line for each row of a table."""
    if isinstance(value, list) and value and isinstance(value[0], list):
        return "[\n" + ",\n".join(f"    {json.dumps(row)}" for row in value) + "\n  ]"
    return json.dumps(value)
