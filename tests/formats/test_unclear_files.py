"""Files that can be taken in two ways: read as they are meant, or doubted or refused by name."""

from __future__ import annotations

import numpy as np
import pytest

from foldyn.formats import read_pattern

# a square vertex with creases to its corners and, below, two lists of letters and angles
FAN = {
    "vertices_coords": [[0, 0], [2, 0], [0, 2], [-2, 0], [0, -2]],
    "faces_vertices": [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]],
    "edges_vertices": [[0, 1], [0, 2], [0, 3], [0, 4]],
    "edges_assignment": ["V", "V", "U", "M"],
}


@pytest.mark.parametrize(
    ("letters", "angles", "wanted"),
    [
        ("VVUM", [40, 50, 0, -60], [40, 50, None, -60]),  # 0: none is given
        ("VVUM", [40, 50, 25, -60], [40, 50, 25, -60]),
        ("VVUM", [40, 0, None, -60], [40, 0, None, -60]),  # a valley may stay flat at first
        ("UUUU", [40, 0, 0, -60], [40, None, None, -60]),
    ],
)
def test_an_unassigned_crease_with_an_angle_of_0_is_free(file, letters, angles, wanted):
    path = file(**{**FAN, "edges_assignment": list(letters)}, edges_foldAngle=angles)
    given = np.degrees(read_pattern(path).fold_angles)
    np.testing.assert_allclose(given, [np.nan if w is None else w for w in wanted])
