"""FOLD files: what is read and written."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import numpy as np
import pytest
from fold_texts import GOOD, LIFTED, assert_same

from foldyn.errors import FoldynWarning, InputError
from foldyn.formats import diagnose, read_pattern, write_pattern
from foldyn.patterns import GENERATORS, Pattern, kresling, miura, simple_fold

SAMPLES = Path(__file__).resolve().parents[3] / "shared" / "patterns"


# ------------------------------------------------------------------------------ round trips


@pytest.mark.parametrize("extension", [".fold", ".obj"])
@pytest.mark.parametrize("kind", sorted(GENERATORS))
def test_round_trip_of_every_generator(kind, extension, tmp_path):
    p = GENERATORS[kind]()
    path = tmp_path / f"pattern{extension}"
    write_pattern(p, path)
    q = read_pattern(str(path))
    assert_same(p, q)
    assert not any(q.flipped)
    assert [f.name for f in tmp_path.iterdir()] == [path.name]


def test_round_trip_of_coincident_panels(tmp_path):
    vertices = [[1, 0], [0, 0], [1, 0], [1, 1], [0, 1], [1, 1]]
    p = Pattern(vertices, GOOD["faces_vertices"], "M")
    write_pattern(p, tmp_path / "x.FOLD")
    assert read_pattern(tmp_path / "x.FOLD").dihedrals[0] == 2 * np.pi
    assert json.loads((tmp_path / "x.FOLD").read_text())["edges_foldAngle"][3] == -180.0


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
        pytest.skip("needs ../shared")
    p, diagnosis = diagnose(path, unit="m", facets="hinge")
    assert diagnosis.assumptions == ()
    # the box gives valleys where its faces, seen from their front, have mountains
    assert any("turn" in doubt for doubt in diagnosis.doubts) == ("box" in name)
    assert (len(p.vertices), len(p.faces)) == SAMPLES_WITH_FACES[name]
    raw = json.loads(path.read_text())
    np.testing.assert_array_equal(
        p.vertices[:, : len(raw["vertices_coords"][0])], raw["vertices_coords"]
    )
    edges = zip(raw["edges_vertices"], raw["edges_assignment"], strict=True)
    listed = {tuple(sorted(pair)): letter for pair, letter in edges}
    for pair, letter in zip(p.creases.tolist(), p.assignments, strict=True):
        assert listed[tuple(pair)] == letter
    write_pattern(p, tmp_path / "x.fold")
    assert_same(p, diagnose(tmp_path / "x.fold").pattern)


def test_real_file_without_faces():
    path = SAMPLES / "oriedita+oriedita__oriedita.fold"
    if not path.exists():
        pytest.skip("needs ../shared")
    p, diagnosis = diagnose(path, unit="mm")
    # two panels with corners within their edges, cut into convex ones
    assert (len(p.vertices), len(p.faces), p.assignments) == (8, 6, ("M", "M", "M"))
    assert p.size == pytest.approx(0.4 * np.sqrt(2))
    np.testing.assert_allclose(p.fold_angles, -np.pi)
    assert "2 lines" in diagnosis.repairs[0]
    assert p.custom["oriedita:grid_size"] == 8
    assert "oriedita:edges_colors" in p.custom


# ------------------------------------------------------------------------------ what is written


def test_written_fields(tmp_path):
    write_pattern(simple_fold(dihedral=60), tmp_path / "x.fold")
    data = json.loads((tmp_path / "x.fold").read_text())
    assert data["file_spec"] == 1.2
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


def test_a_flat_pattern_without_angles_has_none_in_the_file(tmp_path):
    p = miura(dihedral=180)
    write_pattern(p, tmp_path / "x.fold")
    data = json.loads((tmp_path / "x.fold").read_text())
    assert "edges_foldAngle" not in data
    assert (data["frame_classes"], data["frame_attributes"]) == (["creasePattern"], ["2D"])
    assert {len(row) for row in data["vertices_coords"]} == {2}
    write_pattern(p.changed(fold_angles=[0.5, None, -1.0, None]), tmp_path / "x.fold")
    data = json.loads((tmp_path / "x.fold").read_text())
    at = {
        tuple(pair): a
        for pair, a in zip(data["edges_vertices"], data["edges_foldAngle"], strict=True)
    }
    told = [at[tuple(pair)] for pair in p.creases.tolist()]
    assert told[1] is None and told[3] is None
    assert [told[0], told[2]] == pytest.approx(np.degrees([0.5, -1.0]).tolist())


def test_families_and_data_of_others_survive(tmp_path):
    p = kresling()
    p = p.changed(
        families={"zigzag": p.creases[2:5], "é": [p.creases[0]]},
        custom={"tm:tree": {"a": [1, None, "x"]}, "other:b": 2.5},
    )
    write_pattern(p, tmp_path / "x.fold")
    q = read_pattern(tmp_path / "x.fold")
    assert {name: rows.tolist() for name, rows in q.families.items()} == {
        "zigzag": [2, 3, 4], "é": [0],
    }  # fmt: skip
    assert q.custom == p.custom


# ------------------------------------------------------------------------------ what is read


def test_reads_letters(file):
    p = read_pattern(file())
    assert p.assignments == ("V",)
    assert p.vertices.shape == (6, 3)
    assert p.name == ""


def test_reads_without_edges(file):
    p = read_pattern(file(drop=("edges_vertices", "edges_assignment")))
    assert p.assignments == ("F",)
    assert read_pattern(file(drop=("edges_assignment",))).assignments == ("F",)


def test_byte_order_mark_and_mixed_dimensions(file):
    fields = {**GOOD, "vertices_coords": [[0, 0, 0], *GOOD["vertices_coords"][1:]]}
    p = read_pattern(file(b"\xef\xbb\xbf" + json.dumps(fields).encode()))
    assert len(p.vertices) == 6


def test_titles(file):
    assert read_pattern(file(file_title="file")).name == "file"
    assert read_pattern(file(file_title="file", frame_title="frame")).name == "frame"


# ------------------------------------------------------------------------------ angles, units


def test_fold_angles_in_degrees(file):
    p = read_pattern(file(edges_foldAngle=[120, 0, None]))
    np.testing.assert_allclose(p.fold_angles, [np.radians(120)])
    old = read_pattern(file(edges_foldAngles=[30, None, None], edges_lengths=[1, 1, 1]))
    np.testing.assert_allclose(old.fold_angles, [np.radians(30)])
    assert np.isnan(read_pattern(file(edges_foldAngle=[None, 0, 0])).fold_angles).all()


def test_angles_that_repeat_the_vertices_are_not_kept(file):
    lifted = LIFTED
    changes = {"vertices_coords": lifted, "edges_assignment": ["M", "B", "B"]}
    assert np.isnan(read_pattern(file(edges_foldAngle=[-90, 0, 0], **changes)).fold_angles).all()
    further = read_pattern(file(edges_foldAngle=[-100, 0, 0], **changes))
    np.testing.assert_allclose(further.fold_angles, np.radians([-100]))
    assert np.isnan(read_pattern(file(edges_foldAngle=[0, 0, 0])).fold_angles).all()


def test_angles_give_letters_where_there_are_none(file):
    p = read_pattern(file(edges_foldAngle=[-120, 0, None], drop=["edges_assignment"]))
    assert p.assignments == ("M",)


def test_commas_that_json_does_not_allow_are_removed_aloud(file):
    text = json.dumps({**GOOD, "file_title": 'a ",]" in it'})
    text = text.replace("]]", ",] , ]").replace("}", ",\n}")
    with pytest.warns(FoldynWarning, match="repaired: 7 commas before a closing bracket removed"):
        p = read_pattern(file(text))
    assert (p.name, p.assignments) == ('a ",]" in it', ("V",))


def test_faces_are_found_where_the_file_has_none(file):
    edges = [[1, 4], [0, 1], [1, 2], [2, 5], [5, 4], [4, 3], [3, 0]]
    p = read_pattern(
        file(drop=["faces_vertices"], edges_vertices=edges, edges_assignment=list("VBBBBBB"))
    )
    assert (len(p.faces), p.assignments) == (2, ("V",))
    empty = file(faces_vertices=[], edges_vertices=edges, edges_assignment=list("VBBBBBB"))
    assert len(read_pattern(empty).faces) == 2


def test_lists_by_element_are_left_out_aloud(file):
    with pytest.warns(FoldynWarning, match="edges_tm:kind left out"):
        p = read_pattern(file(**{"edges_tm:kind": [1, 2, 3], "tm:x": 1}))
    assert p.custom == {"tm:x": 1}


@pytest.mark.parametrize("unit", [None, "unit"])
def test_a_file_without_a_unit_says_what_was_assumed(unit, file):
    path = file(frame_unit=unit) if unit else file(drop=["frame_unit"])
    with pytest.warns(FoldynWarning, match=r"does not say its unit.*1000 mm.*sheet is 2 x 1 x 0 m"):
        assert read_pattern(path).size == pytest.approx(np.sqrt(5))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert read_pattern(path, unit="mm").size == pytest.approx(1e-3 * np.sqrt(5))


def test_unit_and_scale(file):
    path = file(frame_unit="cm")
    assert read_pattern(path).size == pytest.approx(1e-2 * np.sqrt(5))
    assert read_pattern(path, unit="in").size == pytest.approx(0.0254 * np.sqrt(5))
    assert read_pattern(path, scale=3).size == pytest.approx(3e-2 * np.sqrt(5))
    with pytest.raises(InputError, match='unit = "ell": choose one of m, cm, mm'):
        read_pattern(path, unit="ell")
    for scale in (0, -1, "2", float("nan"), True):
        with pytest.raises(InputError, match="scale = "):
            read_pattern(path, scale=scale)


@pytest.mark.parametrize(
    ("unit", "meters"),
    [("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6), ("nm", 1e-9),
     ("in", 0.0254), ("pt", 0.0254 / 72)],
)  # fmt: skip
def test_units_become_meters(unit, meters, file):
    p = read_pattern(file(frame_unit=unit))
    np.testing.assert_allclose(p.vertices[5], [2 * meters, meters, 0], rtol=1e-14)


def test_unknown_unit_warns(file):
    with pytest.warns(FoldynWarning) as told:
        p = read_pattern(file(frame_unit="ell"))
    assert p.vertices[5, 0] == 2.0
    said = " ".join(str(each.message) for each in told)
    assert 'frame_unit = "ell" is unknown' in said and "does not say its unit" in said


def test_mountain_on_the_boundary_is_ignored_aloud(file):
    with pytest.warns(FoldynWarning, match="1 mountain or valley on the outline"):
        read_pattern(file(edges_assignment=["M", "V", "B"]))


def test_small_letters_and_nulls_are_taken_for_what_they_mean(tmp_path):
    text = {**GOOD, "edges_assignment": ["v", "b", None]}
    del text["faces_vertices"]
    text["edges_vertices"] = [[1, 4], *([k, k + 1] for k in (0, 1, 3, 4)), [0, 3], [2, 5]]
    text["edges_assignment"] = ["v", "b", "B", "B", "B", "B", "B"]
    (tmp_path / "x.fold").write_text(json.dumps(text))
    found = diagnose(tmp_path / "x.fold")
    assert found.pattern.assignments == ("V",)
    assert "edges_assignment: 2 small letters taken as large" in found.diagnosis.repairs
    text["edges_assignment"][0] = None
    (tmp_path / "x.fold").write_text(json.dumps(text))
    found = diagnose(tmp_path / "x.fold")
    assert found.pattern.assignments == ("U",)
    assert "edges_assignment: 1 null taken as U, unassigned" in found.diagnosis.repairs


@pytest.mark.parametrize(("angle", "doubted"), [(3.14159265, 1), (180, 0), (3.0, 0)])
def test_angles_that_look_like_radians_are_doubted(angle, doubted, tmp_path):
    text = {**GOOD, "edges_foldAngle": [angle, 0, 0]}
    (tmp_path / "x.fold").write_text(json.dumps(text))
    found = diagnose(tmp_path / "x.fold")
    assert np.degrees(found.pattern.fold_angles) == pytest.approx([angle])
    assert sum("as if they were radians" in text for text in found.diagnosis.doubts) == doubted


@pytest.mark.parametrize(("order", "plane"), [((0, 2, 1), "x and z"), ((2, 0, 1), "y and z")])
def test_lines_in_another_coordinate_plane_are_turned(order, plane, tmp_path):
    text = {key: value for key, value in GOOD.items() if key != "faces_vertices"}
    text["edges_vertices"] = [[1, 4], *([k, k + 1] for k in (0, 1, 3, 4)), [0, 3], [2, 5]]
    text["edges_assignment"] = list("VBBBBBB")
    text["vertices_coords"] = [[(x, y, 0.5)[k] for k in order] for x, y in GOOD["vertices_coords"]]
    (tmp_path / "x.fold").write_text(json.dumps(text))
    found = diagnose(tmp_path / "x.fold")
    assert len(found.pattern.faces) == 2 and not found.pattern.vertices[:, 2].any()
    assert any(f"in the plane of {plane}, into" in told for told in found.diagnosis.repairs)
