"""Stiffness of folds, bends and bars: section 5 of the design by hand numbers."""

from __future__ import annotations

import itertools
from functools import partial

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError

discretize = partial(fd.discretize, preset="herkal")
E, NU, T = 1e6, 0.25, 0.01
SHEET = fd.Sheet(E, NU, T)
G = E * T**3 / (12 * (1 - NU**2))  # 0.0888889 N m


def panel(vertices, **options):
    pattern = fd.Pattern(vertices, [list(range(len(vertices)))])
    return discretize(pattern, options.pop("sheet", SHEET), **options)


def area_of(s, a, b):
    rows = [k for k, row in enumerate(s.bars.tolist()) if sorted(row) == sorted((a, b))]
    assert len(rows) == 1
    return s.bar_area[rows[0]]


RECTANGLE = [[0, 0], [2, 0], [2, 1], [0, 1]]


def test_fold_of_case_one():
    """1/kf = 1/G + 1/(0.55 G 100^(1/3)): 0.06387 N m/rad, printed as 0.0639 in the paper."""
    (found,) = discretize(fd.patterns.simple_fold(1.0, 1.0, dihedral=60), SHEET).fold_stiffness
    assert pytest.approx(0.0888889, rel=1e-6) == G
    assert found == pytest.approx(1 / (1 / G + 1 / (0.55 * G * 100 ** (1 / 3))), rel=1e-14)
    assert found == pytest.approx(0.06387, abs=5e-6) and round(found, 4) == 0.0639


@pytest.mark.parametrize("unit", [1.0, 1e-3], ids=["mm", "m"])
def test_fold_of_the_specimen(unit):
    """kf = 0.4739 N mm/rad (paper, section 6) in millimeters and in meters."""
    pattern = fd.patterns.miura((1, 1), 25.0 * unit, b=25.0 * unit, panel_angle=60, dihedral=39.2)
    sheet = fd.Sheet(1219.0 / unit**2, 0.2, 0.24 * unit, length_scale_ratio=2.7)
    found = discretize(pattern, sheet).fold_stiffness
    np.testing.assert_allclose(found, 0.4739 * unit, atol=5e-5 * unit)


def test_fold_takes_its_own_length():
    s = discretize(fd.patterns.miura(a=1.0, b=8.0), SHEET)
    length = np.linalg.norm(s.nodes[s.folds[:, 1]] - s.nodes[s.folds[:, 0]], axis=1)
    assert sorted(set(length.round(9))) == [1.0, 8.0]
    expected = 1 / (1 / G + 1 / (0.55 * G * (length / T) ** (1 / 3)))
    np.testing.assert_allclose(s.fold_stiffness, expected, rtol=1e-13)


def test_rectangle_n5b8():
    """W = 2 (edges 1, 3), H = 1: areas by hand; a bend is half a diagonal of sqrt(5)."""
    with pytest.warns(fd.errors.FoldynWarning, match="panel 0: two edges get"):
        s = panel(RECTANGLE)
    scale = 0.01 / (2 * 0.9375)
    # edges 1, 3: |1 - 0.25 * 4| / 1 = 0: at nu W^2 = H^2 the formula leaves nothing
    assert area_of(s, 0, 1) == area_of(s, 2, 3) == 0.0
    assert area_of(s, 1, 2) == pytest.approx(scale * abs(4 - 0.25) / 2, rel=1e-14)
    assert area_of(s, 0, 3) == pytest.approx(0.01, rel=1e-14)
    for corner in range(4):
        assert area_of(s, 4, corner) == pytest.approx(scale * 0.25 * 5**1.5 / 2, rel=1e-14)
    diagonal = np.sqrt(5)
    kb = G * (diagonal / T) ** (1 / 3) / diagonal * (diagonal / 2)
    np.testing.assert_allclose(s.bend_stiffness, kb, rtol=1e-14)
    assert kb == pytest.approx(0.0444444 * 223.6068 ** (1 / 3), rel=1e-6)


def test_general_quad_takes_the_means_of_opposite_edges():
    vertices = np.array([[0, 0], [2, 0.2], [1.7, 1.1], [0.1, 0.9]])
    s = panel(vertices)
    l1, l2, l3, l4 = np.linalg.norm(np.roll(vertices, -1, 0) - vertices, axis=1)
    w, h = (l1 + l3) / 2, (l2 + l4) / 2
    scale = T / (2 * (1 - NU**2))
    assert area_of(s, 0, 1) == area_of(s, 2, 3)
    assert area_of(s, 0, 1) == pytest.approx(scale * abs(h**2 - NU * w**2) / h, rel=1e-13)
    assert area_of(s, 1, 2) == pytest.approx(scale * abs(w**2 - NU * h**2) / w, rel=1e-13)
    assert area_of(s, 2, 4) == pytest.approx(scale * NU * (h**2 + w**2) ** 1.5 / (h * w), rel=1e-13)
    spoke = np.linalg.norm(vertices - s.nodes[4, :2], axis=1)
    for k, row in enumerate(s.bends):
        corner = next(int(v) for v in row[:2] if v < 4)
        d = spoke[corner] + spoke[(corner + 2) % 4]
        kb = G * (d / T) ** (1 / 3) / d
        assert s.bend_stiffness[k] == pytest.approx(kb * spoke[corner], rel=1e-13)


def test_n4b5_rectangle():
    """One diagonal of sqrt(5); all five bars have 2 S t / ((1 - nu) sum L)."""
    s = panel(RECTANGLE, scheme="n4b5")
    assert s.bars.shape == (5, 2)
    d = np.sqrt(5)
    np.testing.assert_allclose(s.bar_area, 2 * 2.0 * T / (0.75 * (6 + d)), rtol=1e-14)
    np.testing.assert_allclose(s.bend_stiffness, [G * (d / T) ** (1 / 3)], rtol=1e-14)


def test_triangle():
    """3, 4, 5: S = 6, sum L = 12, A = 2*6*t/(0.75*12) = 4t/3, in both schemes."""
    for scheme in ("n5b8", "n4b5"):
        s = panel([[0, 0], [4, 0], [0, 3]], scheme=scheme)
        np.testing.assert_allclose(s.bar_area, 4 * T / 3, rtol=1e-14)
        assert len(s.bends) == len(s.bend_stiffness) == 0


@pytest.mark.parametrize("scheme", ["n5b8", "n4b5"])
def test_regular_hexagon(scheme):
    """S = 1.5 sqrt 3: six spokes of 1, D = 2, or three diagonals, never the long ones."""
    angle = np.arange(6) * np.pi / 3
    s = panel(np.c_[np.cos(angle), np.sin(angle)], scheme=scheme)
    length = np.linalg.norm(s.nodes[s.bends[:, 1]] - s.nodes[s.bends[:, 0]], axis=1)
    inner, diagonal = (1.0, 2.0) if scheme == "n5b8" else (np.sqrt(3), np.sqrt(3))
    np.testing.assert_allclose(length, [inner] * (6 if scheme == "n5b8" else 3), rtol=1e-13)
    area = 2 * 1.5 * np.sqrt(3) * T / (0.75 * (6 + length.sum()))
    np.testing.assert_allclose(s.bar_area, area, rtol=1e-13)
    stiffness = G * (diagonal / T) ** (1 / 3) / diagonal * inner
    np.testing.assert_allclose(s.bend_stiffness, stiffness, rtol=1e-13)


def test_polygon_bend_takes_the_most_anti_parallel_spoke():
    """A pentagon with a given center: the partner of each spoke found by hand (angles)."""
    angle = np.radians([0, 80, 130, 200, 300])
    radius = np.array([1.0, 1.3, 0.9, 1.1, 1.2])
    vertices = np.c_[radius * np.cos(angle), radius * np.sin(angle)]
    pattern = fd.Pattern(vertices, [[0, 1, 2, 3, 4]])
    s = discretize(pattern, SHEET, centers={0: [0.0, 0.0, 0.0]})
    partner = [3, 4, 4, 0, 2]  # 0-200 (160), 80-300 (140), 130-300 (170), 200-0, 300-130
    for k, row in enumerate(s.bends):
        corner = next(int(v) for v in row[:2] if v < 5)
        d = radius[corner] + radius[partner[corner]]
        expected = G * (d / T) ** (1 / 3) / d * radius[corner]
        assert s.bend_stiffness[k] == pytest.approx(expected, rel=1e-13)


def test_shared_bars_add_up():
    """A unit square beside another one or a triangle: the crease has both edges' area."""
    points, square = [[0, 0], [1, 0], [1, 1], [0, 1], [2, 0], [2, 1], [2, 0.5]], [0, 1, 2, 3]
    one = T / (2 * 0.9375) * 0.75
    triangle = 2 * 0.5 * T / (0.75 * (1 + 2 * np.sqrt(1.25)))
    for other, area in (([1, 4, 5, 2], one), ([1, 6, 2], triangle)):
        used = sorted({*square, *other})
        faces = [[used.index(k) for k in face] for face in (square, other)]
        s = discretize(fd.Pattern([points[k] for k in used], faces), SHEET)
        assert area_of(s, 1, 2) == pytest.approx(one + area, rel=1e-13)
        assert area_of(s, 0, 1) == pytest.approx(one, rel=1e-13)


def test_length_scale_ratio_softens_folds_only():
    pattern = fd.patterns.miura()
    soft = discretize(pattern, fd.Sheet(E, NU, T, length_scale_ratio=5.0))
    stiff = discretize(pattern, SHEET)
    assert (soft.fold_stiffness < 0.3 * stiff.fold_stiffness).all()
    np.testing.assert_array_equal(soft.bend_stiffness, stiff.bend_stiffness)
    np.testing.assert_array_equal(soft.bar_area, stiff.bar_area)


@pytest.mark.parametrize("nu", [0.0, -0.2])
def test_spokes_need_a_positive_poissons_ratio(nu):
    sheet, pentagon = fd.Sheet(E, nu, T), np.arange(5) * 2 * np.pi / 5
    with pytest.raises(InputError, match=r"poissons_ratio = .*n4b5"):
        panel(RECTANGLE, sheet=sheet)
    s = panel(RECTANGLE, sheet=sheet, scheme="n4b5")
    area = 2 * 2.0 * T / ((1 - nu) * (6 + np.sqrt(5)))
    np.testing.assert_allclose(s.bar_area, area, rtol=1e-14)
    discretize(fd.patterns.kresling(), sheet)  # triangles have no spokes
    assert (panel(np.c_[np.cos(pentagon), np.sin(pentagon)], sheet=sheet).bar_area > 0).all()


# ---------------------------------------------------------------------------- MERLIN2's order


def merlin2_by_the_book(pattern, faces):
    """Bend stiffness per (panel, corner vertex) and areas per panel edge, from trap 1.

    Written from the design's text for faces as listed (not as wound), standard values from a
    one-panel structure.
    """
    creases = {tuple(c) for c in pattern.creases.tolist()}
    bends, edges = {}, {}
    for p, face in enumerate(faces):
        m = len(face)
        single = panel(pattern.vertices[list(face)], scheme="n5b8")
        lengths = np.linalg.norm(single.nodes[:m] - single.nodes[m], axis=1)
        per_length = {}
        for row, k in zip(single.bends.tolist(), single.bend_stiffness, strict=True):
            per_length[min(row[:2])] = k / lengths[min(row[:2])]
        for i, vertex in enumerate(sorted(face)):  # the i-th smallest number
            bends[p, vertex] = per_length[i] * lengths[face.index(vertex)]
        listed = [tuple(sorted((face[k], face[(k + 1) % m]))) for k in range(m)]
        areas = [area_of(single, k, (k + 1) % m) for k in range(m)]
        if m == 4 and all(e in creases for e in listed):
            listed = sorted(listed)
        for edge, area in zip(listed, areas, strict=True):
            edges[edge] = edges.get(edge, 0.0) + area
    return bends, edges


def shuffled_sheet(seed):
    """A 4 x 3 sheet of irregular flat quads whose vertices are numbered at random and whose
    faces start anywhere and run either way; every quad inside has four folds. Some quads are
    replaced by a pair that forms a hexagon.
    """
    rng = np.random.default_rng(seed)
    nx, ny = 5, 4
    grid = np.array([[i, j] for i in range(nx) for j in range(ny)], float)
    grid += rng.uniform(-0.2, 0.2, grid.shape)
    number = rng.permutation(nx * ny)
    vertices = np.zeros((nx * ny, 3))
    vertices[number, :2] = grid
    faces = []
    for i, j in itertools.product(range(nx - 1), range(ny - 1)):
        if (i, j) == (0, 0):
            corners = [(0, 0), (1, 0), (2, 0), (2, 1), (1, 1), (0, 1)]
        elif (i, j) == (1, 0):
            continue
        else:
            corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
        face = [int(number[a * ny + b]) for a, b in corners]
        turn = int(rng.integers(len(face)))
        face = face[turn:] + face[:turn]
        faces.append(face[::-1] if rng.random() < 0.5 and faces else face)
    return vertices, faces


@pytest.mark.parametrize("seed", range(6))
def test_merlin2_order_on_shuffled_sheets(seed):
    vertices, faces = shuffled_sheet(seed)
    pattern = fd.Pattern(vertices, faces)
    assert any(pattern.flipped)
    bends, edges = merlin2_by_the_book(pattern, faces)
    s = discretize(pattern, SHEET, calibration="merlin2")
    panel_of = {int(c): p for p, c in enumerate(s.centers)}
    n = len(vertices)
    for row, k in zip(s.bends.tolist(), s.bend_stiffness, strict=True):
        center, corner = sorted(row[:2], reverse=True)
        assert center >= n
        assert k == pytest.approx(bends[panel_of[center], corner], rel=1e-12)
    for edge, area in edges.items():
        assert area_of(s, *edge) == pytest.approx(area, rel=1e-12)
