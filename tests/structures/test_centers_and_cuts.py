"""Where panels get their center nodes, and how they are cut without them."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.structures.mesh import polygon_center, quad_centers
from named_models import named

SHEET = fd.Sheet(1e6, 0.25, 0.01, density=1000.0)
DART = [[0, 0], [2, -1], [0.6, 0], [2, 1]]  # reflex at 2
L_SHAPE = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]
SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1]]


def one(vertices, **options):
    pattern = fd.Pattern(vertices, [list(range(len(vertices)))])
    return fd.discretize(pattern, SHEET, **named(options))


def regular(m):
    angle = np.arange(m) * 2 * np.pi / m
    return np.c_[np.cos(angle), np.sin(angle)]


def test_center_of_a_flat_quad_is_where_diagonals_cross():
    """(0,0), (4,0), (3,3), (0,2): diagonals y = x and x + 2y = 4."""
    s = one([[0, 0], [4, 0], [3, 3], [0, 2]])
    np.testing.assert_allclose(s.nodes[4], [4 / 3, 4 / 3, 0], atol=1e-15)


def test_center_of_a_quad_that_is_not_flat_lies_on_the_shorter_diagonal():
    """Of equal ones on that through corners 2 and 4, from 1; also where they differ by rounding."""
    # diagonal 0-2 along x at z = 0, longer; diagonal 1-3 along y at z = 0.1
    x = np.array([[[-2.0, 0, 0], [0.1, -1, 0.1], [2, 0, 0], [0.1, 1, 0.1]]])
    equal = np.array([[[-1.0, 0, 0], [0, -1, 0.1], [1, 0, 0], [0, 1, 0.1]]])
    nearly = equal - [[[0, 0, 0], [0, 0, 0], [1e-15, 0, 0], [0, 0, 0]]]
    for corners, center in (
        (x, [0.1, 0, 0.1]), (np.roll(x, 1, axis=1), [0.1, 0, 0.1]), (equal, [0, 0, 0.1]),
        (np.roll(equal, 1, axis=1), [0, 0, 0]), (nearly, [0, 0, 0.1]),
    ):  # fmt: skip
        np.testing.assert_allclose(quad_centers(corners), [center], atol=1e-15)


def test_quad_that_is_not_flat_is_discretized():
    s = one([[0, 0, 0], [1, 0, 0.1], [1, 1, 0], [0, 1, 0.1]])
    assert np.abs(s.bend_rest - np.pi).max() > 0.01
    assert np.abs(s.internal_force(np.zeros_like(s.nodes))).max() < 1e-9


def objective(x, points):
    """Sum of |(xj - c) x (xi - c)| / Lij^2 over diagonals, as MERLIN2 minimizes it."""
    total, m = np.zeros(len(points)), len(x)
    for i, j in combinations(range(m), 2):
        if j - i not in (1, m - 1):
            cross = np.linalg.norm(np.cross(x[j] - points, x[i] - points), axis=1)
            total += cross / np.sum((x[j] - x[i]) ** 2)
    return total


@pytest.mark.parametrize("m", [5, 6, 7, 8])
def test_center_of_a_regular_polygon(m):
    """On a pentagon every point of the inner one is a minimizer: the middle is taken."""
    x = np.c_[regular(m), np.zeros(m)] * 2.5 + [3.0, -1.0, 2.0]
    np.testing.assert_allclose(polygon_center(x), [3.0, -1.0, 2.0], atol=1e-12)


@pytest.mark.parametrize("seed", range(8))
def test_center_of_a_polygon_is_optimal(seed):
    rng = np.random.default_rng(seed)
    m = 5 + seed % 3
    angle = np.sort(rng.uniform(0, 2 * np.pi, m))
    flat = np.c_[2 * np.cos(angle), np.sin(angle), np.zeros(m)]  # on an ellipse: convex
    q = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    x = flat @ q.T + rng.uniform(-1, 1, 3)
    center = polygon_center(x)
    assert abs((center - x[0]) @ q[:, 2]) < 1e-12  # in its plane
    best = objective(x, center[None])[0]
    for size in (1e-6, 1e-3, 0.1, 1.0):
        around = center + size * (rng.standard_normal((300, 2)) @ q[:, :2].T)
        assert objective(x, around).min() > best - 1e-12
    np.testing.assert_allclose(polygon_center(x * 1e-3), center * 1e-3, atol=1e-12)
    np.testing.assert_allclose(polygon_center(np.roll(x, 2, axis=0)), center, atol=1e-9)


# ---------------------------------------------------------------------------- cuts


def diagonals(s):
    return sorted(tuple(sorted(row)) for row in s.bends[:, :2].tolist())


@pytest.mark.parametrize(
    ("vertices", "cut"),
    [
        ([[0, 0], [1, 0], [1.5, 1], [0.5, 1]], (1, 3)),
        ([[0, 0], [1, 0], [0.5, 1], [-0.5, 1]], (0, 2)),
        (SQUARE, (0, 2)),  # tie: corners 1, 3 from 1
        ([[0, 0], [1, 0], [1 + 1e-15, 1], [0, 1]], (0, 2)),
        # through a reflex corner, also where the diagonal outside the panel is the shorter one
        *((np.roll(DART, turn, axis=0), (turn % 2, turn % 2 + 2)) for turn in range(4)),
        ([[0, 0], [2, -0.2], [1.7, 0], [2, 0.2]], (0, 2)),
    ],
)
def test_n4b5_cuts_the_shorter_diagonal_inside(vertices, cut):
    assert diagonals(one(vertices, scheme="n4b5")) == [cut]


def test_l_shape_is_cut_inside():
    s = one(L_SHAPE, scheme="n4b5")
    assert (len(s.triangles), len(s.bends)) == (4, 3)
    a, b, c = (s.nodes[s.triangles[:, k]] for k in range(3))
    areas = np.cross(b - a, c - a)[:, 2] / 2
    assert (areas > 0).all() and areas.sum() == pytest.approx(3.0, rel=1e-14)
    middles = np.array([s.nodes[list(pair)].mean(axis=0) for pair in diagonals(s)])
    assert (middles[:, :2].min(axis=1) <= 1.0).all()  # the notch
    np.testing.assert_allclose(s.bend_rest, np.pi, atol=1e-14)
    assert (0, 3) in diagonals(s)  # the shortest of all: sqrt 2


def test_n5b8_needs_a_center_that_sees_every_edge():
    for shape, options in ((L_SHAPE, {}), (SQUARE, {"centers": {0: [2.0, 0.5, 0]}}), (DART, {})):
        with pytest.raises(InputError, match=r"panel 0 .*cannot see every edge.*fd\.convex"):
            one(shape, **options)
    s = one(L_SHAPE, centers={0: [0.5, 0.5, 0]})
    assert len(s.triangles) == 6
    assert s.surface.triangle_area.sum() == pytest.approx(3.0, rel=1e-14)


def test_n4b5_with_a_diagonal_that_is_an_edge_elsewhere():
    """A pocket: a bent quad closed behind by two triangles whose crease is the quad's diagonal."""
    vertices = [[0, 0, 0], [1, 0, 0.3], [1, 1, 0], [0, 1, 0.3]]
    pattern = fd.Pattern(vertices, [[0, 1, 2, 3], [0, 2, 1], [0, 3, 2]])
    s = fd.discretize(pattern, SHEET, scheme="n4b5", crease_rest=180)
    assert diagonals(s) == [(0, 2)]
    assert sorted(s.triangle_panel.tolist()) == [0, 0, 1, 2]
    assert set(s.bends[0, 2:].tolist()) == {1, 3}
    (crease,) = (row for row in s.folds.tolist() if sorted(row[:2]) == [0, 2])
    j, k, i, l = crease  # noqa: E741
    # the face of wing i (1 or 2, never the quad) runs j to k
    for wing, (start, end) in ((i, (j, k)), (l, (k, j))):
        face = next(f for f in pattern.faces[1:] if wing in f)
        assert face[(face.index(start) + 1) % 3] == end


def test_pattern_of_many_kinds_of_panels():
    """Triangle, quad and hexagon together: centers in panel order, bars in order of kinds."""
    hexagon = np.c_[regular(6), np.zeros(6)]
    vertices = np.vstack([hexagon, [[1.8, 1.0, 0], [-1.5, -1.8, 0], [-0.5, -2.0, 0]]])
    pattern = fd.Pattern(vertices, [[1, 0, 6], [0, 1, 2, 3, 4, 5], [4, 3, 7, 8]])
    s = fd.discretize(pattern, SHEET, preset="plate")
    assert s.centers.tolist() == [-1, 9, 10]
    assert [s.triangle_panel.tolist().count(p) for p in range(3)] == [1, 6, 4]
    kinds = np.sort(s.bars, axis=1).tolist()
    assert kinds[10:12] == pattern.creases.tolist()
    assert kinds[12:] == pattern.boundary.tolist()


@pytest.mark.filterwarnings("ignore:vertices. the boundary edges")
def test_a_panel_too_narrow_for_its_center_is_refused():
    """Rounding hides where diagonals cross that are parallel to 1e-9; near that, it does not."""
    for length in (1.0, 1e4):
        center = fd.discretize(fd.patterns.simple_fold(a=length), SHEET, preset="plate").nodes[6]
        np.testing.assert_allclose(center, [length / 4, 0.5, length * 0.75**0.5 / 2], rtol=1e-6)
    with pytest.raises(InputError, match=r'^panel 0: is so narrow .* scheme = "n4b5"'):
        fd.discretize(fd.patterns.simple_fold(a=2.0**31), SHEET, preset="plate")
