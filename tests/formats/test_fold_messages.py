"""Frames of FOLD files, and what is wrong with files in words."""

from __future__ import annotations

import json

import numpy as np
import pytest
from fold_texts import LIFTED

import foldyn as fd
from foldyn.errors import InputError
from foldyn.formats import Frame, read_pattern, write_pattern
from foldyn.patterns import miura, simple_fold

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
    ({"vertices_coords": [[0, 0], [None, 0]]}, r"vertices_coords\[1\] = \[None, 0\]: give"),
    ({"vertices_coords": [[0, 0], [True, 0]]}, r"vertices_coords\[1\] = \[true, 0\]: give"),
    ({"vertices_coords": [[0, 0], [0, float("nan")]]}, r"vertices_coords\[1\].*finite"),
    ({"vertices_coords": [[0, 0], [0, 10**400]]}, r"vertices_coords\[1\].*finite"),
    (
        {"faces_vertices": [[0, 1, 9]]},
        r"faces_vertices\[0\] = \[0, 1, 9\]: give at least three vertex numbers from 0 to 5",
    ),
    ({"faces_vertices": [[0, 1, 1.5]]}, r"faces_vertices\[0\] = \[0, 1, 1.5\]: give"),
    ({"faces_vertices": [[0, 1, None]]}, r"faces_vertices\[0\] = \[0, 1, None\]: give"),
    ({"faces_vertices": [[0, 1, 2]]}, r"faces\[0\].*has no area"),
    ({"drop": ["edges_vertices"]}, "edges_vertices is missing"),
    ({"edges_assignment": ["V"]}, "edges_assignment has 1 entries for 3 in edges_vertices"),
    ({"edges_foldAngle": [0]}, "edges_foldAngle has 1 entries for 3 in edges_vertices"),
    ({"edges_assignment": "VBB"}, "edges_assignment must be a list"),
    ({"edges_assignment": ["V", "B", "X"]}, r'edges_assignment\[2\] = "X": choose one of B, M'),
    ({"edges_foldAngle": [190, 0, 0]}, r"edges_foldAngle\[0\] = 190: give degrees from -180"),
    ({"edges_foldAngle": ["1", 0, 0]}, r"edges_foldAngle\[0\] = .*or null"),
    ({"foldyn:families": [1]}, "foldyn:families: give a list of vertex pairs"),
    ({"foldyn:families": {"a": [[0, 9]]}}, r'foldyn:families\["a"\]\[0\] = \[0, 9\]: give two'),
    ({"edges_vertices": [[1, 4], [0, 6], [1, 2]]}, r"edges_vertices\[1\] = \[0, 6\]: give two"),
    ({"edges_vertices": [[1, 4], [0], [1, 2]]}, r"edges_vertices\[1\] = \[0\]: give two"),
    ({"edges_vertices": [[1, 4], [0, 0], [1, 2]]}, r"edges_vertices\[1\]"),
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


# ------------------------------------------------------------------------------ frames

FRAMES = [
    {"frame_title": "lifted", "frame_inherit": True, "frame_parent": 0,
     "vertices_coords": LIFTED,
     "edges_assignment": ["M", "B", "B"]},
    {"frame_title": "named", "frame_inherit": True, "frame_parent": 1},
    {"frame_title": "bare", "vertices_coords": [[0, 0], [2, 0], [0, 2]],
     "faces_vertices": [[0, 1, 2]]},
    {"frame_title": "twice"},
    {"frame_title": "twice"},
    {"frame_inherit": True, "frame_parent": 7},
    {"frame_inherit": True, "frame_parent": 6},
    {"frame_inherit": True, "frame_parent": 99},
]  # fmt: skip


def test_the_key_frame_is_read_unless_another_is_chosen(file):
    path = file(file_frames=FRAMES)
    assert read_pattern(path).assignments == ("V",)
    assert read_pattern(path, frame=0).assignments == ("V",)
    lifted = read_pattern(path, frame=1)
    assert (lifted.name, lifted.assignments, lifted.vertices[1, 2]) == ("lifted", ("M",), 1.0)


def test_a_frame_inherits_from_its_ancestors(file):
    path = file(file_frames=FRAMES)
    for chosen in (2, "named"):
        p = read_pattern(path, frame=chosen)
        assert (p.name, p.assignments, p.vertices[1, 2]) == ("named", ("M",), 1.0)
    assert len(read_pattern(path, frame="bare").faces) == 1


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (9, "frame = 9: must be at most 8"),
        (-1, "frame = -1: must be a whole number, at least 0"),
        (True, "frame = true: must be a whole number"),
        (1.0, "frame = 1.0: must be a whole number"),
        ("none", 'framehas no frame with the title "none"; titles are "lifted", "named"'),
        ("twice", 'framehas 2 frames with the title "twice"'),
        (4, "vertices_coords is missing: only other frames have it; choose one by frame = 1, 3"),
        (6, "frame_parent: the frame inherits from itself"),
        (8, r"file_frames\[7\].frame_parent = 99: give the number of a frame, from 0 to 8"),
    ],
)
def test_bad_frames(frame, message, file):
    with pytest.raises(InputError, match=message.replace("framehas", "frame: the file has")):
        read_pattern(file(file_frames=FRAMES), frame=frame)


@pytest.mark.parametrize("frames", [5, [5], {"a": 1}])
def test_frames_that_are_none(frames, file):
    with pytest.raises(InputError, match="file_frames must be a list of JSON objects"):
        read_pattern(file(file_frames=frames))


def test_frames_are_written_with_their_angles(tmp_path):
    flat = miura(dihedral=180)
    states = [miura(dihedral=angle) for angle in (170, 120, 60)]
    frames = [Frame(f"state {k}", state.vertices) for k, state in enumerate(states)]
    write_pattern(
        flat.changed(assignments=states[0].assignments), tmp_path / "x.fold", frames=frames
    )
    assert json.loads((tmp_path / "x.fold").read_text())["file_classes"] == ["animation"]
    for k, state in enumerate(states):
        found = read_pattern(tmp_path / "x.fold", frame=k + 1)
        np.testing.assert_array_equal(found.vertices, state.vertices)
        assert (found.name, found.assignments) == (f"state {k}", state.assignments)
        assert np.isnan(found.fold_angles).all()  # they repeat the vertices
        told = json.loads((tmp_path / "x.fold").read_text())["file_frames"][k]["edges_foldAngle"]
        at = dict(zip(map(tuple, flat.edges.tolist()), told, strict=True))
        given = np.radians([at[tuple(pair)] for pair in flat.creases.tolist()])
        np.testing.assert_allclose(given, np.pi - state.dihedrals, atol=1e-12)


def test_other_formats_have_no_frames(tmp_path):
    p = simple_fold()
    with pytest.raises(InputError, match=r"frames: OBJ files hold one state; write \.fold"):
        write_pattern(p, tmp_path / "x.obj", frames=[Frame("a", p.vertices)])
    write_pattern(p, tmp_path / "x.obj")
    with pytest.raises(InputError, match=r"x\.obj: frame: OBJ files have no frames"):
        read_pattern(tmp_path / "x.obj", frame=1)


def test_the_order_of_layers_is_kept(tmp_path) -> None:
    strip = fd.Pattern(
        [(x, y) for x in range(4) for y in (0, 1)],
        [(2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1) for k in range(3)],
        ["V", "M"],
    )
    folding = fd.fold(strip, fraction=1.0, steps=2)
    path = tmp_path / "strip.fold"
    fd.write_pattern(folding.pattern, path)
    assert json.loads(path.read_text())["faceOrders"] == folding.layers.tolist()
    back = fd.read_pattern(path)
    assert back.custom["faceOrders"] == folding.layers.tolist()
    # it is kept in cases, and in copies whose panels are the same
    assert back.moved((1, 0, 0)).custom == back.custom
    assert "faceOrders" not in back.repeated((2, 1)).custom


def test_the_order_of_layers_is_said_of_fronts(tmp_path) -> None:
    text = {
        "vertices_coords": [[0, 0], [1, 0], [1, 1], [0, 1]],
        "faces_vertices": [[0, 1, 2], [0, 3, 2]],  # the second listed the other way around
        "edges_vertices": [[0, 2]],
        "edges_assignment": ["V"],
        "faceOrders": [[0, 1, -1], [1, 0, 1]],
    }
    path = tmp_path / "flap.fold"
    path.write_text(json.dumps(text))
    assert fd.read_pattern(path, unit="m").custom["faceOrders"] == [[0, 1, 1], [1, 0, 1]]
    for wrong in ([0, 1], [0, 2, 1], [0, 1, 2], [0, True, 1]):
        path.write_text(json.dumps(text | {"faceOrders": [wrong]}))
        with pytest.raises(InputError, match=r"faceOrders\[0\] = .*two face numbers from 0 to 1"):
            fd.read_pattern(path)
