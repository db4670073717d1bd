"""`Frame`, a state of a pattern; fold angles of a state, and the state with given fold angles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foldyn.patterns.geometry import crease_dihedrals, face_geometry
from foldyn.patterns.pattern import Pattern
from foldyn.patterns.topology import walk


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


def composed(pattern: Pattern, angles: NDArray) -> tuple[NDArray[np.float64], float]:
    """Vertices (n, 3) of a flat pattern folded by angles (nc,), rad, and the closing error, m.

    The first panel of each part stays fixed, and the others follow panel by panel. The error is the
    largest deviation of a vertex, as one of its panels has it, from the mean.
    """
    from scipy.spatial.transform import Rotation  # loads slowly

    axes = pattern.vertices[np.concatenate([pattern.creases, pattern.welds]).astype(np.int64)]
    turns = np.concatenate([angles, np.zeros(len(pattern.welds))])
    beside = np.concatenate([pattern.crease_faces, pattern.weld_faces]).astype(np.int64)
    rotation = np.tile(np.eye(3), (len(pattern.faces), 1, 1))
    shift = np.zeros((len(pattern.faces), 3))
    for face, other, k, way in walk(beside, len(pattern.faces)):
        a, b = axes[k]
        own = Rotation.from_rotvec(-way * turns[k] * (b - a) / np.linalg.norm(b - a)).as_matrix()
        rotation[other] = rotation[face] @ own
        shift[other] = rotation[face] @ (a - own @ a) + shift[face]
    corners = np.concatenate(pattern.faces)
    panel = np.repeat(np.arange(len(pattern.faces)), [len(face) for face in pattern.faces])
    images = np.einsum("kij,kj->ki", rotation[panel], pattern.vertices[corners]) + shift[panel]
    total, count = np.zeros_like(pattern.vertices), np.zeros((len(pattern.vertices), 1))
    np.add.at(total, corners, images)
    np.add.at(count, corners, 1.0)
    mean = np.where(count > 0.0, total / np.maximum(count, 1.0), pattern.vertices)
    return mean, float(np.abs(images - mean[corners]).max())
