"""`Frame`, a state of a pattern, and the fold angles of a pattern in a state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foldyn.patterns.geometry import crease_dihedrals, face_geometry
from foldyn.patterns.pattern import Pattern


@dataclass(frozen=True, eq=False)
class Frame:
    """A state of a pattern.

    Parameters
    ----------
    title : str
        Title of the state, such as "t = 0.1 s".
    vertices : ndarray, shape (n, 3)
        Coordinates (m) of the pattern's vertices.
    """

    title: str
    vertices: NDArray[np.float64]


def fold_angles(pattern: Pattern, vertices: NDArray | None = None) -> NDArray[np.float64]:
    """Fold angles (nc,) of the creases: pi minus the dihedral (rad), valleys positive.

    Parameters
    ----------
    pattern : Pattern
    vertices : ndarray, shape (n, 3), optional
        Coordinates (m) of the vertices in a state; by default at rest.
    """
    flat = pattern.flat_dihedrals
    if vertices is None:
        return flat - pattern.dihedrals
    normals = face_geometry(vertices, pattern.faces).face_normals
    graph = pattern.creases, pattern.crease_faces, pattern.crease_ways
    letters = np.array(pattern.assignments, dtype="<U1")
    return flat - crease_dihedrals(vertices, normals, *graph, letters)[0]
