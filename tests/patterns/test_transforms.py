"""Patterns made from others: what they keep, seen by their dihedrals."""

from __future__ import annotations

import numpy as np
import pytest

from foldyn.errors import FoldynWarning, InputError
from foldyn.patterns import Pattern, eggbox, kresling, miura, simple_fold, thicken
from foldyn.patterns.geometry import seams

KINDS = [miura(), eggbox(), kresling(), simple_fold()]
GLUED = 1e-9


def full(p):
    """The pattern with everything that one can have."""
    return p.changed(
        fold_angles=[0.1 * k if k % 2 else None for k in range(len(p.creases))],
        families={"odd": p.creases[1::2]} if len(p.creases) > 1 else {"one": p.creases},
        custom={"a:b": 1},
    )


def assert_kept(p, q):
    assert q.assignments == p.assignments
    np.testing.assert_allclose(q.dihedrals, p.dihedrals, atol=1e-12)
    np.testing.assert_array_equal(q.fold_angles, p.fold_angles)
    assert {k: v.tolist() for k, v in q.families.items()} == {
        k: v.tolist() for k, v in p.families.items()
    }
    assert (q.name, q.custom) == (p.name, p.custom)
    assert len(q.vertices) == len(p.vertices)


@pytest.mark.parametrize("p", [full(kind) for kind in KINDS], ids=repr)
@pytest.mark.parametrize(
    "move",
    [
        lambda p: p.scaled(2.5),
        lambda p: p.moved((1, -2, 3)),
        lambda p: p.rotated(30, (1, 2, 3), about=(0.5, 0, 0)),
        lambda p: p.mirrored(),
        lambda p: p.mirrored("z", about=(0, 0, 1)),
        lambda p: p.mirrored((1, 1, 0.3)),
    ],
    ids=["scaled", "moved", "rotated", "mirrored", "mirrored z", "mirrored askew"],
)
def test_dihedrals_letters_angles_and_families_are_kept(p, move):
    assert_kept(p, move(p))


def test_scaled():
    p = miura()
    np.testing.assert_array_equal(p.scaled(3).vertices, 3 * p.vertices)
    np.testing.assert_allclose(p.scaled(1e-3).face_areas, 1e-6 * p.face_areas)


def test_rotated_by_the_right_hand_rule():
    p = Pattern([(1, 0), (2, 0), (1, 1)], [(0, 1, 2)])
    np.testing.assert_allclose(p.rotated(90).vertices[0], [0, 1, 0], atol=1e-15)
    np.testing.assert_allclose(p.rotated(90, "y").vertices[0], [0, 0, -1], atol=1e-15)
    np.testing.assert_allclose(p.rotated(180, about=(1, 0, 0)).vertices[1], [0, 0, 0], atol=1e-15)
    assert not p.rotated(33.3).vertices[:, 2].any()  # stays level to the last digit


def test_a_mirror_standing_on_the_sheet_shows_the_same_side():
    """A valley seen from above is one in its mirror image, and the front is still above."""
    p = simple_fold(dihedral=120)
    q = p.mirrored("x")
    np.testing.assert_array_equal(q.vertices, p.vertices * [-1, 1, 1])
    assert (p.face_normals[:, 2] > 0).all() and (q.face_normals[:, 2] > 0).all()
    assert q.assignments == ("M",)
    assert [face[0] for face in q.faces] == [face[0] for face in p.faces]


def test_a_mirror_under_the_sheet_turns_its_front_with_it():
    """Seen from its front, which is below now, the ridge is still one."""
    q = simple_fold(dihedral=120).mirrored("z")
    assert (q.face_normals[:, 2] < 0).all()
    assert q.dihedrals[0] == pytest.approx(np.radians(240))
    assert q.assignments == ("M",)


def test_mirrored_twice_is_the_same():
    p = kresling()
    q = p.mirrored((1, 2, 3)).mirrored((1, 2, 3))
    np.testing.assert_allclose(q.vertices, p.vertices, atol=1e-12)
    assert q.faces == p.faces


@pytest.mark.parametrize("move", ["scaled", "moved", "rotated", "mirrored"])
def test_boards_move_with_their_panels(move):
    flat = simple_fold(dihedral=180).changed(assignments="V")
    p = thicken(flat, [0.1, 0.2])
    arguments = {"scaled": (2.0,), "moved": ((1, 2, 3),), "rotated": (50, "y"), "mirrored": ("x",)}
    q = getattr(p, move)(*arguments[move])
    again = thicken(getattr(flat, move)(*arguments[move]), p.boards.thickness.tolist())
    factor = 2.0 if move == "scaled" else 1.0
    if move == "scaled":
        again = thicken(flat.scaled(2.0), [0.2, 0.4])
    np.testing.assert_allclose(q.boards.thickness, factor * p.boards.thickness)
    np.testing.assert_allclose(q.flat_dihedrals, p.flat_dihedrals, atol=1e-12)
    np.testing.assert_allclose(q.boards.normals, again.boards.normals, atol=1e-12)
    np.testing.assert_allclose(q.boards.areas, again.boards.areas)


# ------------------------------------------------------------------------------ repeated, joined


def assert_same_sheet(p, q):
    """The same vertices and panels whatever their numbers, with the same dihedrals."""
    where = [np.argmin(np.linalg.norm(q.vertices - x, axis=1)) for x in p.vertices]
    assert len(p.vertices) == len(q.vertices)
    assert np.abs(q.vertices[where] - p.vertices).max() < GLUED * p.size
    assert {frozenset(where[v] for v in f) for f in p.faces} == set(map(frozenset, q.faces))
    row = {tuple(pair): k for k, pair in enumerate(q.creases.tolist())}
    for k, (a, b) in enumerate(p.creases.tolist()):
        other = row[tuple(sorted((int(where[a]), int(where[b]))))]
        assert q.assignments[other] == p.assignments[k]
        assert q.dihedrals[other] == pytest.approx(p.dihedrals[k], abs=1e-9)


@pytest.mark.parametrize("make", [miura, eggbox])
@pytest.mark.parametrize("counts", [(1, 1), (3, 1), (1, 2), (3, 2)])
def test_repeated_cells_are_the_sheet_of_the_generator(make, counts):
    cell = make(cells=(1, 1), a=0.7, b=1.1, panel_angle=50)
    sheet = make(cells=counts, a=0.7, b=1.1, panel_angle=50)
    assert_same_sheet(sheet, cell.repeated(counts))
    width = [np.ptp(cell.vertices[[0, 6], 0]), 0, 0]
    depth = [0, np.ptp(cell.vertices[[0, 2], 1]), 0]
    assert_same_sheet(sheet, cell.repeated(counts, [width, depth]))


def test_repeated_after_a_rotation():
    cell = miura(cells=(2, 1)).rotated(25, (1, 2, 3))
    assert_same_sheet(miura(cells=(4, 3)).rotated(25, (1, 2, 3)), cell.repeated((2, 3)))


def test_repeated_keeps_what_is_said_of_creases():
    cell = full(miura())
    sheet = cell.repeated((2, 2))
    given = sheet.fold_angles[~np.isnan(sheet.fold_angles)]
    wanted = cell.fold_angles[~np.isnan(cell.fold_angles)]
    np.testing.assert_allclose(np.sort(given), np.sort(np.tile(wanted, 4)))
    assert len(sheet.families["odd"]) == 4 * len(cell.families["odd"])
    assert (sheet.custom, sheet.name) == (cell.custom, cell.name)


def test_flat_creases_between_copies_are_unassigned():
    square = Pattern([(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1, 2), (0, 2, 3)], "V")
    sheet = square.repeated((2, 1))
    assert sorted(sheet.assignments) == ["U", "V", "V"]


def test_a_cut_stays_open_in_copies():
    points = [(0, 0), (1, 0), (2, 0), (2, 2), (1, 2), (0, 2), (1, 1), (1, 0)]
    cut = Pattern(
        points, [(0, 1, 6, 5), (5, 6, 4), (7, 2, 3, 6), (6, 3, 4)],
        {(1, 6): "B", (6, 7): "B", (5, 6): "V", (4, 6): "M", (3, 6): "V"},
    )  # fmt: skip
    with pytest.raises(InputError, match="periods: copies do not meet along edges"):
        cut.repeated((1, 2), [(9, 0, 0), (0, 9, 0)])
    row = cut.repeated((2, 1), [(2, 0, 0), (0, 2, 0)])
    assert (len(row.vertices), len(row.creases)) == (14, 7)
    assert len(seams(row.vertices, row.faces, row.face_normals, row.boundary)) == 2


def test_joined():
    left, right = simple_fold(), simple_fold()
    right = right.moved((np.ptp(left.vertices[:, 0]), 0, 0))
    zigzag = full(left).joined(right)
    assert (len(zigzag.vertices), len(zigzag.faces)) == (10, 4)
    assert zigzag.assignments == ("M", "V", "M")
    np.testing.assert_array_equal(zigzag.faces[:2], left.faces)
    assert zigzag.families["one"].tolist() == [0]
    assert zigzag.custom == {"a:b": 1}


def test_what_is_joined_by_its_back_is_seen_from_the_other_side():
    """Two squares in a plane, the second with its front below: its valley is a mountain."""
    one = Pattern([(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1, 2), (0, 2, 3)], "V", fold_angles=[1.0])
    two = Pattern([(1, 0), (2, 0), (2, 1), (1, 1)], [(0, 2, 1), (0, 3, 2)], "V", fold_angles=[1.0])
    assert two.face_normals[0, 2] == -1.0
    both = one.joined(two)
    assert (both.face_normals[:, 2] > 0).all()
    told = dict(zip(both.assignments, both.fold_angles.tolist(), strict=True))
    assert (told["V"], told["M"]) == (1.0, -1.0)
    assert both.assignments.count("U") == 1


def test_parts_that_do_not_touch_are_joined_aloud():
    p = simple_fold()
    with pytest.warns(FoldynWarning, match="share no edge"):
        both = p.joined(p.moved((9, 0, 0)))
    assert len(both.vertices) == 12


# ------------------------------------------------------------------------------ wrong arguments


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda p: p.scaled(0), "factor = 0"),
        (lambda p: p.moved((1, 2)), "shift = .*three numbers"),
        (lambda p: p.rotated("90"), "angle = "),
        (lambda p: p.rotated(90, "w"), 'axis = "w": give "x", "y", "z" or three numbers'),
        (lambda p: p.mirrored((0, 0, 0)), "normal = .*must not be zero"),
        (lambda p: p.repeated(3), "counts = 3: give two numbers"),
        (lambda p: p.repeated((0, 1)), r"counts\[0\] = 0"),
        (lambda p: p.repeated((2, 2), [(1, 0, 0)]), "periods = .*give two translations"),
        (lambda p: p.repeated((2, 2), tolerance=0), "tolerance = 0"),
        (lambda p: p.repeated((10**5, 10**5)), "counts.*vertices"),
        (lambda p: p.joined(5), "other = 5: give a Pattern"),
        (lambda p: thicken(p, 0.01, offsets=0.0).joined(p), "pattern: its panels are thick"),
        (lambda p: thicken(p, 0.01, offsets=0.0).repeated((2, 2)), "pattern: its panels are thick"),
    ],
)
def test_wrong_arguments(call, message):
    with pytest.raises(InputError, match=message):
        call(miura())


def test_a_pattern_without_periods():
    triangle = Pattern([(0, 0), (1, 0), (0.3, 1)], [(0, 1, 2)])
    with pytest.raises(InputError, match="periods: found 0 of the two translations"):
        triangle.repeated((2, 2))


def test_a_thick_pattern_keeps_what_is_said_of_creases():
    p = full(simple_fold(dihedral=180).changed(assignments="V"))
    q = thicken(p, 0.1)
    np.testing.assert_array_equal(q.fold_angles, p.fold_angles)
    assert (list(q.families), q.custom) == (["one"], p.custom)
