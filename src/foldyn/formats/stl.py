"""STL: the triangles of a flat or folded pattern, for printers and viewers; written only.

The text form, in millimeters, because the format has no unit and these programs assume millimeters.
Panels with more than three corners are cut into triangles between their corners; creases are lost.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.patterns import Pattern
from foldyn.patterns.facets import triangles_of

PER_METER = 1e3


def write(pattern: Pattern) -> str:
    """Text of an STL file.

    Parameters
    ----------
    pattern : Pattern
        The pattern; panels are written counter-clockwise seen from the front.

    Returns
    -------
    str
    """
    name = " ".join(pattern.name.split()) or "foldyn"
    corners = PER_METER * pattern.vertices[triangles(pattern)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    lines = [f"solid {name}"]
    for normal, three in zip(normals.tolist(), corners.tolist(), strict=True):
        lines += ["facet normal " + " ".join(f"{value:.9g}" for value in normal), "outer loop"]
        lines += ["vertex " + " ".join(map(repr, point)) for point in three]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, f"endsolid {name}"]) + "\n"


def triangles(pattern: Pattern) -> NDArray[np.int64]:
    """Vertex numbers (k, 3) of triangles that cover the panels, with the same winding."""
    found: list[tuple[int, ...]] = []
    for face, normal in zip(pattern.faces, pattern.face_normals, strict=True):
        corners = pattern.vertices[list(face)]
        found += [face] if len(face) == 3 else triangles_of(face, corners, normal)
    return np.array(found, dtype=np.int64)
