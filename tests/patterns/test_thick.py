"""Thick panels: where hinge lines and boards lie."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from strips import overlap, section, strip

T, W = 0.1, 1.0


def test_hinges_of_a_strip_lie_in_the_faces_by_turns():
    thick = fd.thicken(strip(4), T)
    np.testing.assert_allclose(thick.vertices[:5, 2], [-0.05, 0.05, -0.05, 0.05, -0.05], atol=1e-16)
    np.testing.assert_array_equal(thick.vertices[:, :2], strip(4).vertices[:, :2])
    assert thick.faces == strip(4).faces
    assert thick.assignments == ("V", "M", "V")
    tilt = 2.0 * np.arctan(T / W)
    np.testing.assert_allclose(thick.flat_dihedrals, np.pi + tilt * np.array([1, -1, 1]))
    np.testing.assert_allclose(thick.dihedrals, thick.flat_dihedrals, rtol=1e-15)
    np.testing.assert_allclose(thick.boards.areas, 0.6 * W, rtol=1e-14)
    np.testing.assert_allclose(thick.boards.normals, [[0, 0, 1]] * 4, atol=1e-15)
    np.testing.assert_array_equal(thick.boards.corners[:, 2], 0.0)


def test_letters_follow_the_boards_not_the_planes_of_the_hinges():
    """A flat valley looks like a mountain from its hinge lines: no warning, and no other letter."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert fd.thicken(strip(3), T).assignments == ("V", "M")
        bare = fd.Pattern(strip(3, fold_angle=40).vertices, strip(3).faces)
        assert fd.thicken(bare, T).assignments == ("V", "M")


@pytest.mark.parametrize("angle", [0.0, 25.0, 90.0, 140.0])
def test_length_of_an_accordion(angle):
    """Two boards reach 2 (w cos(a/2) + t sin(a/2)) from hinge line to hinge line."""
    thick = fd.thicken(strip(5, W, fold_angle=angle), T)
    x, half = thick.vertices[:6], np.radians(angle) / 2
    for k in (0, 1, 2, 3):
        reach = np.linalg.norm(x[k + 2] - x[k])
        assert reach == pytest.approx(2 * (W * np.cos(half) + T * np.sin(half)), rel=1e-13)
    side = np.hypot(W, T)
    np.testing.assert_allclose(np.linalg.norm(np.diff(x, axis=0), axis=1), side, rtol=1e-13)
    fold = np.degrees(thick.flat_dihedrals - thick.dihedrals)
    np.testing.assert_allclose(fold, [angle, -angle, angle, -angle], atol=1e-10)


@pytest.mark.parametrize("count", [2, 3, 6])
def test_an_accordion_folded_flat_is_as_high_as_its_boards_together(count):
    thin = strip(count, fold_angle=180.0)
    assert np.ptp(thin.vertices[:, 2]) < 1e-14  # the thin one has no height
    thick = fd.thicken(thin, T)
    heights = [thick.boards.of(k)[:, 2] for k in range(count)]
    np.testing.assert_allclose(heights, np.arange(count)[:, None] * T + np.zeros(4), atol=1e-13)
    corners = np.vstack([section(thick, k) for k in range(count)])
    assert np.ptp(corners[:, 1]) == pytest.approx(count * T, rel=1e-13)
    assert np.ptp(corners[:, 0]) == pytest.approx(W, rel=1e-13)


@pytest.mark.parametrize("letter", ["V", "M"])
def test_boards_fold_to_their_own_side_only(letter):
    """Hinged in a face, two boards close until these touch; the other way they collide at once."""
    other = {"V": "M", "M": "V"}[letter]
    for angle in (0.0, 1.0, 60.0, 120.0, 180.0):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            right = fd.thicken(strip(2, fold_angle=angle, letters=letter), T)
            height = (0.5 if letter == "V" else -0.5) * T
            wrong = fd.thicken(strip(2, fold_angle=angle, letters=other), T, offsets=height)
        assert overlap(section(right, 0), section(right, 1)) < 1e-12
        deep = overlap(section(wrong, 0), section(wrong, 1))
        assert (deep > 1e-3) == (0.0 < angle < 180.0)  # at 180 they have passed through
    closed = fd.thicken(strip(2, fold_angle=180.0, letters=letter), T).boards
    apart = np.abs(closed.of(1)[:, 2].mean() - closed.of(0)[:, 2].mean())
    assert apart == pytest.approx(T, rel=1e-13)


def test_faces_of_boards_of_two_thicknesses_are_flush():
    thick = fd.thicken(strip(3), [0.1, 0.2, 0.06])
    tops = [section(thick, k)[:, 1].max() for k in range(3)]
    bottoms = [section(thick, k)[:, 1].min() for k in range(3)]
    assert tops[0] == pytest.approx(tops[1])  # the valley is in the front faces
    assert bottoms[1] == pytest.approx(bottoms[2])  # the mountain in the back faces
    assert tops[1] - tops[2] == pytest.approx(0.14)


def test_offsets_for_all_and_for_each_crease():
    thick = fd.thicken(strip(3), T, offsets=[0.02, 0.05])
    np.testing.assert_allclose(thick.vertices[1:3, 2], [0.02, 0.05], rtol=1e-14)
    middle = fd.thicken(strip(4), T, offsets=0.0)
    np.testing.assert_array_equal(middle.vertices, strip(4).vertices)
    np.testing.assert_array_equal(middle.flat_dihedrals, np.pi)


def test_creases_at_one_height_may_meet():
    """All hinges in the front faces: hinge lines meet as those of the thin Miura do."""
    miura = fd.patterns.miura((2, 2), 0.1, b=0.1, dihedral=100)
    thick = fd.thicken(miura, 0.01, offsets=0.005)
    first = miura.vertices + 0.005 * miura.face_normals[0]
    np.testing.assert_allclose(
        thick.vertices - thick.vertices[0], miura.vertices - miura.vertices[0], atol=1e-15
    )
    np.testing.assert_allclose(thick.vertices[0], first[0], atol=1e-15)
    np.testing.assert_allclose(thick.flat_dihedrals, np.pi, rtol=1e-13)


def test_a_triangular_flap_has_its_mass_in_the_middle_surface():
    """One hinge: the plane goes through the centroid, so the free corner is at minus twice it."""
    flaps = fd.Pattern([(0, 0), (1, 0), (0.3, 0.8), (0.6, -0.7)], [(0, 1, 2), (1, 0, 3)],
                       {(0, 1): "V"})  # fmt: skip
    thick = fd.thicken(flaps, T)
    np.testing.assert_allclose(thick.vertices[:, 2], [0.05, 0.05, -0.1, -0.1], rtol=1e-13)


def test_a_ring_closes_or_is_refused():
    """A square tube, hinged inside; with its hinges inside and outside by turns it would tear."""
    x = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
    vertices = [(*p, z) for z in (0.0, 1.0) for p in x]
    faces = [(k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k) for k in range(4)]
    tube = fd.Pattern(vertices, faces)
    assert set(tube.assignments) == {"M"}
    fd.thicken(tube, T)
    with pytest.raises(InputError, match="do not close a ring: they part at crease"):
        fd.thicken(tube, T, offsets=[0.05, -0.05, 0.05, 0.05])


SKEW = fd.Pattern([(0, 0), (1, 0), (2, 0), (3, 0), (0, 1), (1, 1), (2.2, 1), (3, 1)],
                  [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6)], 
                  {(1, 5): "V", (2, 6): "M"})  # fmt: skip
TOUCH = fd.Pattern(
    [(0, 0), (1, 0), (1, 1), (0, 1), (-1, 0.5), (2, 1), (2, 2), (1, 2)],
    [(0, 1, 2, 3), (3, 4, 0), (2, 5, 6, 7)], {(0, 3): "V"},
)  # fmt: skip


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: fd.thicken(fd.patterns.miura(), 0.1),
            r"pattern: creases \d and \d meet at vertex 4 at different heights, -?0.05 and -?0.05",
        ),
        (lambda: fd.thicken(SKEW, T), "pattern: hinge lines of panel 1 do not lie in one plane"),
        (lambda: fd.thicken(TOUCH, T), "would part at vertex 2, where they meet in a corner alone"),
        (lambda: fd.thicken(strip(2), 0.0), "thickness = 0.0: must be greater than 0"),
        (lambda: fd.thicken(strip(2), [1, 2, 3]), "3 values for 2 panels; give one, or"),
        (
            lambda: fd.thicken(strip(2), T, offsets=0.06),
            "offsets: crease 0 has 0.06 m: must be at most h",
        ),
        (lambda: fd.thicken(strip(2), T, offsets=[0, 0]), "2 values for 1 creases; give one, or"),
        (
            lambda: fd.thicken(fd.Pattern(strip(2).vertices, strip(2).faces, "U"), T),
            "offsets: crease 0 is unassigned",
        ),
        (lambda: fd.thicken(fd.thicken(strip(2), T), T), "pattern: its panels are thick already"),
        (
            lambda: fd.thicken(fd.Pattern([(0, 0, 0), (1, 0, 0), (1, 1, 0.1), (0, 1, 0)],
                                          [(0, 1, 2, 3)]), T),
            "panel 0 is not flat",
        ),
        (
            lambda: fd.Pattern(strip(2).vertices, strip(2).faces,
                               boards=fd.thicken(strip(3), T).boards),
            "boards: give one for each face",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_thick(make, message):
    with pytest.raises(InputError, match=message):
        make()
