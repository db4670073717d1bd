from __future__ import annotations

import contextlib
import json
import os
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foldyn.errors import FoldynWarning, InputError
from foldyn.formats import FORMATS, Format, read_pattern, write_pattern
from foldyn.patterns import GENERATORS, Pattern, kresling, miura, simple_fold

SAMPLES = Path(__file__).resolve().parents[3] / "shared" / "patterns"

GOOD = {
    "file_spec": 1.1,
    "vertices_coords": [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]],
    "faces_vertices": [[0, 1, 4, 3], [1, 2, 5, 4]],
    "edges_vertices": [[1, 4], [0, 1], [1, 2]],
    "edges_assignment": ["V", "B", "B"],
}


def assert_same(p, q):
    np.testing.assert_array_equal(p.vertices, q.vertices)
    assert p.faces == q.faces
    assert p.assignments == q.assignments
    assert p.name == q.name
    np.testing.assert_array_equal(p.creases, q.creases)
    np.testing.assert_array_equal(p.dihedrals, q.dihedrals)


@pytest.fixture
def file(tmp_path):
    """Write a FOLD file: GOOD with some fields changed, or any text."""

    def make(content=None, drop=(), **changes):
        path = tmp_path / "test.fold"
        if content is None:
            fields = {k: v for k, v in {**GOOD, **changes}.items() if k not in drop}
            content = json.dumps(fields)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return make


# ------------------------------------------------------------------------------ round trips


@pytest.mark.parametrize("extension", sorted(FORMATS))
@pytest.mark.parametrize("kind", sorted(GENERATORS))
def test_round_trip_of_every_generator(kind, extension, tmp_path):
    p = GENERATORS[kind]()
    path = tmp_path / f"pattern{extension}"
    write_pattern(path, p)
    q = read_pattern(str(path))
    assert_same(p, q)
    assert not any(q.flipped)
    assert [f.name for f in tmp_path.iterdir()] == [path.name]


@settings(max_examples=40, deadline=None)
@given(
    vertices=st.lists(st.tuples(*[st.floats(-1e6, 1e6)] * 3), min_size=3, max_size=3),
    name=st.text(max_size=20),
)
def test_round_trip_to_the_last_digit(vertices, name, tmp_path_factory):
    try:
        p = Pattern(vertices, [[0, 1, 2]], name=name)
    except InputError:
        return  # a triangle without area
    path = tmp_path_factory.mktemp("fold") / "x.fold"
    write_pattern(path, p)
    assert_same(p, read_pattern(path))


def test_round_trip_of_letters_and_flipped_faces(tmp_path):
    base = miura(cells=(2, 1), dihedral=180)
    letters = ["U", "M", "V", "F"] * (len(base.creases) // 4 + 1)
    faces = [f[::-1] if n % 3 else f for n, f in enumerate(base.faces)]
    p = Pattern(base.vertices, faces, letters[: len(base.creases)], name="mixed")
    write_pattern(tmp_path / "x.FOLD", p)
    assert_same(p, read_pattern(tmp_path / "x.FOLD"))


def test_round_trip_of_coincident_panels(tmp_path):
    vertices = [[1, 0], [0, 0], [1, 0], [1, 1], [0, 1], [1, 1]]
    p = Pattern(vertices, GOOD["faces_vertices"], "M")
    write_pattern(tmp_path / "x.fold", p)
    assert read_pattern(tmp_path / "x.fold").dihedrals[0] == 2 * np.pi
    assert json.loads((tmp_path / "x.fold").read_text())["edges_foldAngle"][3] == -180.0


SAMPLES_WITH_FACES = {
    # vertices, faces, creases; counts taken from the files
    "edemaine+fold__box.fold": (39, 42),
    "edemaine+fold__simple.fold": (6, 4),
    "edemaine+fold__squaretwist.fold": (16, 9),
    "origami-code+rtori__simpleVertex_0.fold": (9, 8),
    "origami-code+rtori__simpleVertex_50.fold": (9, 8),
    "origamimagiro+flat-folder__074_miuraoripa_Miura-ori.fold": (81, 72),
    "osbo+rigid-origami__huffmanWaterbomb.fold": (440, 798),
}


@pytest.mark.parametrize("name", sorted(SAMPLES_WITH_FACES))
def test_real_files(name, tmp_path):
    path = SAMPLES / name
    if not path.exists():
        pytest.skip(f"{name} is not here")
    # the box gives valleys where its faces, seen from their front, have mountains
    doubtful = "box" in name
    with pytest.warns(FoldynWarning, match="turn") if doubtful else contextlib.nullcontext():
        p = read_pattern(path)
    assert (len(p.vertices), len(p.faces)) == SAMPLES_WITH_FACES[name]
    raw = json.loads(path.read_text())
    np.testing.assert_array_equal(
        p.vertices[:, : len(raw["vertices_coords"][0])], raw["vertices_coords"]
    )
    edges = zip(raw["edges_vertices"], raw["edges_assignment"], strict=True)
    listed = {tuple(sorted(pair)): letter for pair, letter in edges}
    for pair, letter in zip(p.creases.tolist(), p.assignments, strict=True):
        assert listed[tuple(pair)] == letter
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        write_pattern(tmp_path / "x.fold", p)
        assert_same(p, read_pattern(tmp_path / "x.fold"))


def test_real_file_without_faces():
    path = SAMPLES / "oriedita+oriedita__oriedita.fold"
    if not path.exists():
        pytest.skip(f"{path.name} is not here")
    with pytest.raises(InputError, match=r"oriedita\.fold: faces_vertices is missing: export"):
        read_pattern(path)


# ------------------------------------------------------------------------------ what is written


def test_written_fields(tmp_path):
    write_pattern(tmp_path / "x.fold", simple_fold(dihedral=60))
    data = json.loads((tmp_path / "x.fold").read_text())
    assert data["file_spec"] == 1.1
    assert data["frame_title"] == "simple fold"
    assert data["frame_classes"] == ["foldedForm"]
    assert data["frame_attributes"] == ["3D"]
    assert data["frame_unit"] == "m"
    ridge = data["edges_vertices"].index([2, 3])
    assert data["edges_assignment"][ridge] == "M"
    # FOLD: valleys positive; 180 - dihedral with the dihedral 300 degrees
    assert data["edges_foldAngle"][ridge] == pytest.approx(-120, abs=1e-12)
    others = [n for n in range(7) if n != ridge]
    assert {data["edges_assignment"][n] for n in others} == {"B"}
    assert {data["edges_foldAngle"][n] for n in others} == {0.0}


def test_flat_pattern_is_written_as_crease_pattern(tmp_path):
    write_pattern(tmp_path / "x.fold", miura(dihedral=180))
    data = json.loads((tmp_path / "x.fold").read_text())
    assert data["frame_classes"] == ["creasePattern"]
    assert data["frame_attributes"] == ["2D"]
    assert {len(row) for row in data["vertices_coords"]} == {2}


def test_fold_angles_match_letters(tmp_path):
    write_pattern(tmp_path / "x.fold", kresling())
    data = json.loads((tmp_path / "x.fold").read_text())
    for letter, angle in zip(data["edges_assignment"], data["edges_foldAngle"], strict=True):
        assert {"V": angle > 0, "M": angle < 0, "B": angle == 0}[letter]


# ------------------------------------------------------------------------------ what is read


def test_reads_letters(file):
    p = read_pattern(file())
    assert p.assignments == ("V",)
    assert p.vertices.shape == (6, 3)
    assert p.name == ""


def test_reads_without_edges(file):
    p = read_pattern(file(drop=("edges_vertices", "edges_assignment")))
    assert p.assignments == ("F",)


def test_reads_edges_without_letters(file):
    assert read_pattern(file(drop=("edges_assignment",))).assignments == ("F",)


def test_byte_order_mark_and_mixed_dimensions(file):
    fields = {**GOOD, "vertices_coords": [[0, 0, 0], *GOOD["vertices_coords"][1:]]}
    p = read_pattern(file(b"\xef\xbb\xbf" + json.dumps(fields).encode()))
    assert len(p.vertices) == 6


def test_titles(file):
    assert read_pattern(file(file_title="file")).name == "file"
    assert read_pattern(file(file_title="file", frame_title="frame")).name == "frame"


def test_only_the_key_frame_is_read(file):
    other = {"vertices_coords": [[9, 9]], "faces_vertices": "nonsense"}
    assert len(read_pattern(file(file_frames=[other])).vertices) == 6


@pytest.mark.parametrize(
    ("unit", "meters"),
    [("m", 1.0), ("unit", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6), ("nm", 1e-9),
     ("in", 0.0254), ("pt", 0.0254 / 72)],
)  # fmt: skip
def test_units_become_meters(unit, meters, file):
    p = read_pattern(file(frame_unit=unit))
    np.testing.assert_allclose(p.vertices[5], [2 * meters, meters, 0], rtol=1e-14)


def test_unknown_unit_warns(file):
    with pytest.warns(FoldynWarning, match='frame_unit = "ell" is unknown.*meters'):
        p = read_pattern(file(frame_unit="ell"))
    assert p.vertices[5, 0] == 2.0


def test_edges_of_no_face_are_ignored_aloud(file):
    path = file(edges_vertices=[[1, 4], [0, 5], [0, 4]], edges_assignment=["M", "F", "V"])
    with pytest.warns(FoldynWarning, match="2 edges belong to no face"):
        assert read_pattern(path).assignments == ("M",)


def test_mountain_on_the_boundary_is_ignored_aloud(file):
    with pytest.warns(FoldynWarning, match="1 edges are mountains or valleys although only one"):
        read_pattern(file(edges_assignment=["M", "V", "C"]))


def test_contradiction_warns(file):
    coords = [[0, 0, 0], [1, 0, 1], [2, 0, 0], [0, 1, 0], [1, 1, 1], [2, 1, 0]]
    with pytest.warns(FoldynWarning, match=r'crease \(1, 4\) is given as "V".*270'):
        read_pattern(file(vertices_coords=coords))


# ------------------------------------------------------------------------------ bad files

BAD_FIELDS = [
    ({"drop": ["vertices_coords"]}, "vertices_coords is missing: export"),
    ({"drop": ["faces_vertices"]}, "faces_vertices is missing: export the pattern with its faces"),
    (
        {"drop": ["faces_vertices"], "file_frames": [{"faces_vertices": []}]},
        "faces_vertices is missing: only other frames.*key frame",
    ),
    ({"vertices_coords": 5}, "vertices_coords must be a list, not 5"),
    ({"vertices_coords": []}, r"vertices_coords has shape \(0, 3\)"),
    ({"vertices_coords": [[0, 0], [1], [0, 1]]}, r"vertices_coords\[1\] = \[1\]: give 2 or 3"),
    ({"vertices_coords": [[0, 0], 7, [0, 1]]}, r"vertices_coords\[1\] = 7: give 2 or 3"),
    ({"vertices_coords": [[0, 0], ["1", 0]]}, r"vertices_coords\[1\] = .*give 2 or 3 numbers"),
    ({"vertices_coords": [[0, 0], [None, 0]]}, r"vertices_coords\[1\] = \[null, 0\]: give"),
    ({"vertices_coords": [[0, 0], [True, 0]]}, r"vertices_coords\[1\] = \[true, 0\]: give"),
    ({"vertices_coords": [[0, 0], [0, float("nan")]]}, r"vertices_coords\[1\].*finite"),
    ({"vertices_coords": [[0, 0], [0, float("inf")]]}, r"vertices_coords\[1\].*finite"),
    ({"vertices_coords": [[0, 0], [0, 10**400]]}, r"vertices_coords\[1\].*finite"),
    ({"faces_vertices": {}}, "faces_vertices must be a list"),
    ({"faces_vertices": []}, "faces_vertices is empty"),
    (
        {"faces_vertices": [[0, 1, 9]]},
        r"faces_vertices\[0\] = \[0, 1, 9\]: vertex 9 does not exist",
    ),
    ({"faces_vertices": [[0, 1, 1.5]]}, r"faces_vertices\[0\]: vertex number 1.5 is not an int"),
    ({"faces_vertices": [[0, 1, None]]}, r"faces_vertices\[0\]: vertex number None is not an int"),
    ({"faces_vertices": [3]}, r"faces_vertices\[0\] = 3: give"),
    ({"faces_vertices": [[0, 1, 2]]}, r"faces_vertices\[0\].*has no area"),
    (
        {"faces_vertices": [[0, 1, 4], [1, 4, 2], [1, 4, 5]]},
        r"faces_vertices: edge \(1, 4\).*3 fac",
    ),
    ({"edges_vertices": 5}, "edges_vertices must be a list"),
    ({"drop": ["edges_vertices"]}, "edges_vertices is missing"),
    ({"edges_assignment": ["V"]}, "edges_assignment has 1 entries for 3 in edges_vertices"),
    ({"edges_foldAngle": [0]}, "edges_foldAngle has 1 entries for 3 in edges_vertices"),
    ({"edges_assignment": "VBB"}, "edges_assignment must be a list"),
    ({"edges_assignment": ["V", "B", "X"]}, r'edges_assignment\[2\] = "X": give one of B, M'),
    ({"edges_assignment": ["V", "B", [1]]}, r"edges_assignment\[2\] = \[1\]: give one of"),
    ({"edges_assignment": ["B", "B", "B"]}, r'edges_assignment: edge \(1, 4\) is "B" \(boundary\)'),
    ({"edges_assignment": ["C", "B", "B"]}, r'edges_assignment: edge \(1, 4\) is "C" \(a cut\)'),
    ({"edges_vertices": [[1, 4], [0, 6], [1, 2]]}, r"edges_vertices\[1\] = \[0, 6\]: give two"),
    ({"edges_vertices": [[1, 4], [0], [1, 2]]}, r"edges_vertices\[1\] = \[0\]: give two"),
    ({"edges_vertices": [[1, 4], [0, 0], [1, 2]]}, r"edges_vertices\[1\]"),
    ({"edges_vertices": [[1, 4], [0, 1.0], [1, 2]]}, r"edges_vertices\[1\]"),
    (
        {"edges_vertices": [[1, 4], [4, 1], [1, 2]], "edges_assignment": ["V", "M", "B"]},
        r"edges_assignment\[1\]: edge \(1, 4\) is given both 'V' and 'M'",
    ),
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


# ------------------------------------------------------------------------------ paths


@pytest.mark.parametrize("name", ["missing.fold", "nowhere/missing.fold"])
def test_missing_file(name, tmp_path):
    with pytest.raises(InputError, match=r"missing\.fold: there is no such file"):
        read_pattern(tmp_path / name)


@pytest.mark.parametrize("name", ["dir.fold", "plain"])
def test_directory(name, tmp_path):
    (tmp_path / name).mkdir()
    with pytest.raises(InputError, match=f"{name}: is a directory"):
        read_pattern(tmp_path / name)
    with pytest.raises(InputError, match=f"{name}: is a directory"):
        write_pattern(tmp_path / name, simple_fold())
    assert not list((tmp_path / name).iterdir())


@pytest.mark.parametrize("name", ["x.dwg", "x", "x.fold.bak"])
def test_unknown_extension(name, tmp_path):
    path = tmp_path / name
    with pytest.raises(InputError, match=r"known ones are .*\.fold"):
        read_pattern(path)
    with pytest.raises(InputError, match=r"known ones are .*\.fold"):
        write_pattern(path, simple_fold())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("path", [None, 5, 1.5])
def test_not_a_path(path):
    with pytest.raises(InputError, match="give the path of a file"):
        read_pattern(path)


@pytest.mark.parametrize("name", ["a\0b.fold", "x" * 5000 + ".fold"])
def test_impossible_name(name, tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_pattern(tmp_path / name)
    with pytest.raises(InputError, match="cannot be written"):
        write_pattern(tmp_path / name, simple_fold())


def test_write_into_missing_directory(tmp_path):
    with pytest.raises(InputError, match=r"x\.fold: cannot be written.*directory exists"):
        write_pattern(tmp_path / "nowhere" / "x.fold", simple_fold())
    assert not list(tmp_path.iterdir())


def test_write_needs_a_pattern(tmp_path):
    with pytest.raises(InputError, match="pattern = 5: give a Pattern"):
        write_pattern(tmp_path / "x.fold", 5)
    assert not list(tmp_path.iterdir())


def test_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "x.fold"
    write_pattern(path, simple_fold())
    before = path.read_bytes()

    def full(self, content):
        with open(self, "wb") as stream:
            stream.write(content[:10])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(InputError, match="No space left on device"):
        write_pattern(path, miura())
    monkeypatch.undo()
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["x.fold"]


def test_write_through_a_link(tmp_path):
    (tmp_path / "real").mkdir()
    real, link = tmp_path / "real" / "x.fold", tmp_path / "link.fold"
    write_pattern(real, simple_fold())
    link.symlink_to(real)
    write_pattern(link, miura())
    assert link.is_symlink()
    assert read_pattern(real).name == "miura"


def test_one_way_formats(tmp_path, monkeypatch):
    monkeypatch.setitem(FORMATS, ".one", Format("One", (".one",)))
    with pytest.raises(InputError, match="One files can be written but not read"):
        read_pattern(tmp_path / "x.one")
    with pytest.raises(InputError, match="One files can be read but not written"):
        write_pattern(tmp_path / "x.one", simple_fold())
