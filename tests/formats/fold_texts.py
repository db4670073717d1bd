"""A FOLD file of two squares, and what makes two patterns the same."""

from __future__ import annotations

import numpy as np

GOOD = {
    "file_spec": 1.1,
    "frame_unit": "m",
    "vertices_coords": [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]],
    "faces_vertices": [[0, 1, 4, 3], [1, 2, 5, 4]],
    "edges_vertices": [[1, 4], [0, 1], [1, 2]],
    "edges_assignment": ["V", "B", "B"],
}
"""Two unit squares beside each other, hinged at a valley."""
LIFTED = [[0, 0, 0], [1, 0, 1], [2, 0, 0], [0, 1, 0], [1, 1, 1], [2, 1, 0]]
"""Vertices of the same panels, folded to a ridge."""


def assert_same(p, q):
    np.testing.assert_array_equal(p.vertices, q.vertices)
    assert p.faces == q.faces
    assert p.assignments == q.assignments
    assert p.name == q.name
    np.testing.assert_array_equal(p.creases, q.creases)
    np.testing.assert_array_equal(p.dihedrals, q.dihedrals)
