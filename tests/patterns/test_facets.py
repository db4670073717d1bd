"""Facets, joined across lines that are no creases, or welded; panels cut to be convex."""

import warnings

import numpy as np
import pytest
from scipy.spatial import Delaunay

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.patterns.facets import what_was_cut
from foldyn.patterns.topology import around
from sheets_with_facets import STEEL, crossed_miura, elastic

SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
HALVES = fd.Pattern([(0, 0), (1, 0), (2, 0), (2, 1), (1, 1), (0, 1)], [(0, 1, 4, 5), (1, 2, 3, 4)])


@pytest.mark.parametrize("dihedral", [60, 120, 179])
def test_diagonals_go_and_everything_else_stays(dihedral):
    whole, cut = crossed_miura(dihedral)
    made = fd.welded(cut)
    assert made.faces == whole.faces
    assert made.assignments == whole.assignments
    np.testing.assert_array_equal(made.vertices, whole.vertices)
    np.testing.assert_array_equal(made.creases, whole.creases)
    assert made.fold_angles.tolist() == [0.5] * len(whole.creases)
    rows = made.families["straight"]
    assert [made.assignments[k] for k in rows] == ["M"] * len(rows)
    assert len(rows) == whole.assignments.count("M")
    assert (made.name, made.custom, len(made.welds)) == ("cut", {"a": 1}, 0)


def test_only_some_facets():
    square = fd.Pattern([*SQUARE, (2, 0), (2, 1)], [(0, 1, 2), (0, 2, 3), (1, 4, 5, 2)])
    made = fd.welded(square, [(2, 0)])
    assert made.faces == ((0, 1, 2, 3), (1, 4, 5, 2))
    assert made.creases.tolist() == [[1, 2]]
    kept = fd.welded(square, [(2, 0)], join=False)
    assert kept.faces == square.faces
    assert (kept.creases.tolist(), kept.welds.tolist()) == ([[1, 2]], [[0, 2]])
    assert kept.weld_faces.tolist() == [[1, 0]]
    assert kept.weld_dihedrals.tolist() == [pytest.approx(np.pi)]
    named = fd.Pattern(square.vertices, square.faces, families={"middle": [(0, 2)]})
    assert fd.welded(named, "middle", join=False).welds.tolist() == [[0, 2]]
    with pytest.raises(InputError, match=r'facets = "midle": did you mean'):
        fd.welded(named, "midle")


def test_what_is_not_convex_or_loses_a_vertex_keeps_its_lines():
    dart = fd.Pattern([(0, 0), (2, -1), (0.5, 0), (2, 1)], [(0, 1, 2), (0, 2, 3)])
    assert fd.welded(dart).welds.tolist() == [[0, 2]]  # a corner that points inwards
    middle = fd.Pattern([*SQUARE, (0.5, 0.5)], [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])
    assert fd.welded(middle).welds.tolist() == [[0, 4], [1, 4], [2, 4], [3, 4]]
    assert fd.welded(HALVES).welds.tolist() == [[1, 4]]  # it ends between two corners
    hexagon = np.column_stack([np.cos(np.arange(6) * np.pi / 3), np.sin(np.arange(6) * np.pi / 3)])
    fan = fd.Pattern(hexagon, [(0, k, k + 1) for k in range(1, 5)])
    assert fd.welded(fan).faces == ((0, 1, 2, 3, 4, 5),)


def test_panels_that_do_not_lie_in_one_plane_stay():
    angle = np.radians(np.array([0, 10, 20]))
    arc = np.column_stack([np.sin(angle), np.zeros(3), np.cos(angle)])
    roof = fd.Pattern(
        np.concatenate([arc, arc + np.array([0, 1, 0])]),
        [(0, 1, 4, 3), (1, 2, 5, 4)],
        {(1, 4): "F"},
    )
    made = fd.welded(roof)
    assert (made.faces, made.welds.tolist()) == (roof.faces, [[1, 4]])
    assert abs(np.degrees(made.weld_dihedrals[0]) - 180) == pytest.approx(10)


@pytest.mark.parametrize("seed", range(8))
def test_random_triangles(seed):
    rng = np.random.default_rng(seed)
    points = np.concatenate([SQUARE, rng.random((3 * seed, 2))])
    cut = fd.Pattern(points, Delaunay(points).simplices)
    made = fd.welded(cut)
    assert not len(made.creases)
    assert set(map(tuple, made.boundary.tolist())) == set(map(tuple, cut.boundary.tolist()))
    assert made.face_areas.sum() == pytest.approx(1.0)
    assert set(np.concatenate(made.faces)) == set(range(len(points)))
    assert len(made.faces) <= len(cut.faces) - (seed == 0)
    again = fd.welded(made)
    assert again.faces == made.faces
    assert again.welds.tolist() == made.welds.tolist()
    assert fd.welded(fd.welded(cut, join=False)).faces == made.faces
    for face in made.faces:  # convex: every corner to the left of every side
        x = made.vertices[list(face)]
        for a, b in zip(x, np.roll(x, -1, axis=0), strict=True):
            assert (np.cross(b - a, x - a)[:, 2] >= -1e-12).all()


def test_copies_keep_welds():
    made = fd.welded(HALVES)
    for copy in (made.scaled(2), made.moved((1, 2, 3)), made.mirrored(), made.rotated(30, "x")):
        assert copy.welds.tolist() == [[1, 4]]
        assert not len(copy.creases)
    assert len(made.repeated((2, 2), [(2, 0, 0), (0, 1, 0)]).welds) == 4
    assert len(made.joined(made.moved((0, 1, 0))).welds) == 2


@pytest.mark.parametrize(
    ("facets", "message"),
    [
        ([(0, 1)], r"facets: \(0, 1\) is not a crease"),
        ([(1, 2)], r'facets: crease \(1, 2\) is assigned "M", so that it folds'),
        (["ab"], "facets: key 'ab' is not a pair"),
    ],
)
def test_wrong_facets(facets, message):
    pattern = fd.Pattern(
        [*SQUARE, (2, 0), (2, 1)], [(0, 1, 2), (0, 2, 3), (1, 4, 5, 2)], {(1, 2): "M"}
    )
    with pytest.raises(InputError, match=message):
        fd.welded(pattern, facets)


def test_wrong_welds():
    def made(welds, letters=None):
        return fd.Pattern(SQUARE, [(0, 1, 2), (0, 2, 3)], letters, welds=welds)

    with pytest.raises(InputError, match=r"welds: \(0, 1\) is not an edge of two panels"):
        made([(0, 1)])
    with pytest.raises(InputError, match=r"edge \(0, 2\) is 'M' but welded"):
        made([(0, 2)], {(0, 2): "M"})
    assert made([(2, 0)], {(0, 2): "F"}).welds.tolist() == [[0, 2]]
    with pytest.raises(InputError, match=r"welds: the panels at \(0, 2\) lie upon each other"):
        fd.Pattern([(0, 0), (1, 0), (1, 1), (0.9, 0)], [(0, 1, 2), (0, 2, 3)], welds=[(0, 2)])
    with pytest.raises(InputError, match="pattern: got list, give a Pattern"):
        fd.welded([])


def test_thick_panels_are_no_sheet():
    with pytest.raises(InputError, match="are welded to one sheet"):
        fd.thicken(fd.welded(HALVES), 0.01)
    with pytest.raises(InputError, match="facets: thick panels are boards"):
        fd.welded(fd.thicken(HALVES, 0.01))


L_SHAPE = 0.1 * np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
OUTLINES = {
    "L": L_SHAPE,
    "dart": [(0, 0), (1, 0), (0.3, 0.3), (0, 1)],
    "U": [(0, 0), (3, 0), (3, 2), (2, 2), (2, 1), (1, 1), (1, 2), (0, 2)],
    "vertex within an edge": [(0, 0), (0.5, 0), (1, 0), (1, 1)],
    "star": [
        (
            (1 + 1.5 * (k % 2)) * np.cos(0.2 * np.pi * k),
            (1 + 1.5 * (k % 2)) * np.sin(0.2 * np.pi * k),
        )
        for k in range(10)
    ],
}


def darts(turned=0):
    """Two panels with a corner that points inwards, on both sides of a crease."""
    points = 0.1 * np.array([(0, 0), (2, 0), (0.6, 0.6), (0, 2), (0.6, -0.6), (0, -2)])
    faces = [(0, 1, 2, 3), (0, 5, 4, 1)]
    faces = [face[turned:] + face[:turned] for face in faces]
    return fd.Pattern(points, faces, {(0, 1): "V"}, families={"middle": [(0, 1)]})


@pytest.mark.parametrize("outline", OUTLINES.values(), ids=OUTLINES)
def test_parts_are_convex_and_cover_the_panel(outline):
    whole = fd.Pattern(outline, [range(len(outline))])
    made = fd.convex(whole)
    np.testing.assert_array_equal(made.vertices, whole.vertices)
    assert made.face_areas.sum() == pytest.approx(whole.face_areas.sum(), rel=1e-12)
    assert len(made.creases) == 0
    assert len(made.welds) == len(made.faces) - 1
    np.testing.assert_array_equal(made.boundary, whole.boundary)
    for face in made.faces:
        x = made.vertices[list(face), :2]
        side = np.roll(x, -1, axis=0) - x
        assert (
            np.cross(np.c_[np.roll(side, 1, axis=0), 0 * x[:, 0]], np.c_[side, 0 * x[:, 0]])[:, 2]
            > 0
        ).all()
    assert fd.convex(made) is made
    fd.discretize(made, STEEL)
    fd.shell(made, STEEL, divisions=2)


def test_few_parts():
    assert fd.convex(fd.Pattern(L_SHAPE, [range(6)])).faces == ((0, 1, 2, 3), (0, 3, 4, 5))


@pytest.mark.parametrize("turned", range(4))
def test_numbers_stay(turned):
    whole = darts(turned)
    made = fd.convex(whole)
    np.testing.assert_array_equal(made.creases, whole.creases)
    assert (made.assignments, made.families["middle"].tolist()) == (("V",), [0])
    assert len(made.faces) == 4
    for part, panel in zip(made.faces, whole.faces, strict=False):  # by its first edge
        assert panel[:2] in list(around(part))
    assert what_was_cut(whole, made).startswith("cut 2 panels not convex")
    assert what_was_cut(whole, made).endswith("(panels 2 to 3 are new)")


def test_what_cannot_be_cut():
    with pytest.raises(InputError, match="pattern: got list, give a Pattern"):
        fd.convex([])  # type: ignore[arg-type]
    with pytest.raises(InputError, match="pattern: panel 0 is thick and not convex"):
        fd.convex(fd.thicken(darts(), 0.001))


@pytest.mark.parametrize("make", [fd.discretize, fd.shell])
def test_the_message_names_the_remedy(make):
    with pytest.raises(InputError, match=r"panel 0 .*cut it with fd\.convex\(pattern\)"):
        make(darts(), STEEL)


@pytest.mark.matrix
def test_a_folded_sheet_with_panels_that_are_not_convex():
    """Cut before it is folded or afterward, it is the same; the models agree within 15 %."""
    before = fd.fold(fd.convex(darts()), angles={(0, 1): 60}).pattern
    after = fd.convex(fd.fold(darts(), angles={(0, 1): 60}).pattern)
    assert before.faces == after.faces
    for pattern in (before, after):
        assert np.degrees(pattern.dihedrals) == pytest.approx([120])
        reduced, shell = fd.discretize(pattern, STEEL), fd.shell(pattern, STEEL, divisions=6)
        assert elastic(reduced)[0] == pytest.approx(elastic(shell)[0], rel=0.15)


INLINE = """
[pattern]
vertices = [[0, 0], [0.2, 0], [0.2, 0.1], [0.1, 0.1], [0.1, 0.2], [0, 0.2]]
faces = [[0, 1, 2, 3, 4, 5]]
{facets}
[sheet]
youngs_modulus = 1e9
poissons_ratio = 0.3
thickness = 1e-3
density = 500
[model]
kind = "bars_and_hinges"
[analysis]
kind = "modes"
"""


def test_case_files_say_so(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(INLINE.format(facets=""))
    with pytest.warns(FoldynWarning, match=r"pattern: cut a panel not convex.*\(panel 1 is new\)"):
        case = fd.read_case(path).case()
    assert len(case.structure.pattern.faces) == 2
    path.write_text(INLINE.format(facets='facets = "line"'))
    with warnings.catch_warnings():
        warnings.simplefilter("error", FoldynWarning)
        with pytest.raises(InputError, match=r'leave out facets = "line"'):
            fd.read_case(path).case()


def ridge(letters=None):
    """A gable roof whose two slopes are cut by diagonals."""
    points = [(x, y, 1.0 - abs(x)) for x in (-1, 0, 1) for y in (0, 2)]
    faces = [(0, 2, 3), (0, 3, 1), (2, 4, 5), (2, 5, 3)]
    return fd.Pattern(points, faces, letters)


@pytest.mark.parametrize("letters", [None, {(2, 3): "M"}], ids=["none", "some"])
def test_lines_without_letters_that_are_welded_beside_others_are_told(letters):
    roof = ridge(letters)
    assert roof.unlettered.tolist() == [True, letters is None, True]
    with pytest.warns(FoldynWarning, match=r"facets: 2 of 3 creases, as \(0, 3\), lie flat and"):
        assert len(fd.welded(roof.moved((1, 2, 3))).creases) == 1  # a moved one has none either
    for clear in (ridge("FMF"), roof.changed(assignments="FMF")):
        assert fd.welded(clear).faces == ((0, 2, 3, 1), (2, 4, 5, 3))
    fd.welded(roof, [(0, 3), (2, 5)])


@pytest.mark.parametrize("bend", [2e-4, -5e-3])
def test_the_advice_for_bent_panels_that_are_not_convex_fits(bend):
    # a vertex within an edge, and a corner out of the plane, as folding leaves them
    panel = [(0, 0, 0), (0, 0.4, 0), (0, 1, 0), (0.6, 1.2, bend), (0.6, 0.2, 0)]
    pattern = fd.Pattern(panel, [range(5)])
    with pytest.raises(
        InputError, match=r"cannot see every edge; cut it with fd\.convex\("
    ) as told:
        fd.discretize(pattern, STEEL)
    assert "n4b5" not in str(told.value)  # which has slivers there, or bends elsewhere
    assert len(fd.discretize(fd.convex(pattern), STEEL).triangles) >= 3
