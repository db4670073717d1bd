from __future__ import annotations

import numpy as np
import pytest


def _wing(pattern, face, a, b):
    """Unit vector in the face, across the edge a-b, away from it."""
    x = pattern.vertices
    axis = (x[b] - x[a]) / np.linalg.norm(x[b] - x[a])
    inside = x[list(pattern.faces[face])].mean(axis=0) - x[a]
    across = inside - (inside @ axis) * axis
    return across / np.linalg.norm(across)


@pytest.fixture
def dihedral_by_wings():
    """Dihedrals of flat convex panels from the two wings: another road than the package's."""

    def compute(pattern):
        x = pattern.vertices
        result = []
        for (a, b), (first, second) in zip(pattern.creases, pattern.crease_faces, strict=True):
            axis = (x[b] - x[a]) / np.linalg.norm(x[b] - x[a])
            r, s = _wing(pattern, first, a, b), _wing(pattern, second, a, b)
            front = np.cross(axis, r)  # the first face runs a to b, so this is its front
            result.append(np.arctan2(s @ front, s @ r) % (2 * np.pi))
        return np.array(result)

    return compute


@pytest.fixture
def edge_length():
    def compute(pattern, a, b):
        return np.linalg.norm(pattern.vertices[b] - pattern.vertices[a])

    return compute


@pytest.fixture
def corner_angle():
    """Angle (degrees) at corner k of a face."""

    def compute(pattern, face, k):
        corners = pattern.vertices[list(pattern.faces[face])]
        u = corners[(k + 1) % len(corners)] - corners[k]
        w = corners[k - 1] - corners[k]
        return np.degrees(np.arctan2(np.linalg.norm(np.cross(u, w)), u @ w))

    return compute
