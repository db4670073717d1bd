"""What is special about each generator: its circle, its plane, its partner."""

from __future__ import annotations

import numpy as np
import pytest
from test_folded_generators import spans

import foldyn as fd
from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.patterns.topology import around


def circle(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Center of the circle that fits points best, and their distances from it."""
    terms = np.column_stack([x, y, np.ones(len(x))])
    center = np.linalg.lstsq(terms, x**2 + y**2, rcond=None)[0][:2] / 2
    return center, np.hypot(x - center[0], y - center[1])


def test_an_arc_of_equal_angles_is_a_miura():
    for dihedral in (40, 120, 180):
        options = {"cells": (2, 3), "a": 0.8, "b": 1.2, "panel_angle": 55, "dihedral": dihedral}
        arc, sheet = fd.patterns.arc_miura(**options, second_angle=55), fd.patterns.miura(**options)
        np.testing.assert_allclose(arc.vertices, sheet.vertices, atol=1e-13)
        assert arc.assignments == sheet.assignments


@pytest.mark.parametrize("line", [0, 1])
def test_an_arc_is_a_circle(line):
    arc = fd.patterns.arc_miura((1, 5), panel_angle=60, second_angle=72, dihedral=100)
    grid = arc.vertices.reshape(3, 11, 3)
    for parity in (0, 1):
        y, z = grid[line, parity::2, 1:].T
        _, radius = circle(y, z)
        assert np.ptp(radius) < 1e-12 * radius[0]
    # planes of constant x, the mean of both straight edges is a
    assert np.ptp(grid[line, :, 0]) == 0.0
    steps = np.linalg.norm(np.diff(grid[line], axis=0), axis=1)
    assert steps[:2].mean() == pytest.approx(1.0, abs=1e-14)
    assert steps[0] != pytest.approx(steps[1], abs=0.01)


@pytest.mark.parametrize(("a", "b"), [(1.0, 1.0), (1.0, 1.4), (1.3, 1.0)])
def test_a_waterbomb_rolls_up_to_a_cylinder(a, b):
    bomb = fd.patterns.waterbomb((2, 3), a, b=b, dihedral=125)
    line, rows = 5, 4
    grid, centers = bomb.vertices[: rows * line].reshape(rows, line, 3), bomb.vertices[20:]
    axis, radius = circle(*bomb.vertices[: rows * line, ::2].T)
    assert np.ptp(radius) < 1e-12
    rise = grid[0, 1, 1] - centers[0, 1]  # of the lower middle; its corners are below by a/2
    assert grid[0, 0, 1] - centers[0, 1] == pytest.approx(-a / 2, abs=1e-13)
    depth = radius[0] - np.linalg.norm(centers[:, ::2] - axis, axis=1)
    np.testing.assert_allclose(depth, np.sqrt((a / 2) ** 2 - rise**2), atol=1e-12)
    # each row takes up the same length, and all columns the same angle
    np.testing.assert_allclose(np.diff(grid[:, 0, 1])[::2], a, atol=1e-12)
    np.testing.assert_allclose(np.diff(grid[::2, 0, 1]), a - 2 * rise, atol=1e-12)
    angle = np.arctan2(grid[..., 0] - axis[0], grid[..., 2] - axis[1])
    assert np.ptp(np.diff(angle, axis=1)) < 1e-12


def test_a_waterbomb_of_wide_bases_closes_before_its_sides_do():
    closed = 2 * np.degrees(np.arccos(1 / 1.5))
    shut = fd.patterns.waterbomb((1, 1), 1.0, b=1.5, dihedral=closed + 1e-6)
    assert np.ptp(shut.vertices[:, 1]) == pytest.approx(1.0, abs=1e-4)
    with pytest.raises(InputError, match=r"dihedral = 90: must be between 96\.3794 and 180"):
        fd.patterns.waterbomb((1, 1), 1.0, b=1.5, dihedral=90)


def test_a_full_turn_of_yoshimura_is_a_tower_of_antiprisms():
    sides, a, b = 8, 0.3, 0.8
    half = np.arccos(np.tan(np.pi / (2 * sides)) * b / (2 * a))
    rolled = fd.patterns.yoshimura((sides, 2), a, b=b, dihedral=2 * np.degrees(half))
    ring = rolled.vertices[: sides + 1]
    np.testing.assert_allclose(ring[0], ring[-1], atol=1e-12)
    radius, height = b / (2 * np.sin(np.pi / sides)), a * np.sin(half)
    tower = fd.patterns.kresling(sides, radius, height=height, twist=-180 / sides, storeys=2)
    found = np.unique(np.minimum(rolled.dihedrals, 2 * np.pi - rolled.dihedrals).round(9))
    wanted = np.unique(np.minimum(tower.dihedrals, 2 * np.pi - tower.dihedrals).round(9))
    np.testing.assert_allclose(found, wanted, atol=2e-9)


def test_storeys_of_both_hands():
    plain = fd.patterns.kresling(6, 0.1, height=0.08, twist=25, storeys=4)
    tower = fd.patterns.kresling(6, 0.1, height=0.08, twist=25, storeys=4, alternating=True)
    one = fd.patterns.kresling(6, 0.1, height=0.08, twist=25)
    np.testing.assert_array_equal(tower.vertices[:12], plain.vertices[:12])
    np.testing.assert_allclose(tower.vertices[24:, :2], tower.vertices[:6, :2], atol=1e-15)
    # each storey is congruent to a single one, every second one its mirror image
    for rows in (slice(0, 12), slice(12, 24), slice(24, 36), slice(36, 48)):
        own = np.sort(spans(Pattern(tower.vertices, tower.faces[rows])))
        np.testing.assert_allclose(own, np.sort(spans(one)), atol=1e-14)
    assert {tower.assignments[k] for k in tower.families["diagonal"]} == {"V"}
    assert {tower.assignments[k] for k in tower.families["side"]} == {"M"}
    mirrored = tower.vertices * [1.0, 1.0, -1.0] + [0.0, 0.0, 0.32]  # upside down, ring by ring
    np.testing.assert_allclose(
        np.sort(mirrored, axis=0), np.sort(tower.vertices, axis=0), atol=1e-15
    )


def test_a_twist_folds_by_the_multipliers_of_its_corners():
    """tan(q/2) = tan(45 - g/2) tan(p/2), and opposite creases fold alike."""
    twist = fd.patterns.square_twist(panel_angle=40, dihedral=110)
    fold = np.abs(np.pi - twist.dihedrals)
    p, q = np.radians(70), 2 * np.arctan(np.tan(np.radians(25)) * np.tan(np.radians(35)))
    assert sorted(fold.round(10)) == sorted(np.round([p] * 6 + [q] * 6, 10))
    assert np.sort(fold[twist.families["center"]]) == pytest.approx([q, q, p, p])


@pytest.mark.parametrize("options", [{}, {"cells": 2, "a": 0.5, "b": 0.8, "panel_angle": 70}])
def test_tubes_fold_rigidly_and_have_equal_panels(options):
    a, b = options.get("a", 1.0), options.get("b", 1.0)
    g = np.radians(options.get("panel_angle", 60))
    for make in (fd.patterns.miura_tube, fd.patterns.zipper_tubes):
        states = [make(**options, dihedral=d) for d in (20, 90, 150)]
        for tubes in states:
            np.testing.assert_allclose(tubes.face_areas, a * b * np.sin(g), rtol=1e-12)
            np.testing.assert_allclose(spans(tubes), spans(states[0]), atol=1e-13)
            assert tubes.face_planarity.max() < 1e-13
            assert {tubes.assignments[k] for k in tubes.families["zigzag"]} == {"M"}
    tube = fd.patterns.miura_tube(**options, dihedral=50)
    inside = 360 - np.degrees(tube.dihedrals[tube.families["zigzag"]])
    np.testing.assert_allclose(np.sort(inside).reshape(2, -1).mean(axis=1), [50, 130])
    middles = np.array([tube.vertices[list(f), 1:].mean(axis=0) for f in tube.faces])
    outward = tube.face_normals[:, 1:] * (middles - tube.vertices[:, 1:].mean(axis=0))
    assert (outward.sum(axis=1) > 0).all()


@pytest.mark.parametrize("panel_angle", [50, 60, 80])
def test_walls_of_zipper_tubes_stay_in_one_another(panel_angle):
    weights = []
    for dihedral in (30, 90, 150):
        zipper = fd.patterns.zipper_tubes(2, 1.0, b=0.9, panel_angle=panel_angle, dihedral=dihedral)
        half = len(zipper.vertices) // 2
        ties = zipper.custom["foldyn:ties"]
        assert len(ties) == half // 2
        assert all(node >= half > max(corners) for node, corners in ties)
        for node, corners in ties:
            origin, one, other = zipper.vertices[corners]
            basis = np.column_stack([one - origin, other - origin])
            found, *_ = np.linalg.lstsq(basis, zipper.vertices[node] - origin, rcond=None)
            np.testing.assert_allclose(basis @ found + origin, zipper.vertices[node], atol=1e-13)
            weights.append(found)
        # the second tube lies beyond the wall, the first one before it
        wall = np.cross([1.0, 0.0, 0.0], zipper.vertices[2] - zipper.vertices[3])
        beyond = (zipper.vertices - zipper.vertices[3]) @ wall
        inner = np.sign(beyond[half:].mean())
        assert inner == -np.sign(beyond[:half].mean())
    each = np.array(weights).reshape(3, -1, 2)
    np.testing.assert_allclose(each[1:], each[:1].repeat(2, 0), atol=1e-12)
    lean = 0.9 * np.cos(np.radians(panel_angle))
    wanted = np.round([-lean, lean, 1 - lean, 1 + lean], 9)
    assert set(each[0, :, 0].round(9)) == set(wanted)


def test_layers_of_a_flasher_stand_on_its_hub():
    wrapped = fd.patterns.flasher(sides=6, a=0.1, rings=3, folded=True)
    x, y, z = wrapped.vertices.T
    np.testing.assert_allclose(np.hypot(x, y), 0.1, atol=1e-15)  # corners of the prism
    assert z.min() == 0.0
    assert z.max() == pytest.approx(3 * 0.1 * np.tan(np.pi / 6))


def test_tiles_of_resch_close_up():
    flat = fd.patterns.resch((3, 2), 0.5, dihedral=180)
    closed = fd.patterns.resch((3, 2), 0.5, dihedral=0)
    np.testing.assert_allclose(spans(closed), spans(flat), atol=1e-15)
    tiles = [f for f in range(len(flat.faces)) if flat.face_areas[f] > 0.3 * 0.5**2]
    assert len(tiles) == 2 * 6
    np.testing.assert_allclose(flat.face_areas[tiles], np.sqrt(3) / 4 * 0.5**2)
    corners = np.unique([closed.faces[f] for f in tiles])
    assert np.ptp(closed.vertices[corners, 2]) == 0.0
    np.testing.assert_allclose(closed.face_normals[tiles], [[0, 0, 1]] * len(tiles), atol=1e-15)
    # stars hang upright below
    others = np.setdiff1d(np.arange(len(flat.faces)), tiles)
    assert np.abs(closed.face_normals[others, 2]).max() < 1e-14
    np.testing.assert_allclose(np.pi - closed.dihedrals, flat.fold_angles, atol=1e-12)
    # and the states before the last come to it
    nearly = fd.patterns.resch((3, 2), 0.5, dihedral=0.01)
    np.testing.assert_allclose(nearly.vertices, closed.vertices, atol=2e-3)


def test_columns_of_resch_turn_alike_about_one_axis():
    folded = fd.patterns.resch((4, 2), 1.0, dihedral=100)
    star = folded.creases[folded.families["star"]]
    centers = np.flatnonzero(np.bincount(star.ravel()) == 3)
    assert len(centers) == 8
    assert np.ptp(circle(*folded.vertices[centers, ::2].T)[1]) < 1e-12


# ------------------------------------------------------------------------------ arguments


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda p: p.arc_miura((1, 40)), r"arc_miura: cells\[1\] = 40: each of the 40 cells"),
        (lambda p: p.arc_miura(a=0.1, b=2.0, second_angle=30), "arc_miura: a = 0.1: .*no length"),
        (lambda p: p.arc_miura(second_angle=90), "arc_miura: second_angle = 90: .*acute corner"),
        (lambda p: p.waterbomb((9, 2), dihedral=100), r"cells\[0\] = 9: .*at most \d bases"),
        (lambda p: p.waterbomb(dihedral=0), "waterbomb: dihedral = 0: must be between 0 and 180"),
        (lambda p: p.waterbomb((2, 0)), r"waterbomb: cells\[1\] = 0"),
        (lambda p: p.yoshimura((9, 1), dihedral=120), r"yoshimura: cells\[0\] = 9: .* 9 bases"),
        (lambda p: p.yoshimura(a=-1), "yoshimura: a = -1: must be greater than 0 m"),
        (lambda p: p.curved_pleat(arc=90, segments=9, dihedral=80),
         "curved_pleat: dihedral = 80: must be between 80 and 180"),
        (lambda p: p.curved_pleat(arc=180), "curved_pleat: arc = 180: must be between 0 and 180"),
        (lambda p: p.curved_pleat(segments=0), "curved_pleat: segments = 0"),
        (lambda p: p.miura_tube(dihedral=180), "miura_tube: dihedral = 180: .*the tube is flat"),
        (lambda p: p.miura_tube(cells=(1, 2)), "miura_tube: cells = "),
        (lambda p: p.miura_tube(panel_angle=95), "miura_tube: panel_angle = 95"),
        (lambda p: p.zipper_tubes(b=2.5), "b = 2.5: walls .* do not overlap.*below 2 m"),
        (lambda p: p.square_twist(symmetric=True), "square_twist: dihedral = 100: a symmetric"),
        (lambda p: p.square_twist(symmetric=1), "square_twist: symmetric = 1: must be T"),
        (lambda p: p.flasher(folded="yes"), 'flasher: folded = "yes": must be True or False'),
        (lambda p: p.resch((10, 1)), r"resch: cells\[0\] = 10: .* columns of stars"),
        (lambda p: p.resch(dihedral=-1), "resch: dihedral = -1: must be between 0 and 180"),
        (lambda p: p.resch((0, 1)), r"resch: cells\[0\] = 0"),
        (lambda p: p.flasher(sides=2), "flasher: sides = 2: must be a whole number, at least 3"),
        (lambda p: p.kresling(alternating="no"), 'kresling: alternating = "no": must be True or F'),
    ],
)  # fmt: skip
def test_wrong_arguments(make, message):
    with pytest.raises(InputError, match=message):
        make(fd.patterns)


def test_arguments_that_are_too_many_are_refused_before_memory_is_full():
    for make, name in (
        (lambda: fd.patterns.waterbomb((10**6, 10**6)), "cells"),
        (lambda: fd.patterns.resch((10**6, 10**6)), "cells"),
        (lambda: fd.patterns.miura_tube(10**11), "cells"),
        (lambda: fd.patterns.curved_pleat(10**6, 10**6), "pleats"),
        (lambda: fd.patterns.flasher(10**6, rings=10**6), "sides"),
    ):
        with pytest.raises(InputError, match=name):
            make()


def test_edges_of_faces_are_those_of_the_pattern():
    """Vertices stay where a case file expects them: the first of each generator."""
    assert fd.patterns.yoshimura((6, 4)).faces[0] == (0, 1, 7)
    assert fd.patterns.waterbomb((4, 5)).faces[0] == (54, 9, 0)
    assert fd.patterns.miura_tube(1).faces[0] == (0, 4, 5, 1)
    assert list(around(fd.patterns.square_twist().faces[0])) == [(0, 1), (1, 2), (2, 3), (3, 0)]
