"""What is wrong with FOLD files, in words."""

from __future__ import annotations

import pytest

from foldyn.errors import InputError
from foldyn.formats import read_pattern

# ------------------------------------------------------------------------------ bad files

BAD_FIELDS = [
    ({"drop": ["vertices_coords"]}, "vertices_coords is missing: export"),
    ({"drop": ["faces_vertices"]}, "lines: they enclose no panel"),
    ({"drop": ["faces_vertices", "edges_vertices"]}, "edges_vertices is missing: export"),
    (
        {"drop": ["vertices_coords"], "file_frames": [{"vertices_coords": []}]},
        "vertices_coords is missing: only other frames have it; choose one by frame = 1",
    ),
    ({"vertices_coords": 5}, "vertices_coords must be a list, not 5"),
    ({"vertices_coords": []}, r"faces_vertices\[0\] = .*from 0 to -1"),
    ({"vertices_coords": [[0, 0], [1], [0, 1]]}, r"vertices_coords\[1\] = \[1\]: give 2 or 3"),
    ({"vertices_coords": [[0, 0], 7, [0, 1]]}, r"vertices_coords\[1\] = 7: give 2 or 3"),
    ({"vertices_coords": [[0, 0], ["1", 0]]}, r"vertices_coords\[1\] = .*give 2 or 3 numbers"),
    ({"vertices_coords": [[0, 0], [None, 0]]}, r"vertices_coords\[1\] = \[None, 0\]: give"),
    ({"vertices_coords": [[0, 0], [True, 0]]}, r"vertices_coords\[1\] = \[true, 0\]: give"),
    ({"vertices_coords": [[0, 0], [0, float("nan")]]}, r"vertices_coords\[1\].*finite"),
    ({"vertices_coords": [[0, 0], [0, float("inf")]]}, r"vertices_coords\[1\].*finite"),
    ({"vertices_coords": [[0, 0], [0, 10**400]]}, r"vertices_coords\[1\].*finite"),
    ({"faces_vertices": {}}, "faces_vertices must be a list"),
    (
        {"faces_vertices": [[0, 1, 9]]},
        r"faces_vertices\[0\] = \[0, 1, 9\]: give at least three vertex numbers from 0 to 5",
    ),
    (
        {"faces_vertices": [[0, 1, 1.5]]},
        r"faces_vertices\[0\] = \[0, 1, 1.5\]: give",
    ),
    (
        {"faces_vertices": [[0, 1, None]]},
        r"faces_vertices\[0\] = \[0, 1, None\]: give",
    ),
    ({"faces_vertices": [3]}, r"faces_vertices\[0\] = 3: give"),
    ({"faces_vertices": [[0, 1, 2]]}, r"faces\[0\].*has no area"),
    (
        {"faces_vertices": [[0, 1, 4], [1, 4, 2], [1, 4, 5]]},
        r"faces: edge \(1, 4\).*3 fac",
    ),
    ({"edges_vertices": 5}, "edges_vertices must be a list"),
    ({"drop": ["edges_vertices"]}, "edges_vertices is missing"),
    ({"edges_assignment": ["V"]}, "edges_assignment has 1 entries for 3 in edges_vertices"),
    ({"edges_foldAngle": [0]}, "edges_foldAngle has 1 entries for 3 in edges_vertices"),
    ({"edges_assignment": "VBB"}, "edges_assignment must be a list"),
    ({"edges_assignment": ["V", "B", "X"]}, r'edges_assignment\[2\] = "X": choose one of B, M'),
    ({"edges_assignment": ["V", "B", [1]]}, r"edges_assignment\[2\] = \[1\]: choose one of"),
    ({"edges_foldAngle": [190, 0, 0]}, r"edges_foldAngle\[0\] = 190: give degrees from -180"),
    ({"edges_foldAngle": ["1", 0, 0]}, r"edges_foldAngle\[0\] = .*or null"),
    ({"foldyn:families": [1]}, "foldyn:families: give a list of vertex pairs"),
    ({"foldyn:families": {"a": [[0, 9]]}}, r'foldyn:families\["a"\]\[0\] = \[0, 9\]: give two'),
    ({"edges_vertices": [[1, 4], [0, 6], [1, 2]]}, r"edges_vertices\[1\] = \[0, 6\]: give two"),
    ({"edges_vertices": [[1, 4], [0], [1, 2]]}, r"edges_vertices\[1\] = \[0\]: give two"),
    ({"edges_vertices": [[1, 4], [0, 0], [1, 2]]}, r"edges_vertices\[1\]"),
    ({"edges_vertices": [[1, 4], [0, 1.0], [1, 2]]}, r"edges_vertices\[1\]"),
]


@pytest.mark.parametrize(("changes", "message"), BAD_FIELDS)
def test_bad_fields(changes, message, file):
    with pytest.raises(InputError, match=f"test\\.fold: {message}") as caught:
        read_pattern(file(**changes))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "not valid JSON"),
        ("{", "not valid JSON"),
        ("[" * 100_000, "not valid JSON"),
        ("[1, 2]", "top level must be a JSON object"),
        (b"\xff\xfe\x00\x01", "is not a text file in UTF-8"),
    ],
)
def test_not_a_fold_file(content, message, file):
    with pytest.raises(InputError, match=f"test\\.fold: .*{message}"):
        read_pattern(file(content))
