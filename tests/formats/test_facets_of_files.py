"""Facets of files: lines assigned "F" are no hinges, unless one wants them so."""

import json
import warnings

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.formats import diagnose

SQUARE = {
    "vertices_coords": [[0, 0], [1, 0], [1, 1], [0, 1], [2, 0], [2, 1]],
    "faces_vertices": [[0, 1, 2], [0, 2, 3], [1, 4, 5, 2]],
    "edges_vertices": [[0, 2], [1, 2]],
    "edges_assignment": ["F", "V"],
    "frame_unit": "m",
}


def file_of(tmp_path, **changes):
    path = tmp_path / "x.fold"
    path.write_text(json.dumps({**SQUARE, **changes}))
    return path


def test_welded_by_default_and_said(tmp_path):
    with pytest.warns(FoldynWarning, match="1 line assigned F taken as part of the sheet") as told:
        pattern = fd.read_pattern(file_of(tmp_path))
    assert 'facets = "hinge"' in str(told[0].message)
    assert pattern.faces == ((0, 1, 2, 3), (1, 4, 5, 2))
    assert pattern.assignments == ("V",)


@pytest.mark.parametrize(
    ("facets", "faces", "creases", "welds"),
    [("weld", 2, 1, 0), ("line", 3, 1, 1), ("hinge", 3, 2, 0)],
)
def test_what_one_wants_is_not_said(facets, faces, creases, welds, tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error", FoldynWarning)
        pattern = fd.read_pattern(file_of(tmp_path), facets=facets)
    assert (len(pattern.faces), len(pattern.creases), len(pattern.welds)) == (faces, creases, welds)


def test_only_lines_that_the_file_assigns(tmp_path):
    """A flat crease without a letter, and one that is to be folded, are creases."""
    for changes in (
        {"edges_vertices": [[1, 2]], "edges_assignment": ["V"]},
        {"edges_assignment": ["U", "V"]},
        {"edges_foldAngle": [30, 90]},
    ):
        pattern, diagnosis = diagnose(file_of(tmp_path, **changes))
        assert len(pattern.creases) == 2
        assert diagnosis.facets == ()


def test_folded_facets_stay_hinges_by_default(tmp_path):
    raised = [*SQUARE["vertices_coords"]]
    raised = [[x, y, 0.1 if (x, y) == (0, 1) else 0.0] for x, y in raised]
    path = file_of(tmp_path, vertices_coords=raised)
    pattern, diagnosis = diagnose(path)
    assert len(pattern.creases) == 2
    assert any("flat creases of the file are folded" in doubt for doubt in diagnosis.doubts)
    assert fd.read_pattern(path, facets="weld").welds.tolist() == [[0, 2]]


@pytest.mark.parametrize("facets", [(), [(0, 2)], None], ids=["hinges", "one", "all"])
def test_files_by_foldyn_say_which(facets, tmp_path):
    cut = fd.Pattern(SQUARE["vertices_coords"], SQUARE["faces_vertices"], ("F", "F"))
    pattern = fd.welded(cut, facets)
    fd.write_pattern(pattern, tmp_path / "x.fold")
    with warnings.catch_warnings():
        warnings.simplefilter("error", FoldynWarning)
        again = fd.read_pattern(tmp_path / "x.fold")
    assert (again.faces, again.assignments) == (pattern.faces, pattern.assignments)
    np.testing.assert_array_equal(again.welds, pattern.welds)


@pytest.mark.parametrize("ending", ["obj", "svg", "cp", "dxf"])
def test_other_formats_draw_welds_as_facets(ending, tmp_path):
    cut = fd.Pattern(SQUARE["vertices_coords"], SQUARE["faces_vertices"], ("F", "V"))
    path = tmp_path / f"x.{ending}"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        fd.write_pattern(fd.welded(cut, join=False), path)
        found = [fd.read_pattern(path, facets=facets) for facets in ("line", "weld", "hinge")]
    assert [len(pattern.creases) for pattern in found] == [1, 1, 2]
    assert [len(pattern.faces) for pattern in found] == [3, 2, 3]
    assert found[1].face_areas.max() == pytest.approx(found[0].face_areas.max())


def test_wrong_word(tmp_path):
    with pytest.raises(InputError, match="facets"):
        fd.read_pattern(file_of(tmp_path), facets="glue")


CASE = """
[pattern]
{pattern}
[sheet]
youngs_modulus = 2e9
poissons_ratio = 0.3
thickness = 1e-3
density = 700
[model]
kind = "bars_and_hinges"
[analysis]
kind = "modes"
"""
INLINE = """
vertices = [[0, 0], [1, 0], [1, 1], [0, 1], [2, 0], [2, 1]]
faces = [[0, 1, 2], [0, 2, 3], [1, 4, 5, 2]]
assignments = ["F", "V"]
"""


@pytest.mark.parametrize(
    ("keys", "panels", "welds"),
    [
        (INLINE, 3, 0),
        (INLINE + 'facets = "hinge"', 3, 0),
        (INLINE + 'facets = "line"', 3, 1),
        (INLINE + 'facets = "weld"', 2, 0),
        ('file = "x.fold"\nfacets = "weld"', 2, 0),
        ('file = "x.fold"\nfacets = "line"', 3, 1),
        ('kind = "eggbox"\nfacets = "weld"', 4, 0),
    ],
)
def test_case_files(keys, panels, welds, tmp_path):
    file_of(tmp_path)
    (tmp_path / "case.toml").write_text(CASE.format(pattern=keys))
    case_file = fd.read_case(tmp_path / "case.toml")
    assert (len(case_file.pattern.faces), len(case_file.pattern.welds)) == (panels, welds)
    assert case_file.case().structure.options.scheme == "n5b8e"  # in which welds can bend


DART = {
    "vertices_coords": [[0, 0], [2, 0], [0.6, 0.6], [0, 2], [0.6, -0.6], [0, -2]],
    "faces_vertices": [[0, 1, 2, 3], [0, 5, 4, 1]],
    "edges_vertices": [[0, 1]],
    "edges_assignment": ["V"],
}


@pytest.mark.parametrize("facets", [None, "weld", "hinge"])
def test_panels_that_are_not_convex_are_cut_and_it_is_said(facets, tmp_path):
    with pytest.warns(FoldynWarning, match=r"cut 2 panels not convex.*panels 2 to 3 are new"):
        pattern = fd.read_pattern(file_of(tmp_path, **DART), facets=facets)
    assert (pattern.creases.tolist(), pattern.welds.tolist()) == ([[0, 1]], [[0, 2], [0, 4]])
    fd.write_pattern(pattern, tmp_path / "y.fold")
    with warnings.catch_warnings():
        warnings.simplefilter("error", FoldynWarning)
        again = fd.read_pattern(tmp_path / "y.fold")
    assert again.faces == pattern.faces
    np.testing.assert_array_equal(again.welds, pattern.welds)


def test_panels_stay_as_they_are_drawn_with_lines(tmp_path):
    pattern = fd.read_pattern(file_of(tmp_path, **DART), facets="line")
    assert pattern.faces == ((0, 1, 2, 3), (0, 5, 4, 1))
