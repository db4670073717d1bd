"""Slips of drawing: the nearest pattern that folds flat, and that folds without bending panels."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import ComputationError, InputError
from foldyn.patterns.flat_foldability import flat_foldability, flat_foldable


def flat_miura():
    return fd.patterns.miura(cells=(2, 2), a=0.03, b=0.04, panel_angle=70, dihedral=180)


def flat_arc():
    return fd.patterns.arc_miura(cells=(2, 3), dihedral=180)


def slipped(pattern, slip, seed=0):
    """The pattern with each place moved by a slip (m) in some direction of the plane."""
    places, place = np.unique(pattern.vertices, axis=0, return_inverse=True)
    turn = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, len(places))
    moved = places + slip * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    return pattern.changed(vertices=moved[place.ravel()])


def farthest(one, other):
    return np.linalg.norm(one.vertices - other.vertices, axis=1).max()


@pytest.mark.parametrize("drawn", [flat_miura(), flat_arc()], ids=["miura", "arc"])
@pytest.mark.parametrize("part", [1e-6, 1e-4, 2e-3])
def test_kawasaki_holds_at_the_nearest_vertices(drawn, part):
    slip = part * min(length for sides in drawn.sides for length in sides.tolist())
    off = slipped(drawn, slip)
    mended = flat_foldable(off)
    assert flat_foldability(off).alternating.max() > 1e-7
    assert flat_foldability(mended).alternating.max() < 1e-11
    # the drawing without slips is one that folds flat: the nearest is no farther
    apart = np.linalg.norm(mended.vertices - off.vertices)
    assert 0.1 * slip < apart <= np.linalg.norm(drawn.vertices - off.vertices) * (1.0 + 1e-6)
    assert (mended.faces, mended.assignments) == (off.faces, off.assignments)


def test_panels_stay_plane_where_they_were_to():
    mended = flat_foldable(slipped(flat_miura(), 2e-5, seed=3))
    folding = fd.fold(mended, fraction=0.4, steps=1, initial="pattern")
    assert folding.kind == "rigid" and not len(folding.pattern.welds)


def test_what_is_exact_stays_as_it_is():
    drawn = flat_miura()
    assert flat_foldable(drawn) is drawn


def test_panels_that_are_not_to_stay_plane_do_not_matter():
    twist = fd.patterns.square_twist(dihedral=180)  # folds flat, but with strained panels
    off = slipped(twist, 1e-4 * twist.size)
    mended = flat_foldable(off)
    assert flat_foldability(mended).alternating.max() < 1e-11
    assert farthest(mended, off) < 3e-4 * twist.size


def test_creases_without_letters_and_lines_in_panels():
    drawn = flat_miura()
    cut = [piece for a, b, c, d in drawn.faces for piece in ((a, b, c), (a, c, d))]
    folds = dict.fromkeys(map(tuple, drawn.creases.tolist()), "U")
    off = slipped(fd.Pattern(drawn.vertices, cut, folds), 3e-5, seed=1)  # diagonals are flat
    mended = flat_foldable(off)
    assert flat_foldability(mended).alternating.max() < 1e-11
    whole = fd.Pattern(off.vertices, drawn.faces, folds)
    np.testing.assert_allclose(mended.vertices, flat_foldable(whole).vertices, atol=1e-12)


def test_vertices_that_are_not_meant_to_fold_flat_keep_their_angles():
    drawn = flat_miura()
    other = drawn.vertices.copy()
    inside = flat_foldability(drawn).vertices
    other[inside[0], 0] += 0.004  # by far more than a slip
    off = slipped(drawn.changed(vertices=other), 1e-5)
    before, after = flat_foldability(off).alternating, flat_foldability(flat_foldable(off))
    far = before > np.radians(2.0)
    assert far.any() and after.alternating[~far].max() < 1e-11
    np.testing.assert_allclose(after.alternating[far], before[far], rtol=0.01)


def test_both_sides_of_a_cut_stay_together():
    drawn = flat_miura()
    letters = dict(zip(map(tuple, drawn.creases.tolist()), drawn.assignments, strict=True))
    letters[1, 6] = "B"  # cut open from the outline on
    twin = len(drawn.vertices)
    first = tuple(twin if vertex == 1 else vertex for vertex in drawn.faces[0])
    points = np.vstack([drawn.vertices, drawn.vertices[1]])
    cut = fd.Pattern(points, [first, *drawn.faces[1:]], letters)
    mended = flat_foldable(slipped(cut, 1e-5))
    np.testing.assert_array_equal(mended.vertices[twin], mended.vertices[1])


@pytest.mark.parametrize(
    ("pattern", "error", "message"),
    [
        (fd.patterns.miura(dihedral=120), InputError, "pattern: is folded; mend the flat"),
        (
            fd.thicken(fd.patterns.simple_fold(dihedral=180), 1e-3),
            InputError,
            "pattern: has thick panels",
        ),
        ([[0, 0, 0]], InputError, "pattern: got list"),
    ],
)
def test_what_cannot_be_mended_is_refused(pattern, error, message):
    with pytest.raises(error, match=message):
        flat_foldable(pattern)


def test_moves_that_are_no_slips_are_refused():
    turn = np.radians([0.0, 90.95, 180.0, 270.0])  # the sum is 1.9 degrees
    rim = np.column_stack([np.cos(turn), np.sin(turn)])
    beside = [1.0, 1e-4]  # a corner that vertex 1 would pass as it moves
    faces = [(0, 1, 5, 2), (0, 2, 3), (0, 3, 4), (0, 4, 1)]
    fan = fd.Pattern(np.vstack([[0, 0], rim, beside]), faces, "MMVM")
    with pytest.raises(ComputationError, match="close enough: vertex 1 would move by"):
        flat_foldable(fan)
