"""What panels hide: the same as a test of every point against every triangle, but quick."""

from __future__ import annotations

import numpy as np
import pytest

from foldyn import patterns
from foldyn.plots import sheet as drawn_sheet
from foldyn.plots.scene import Sheet3D, View, pieces
from foldyn.plots.sheet import hidden_points

PATTERNS = {
    "fold": patterns.simple_fold(dihedral=60),
    "miura": patterns.miura(cells=(5, 4), dihedral=70),
    "flat": patterns.miura(cells=(2, 2), dihedral=180),
    "tower": patterns.kresling(sides=6, radius=1.0, height=0.9, twist=30, storeys=2),
}
VIEWS = [(28.0, -60.0), (0.0, 0.0), (90.0, -90.0), (-20.0, 135.0)]


def ray_meets(point, corners, toward, size):
    """Whether the ray from a point to the eye meets any of the triangles (t, 3, 3)."""
    a, b, c = corners.transpose(1, 0, 2)
    columns = np.stack([b - a, c - a, np.broadcast_to(-toward, a.shape)], axis=-1)
    columns = columns[np.abs(np.linalg.det(columns)) > 1e-9 * size**2]
    chosen = a[np.abs(np.einsum("ti,i->t", np.cross(b - a, c - a), toward)) > 1e-9 * size**2]
    s, t, way = np.linalg.solve(columns, (point - chosen)[..., None])[..., 0].T
    inside = (s > 1e-9) & (t > 1e-9) & (s + t < 1.0 - 1e-9)
    return bool((inside & (way > 1e-3 * size)).any())


@pytest.mark.parametrize("name", PATTERNS)
@pytest.mark.parametrize("angles", VIEWS)
def test_what_is_hidden_is_what_a_ray_meets(name, angles):
    sheet, view = Sheet3D.of(PATTERNS[name]), View(*angles)
    random = np.random.default_rng(3)
    vertices = sheet.nodes + 0.05 * random.standard_normal(sheet.nodes.shape)
    inside = pieces(vertices, sheet.triangles).mean(axis=1)
    points = np.concatenate(
        [
            random.choice(inside, 60),
            vertices.mean(axis=0) + 0.3 * sheet.size * random.standard_normal((60, 3)),
        ]
    )
    found = hidden_points(points, vertices, sheet.triangles, view, sheet.size)
    corners = vertices[sheet.triangles]
    expected = [ray_meets(point, corners, view.basis[2], sheet.size) for point in points]
    np.testing.assert_array_equal(found, expected)
    assert 0 < found.sum() < len(points)


def test_little_memory_gives_the_same(monkeypatch):
    sheet, view = Sheet3D.of(PATTERNS["miura"]), View()
    points = pieces(sheet.nodes, sheet.triangles).mean(axis=1)
    at_once = hidden_points(points, sheet.nodes, sheet.triangles, view, sheet.size)
    monkeypatch.setattr(drawn_sheet, "_CHUNK", 7)
    by_and_by = hidden_points(points, sheet.nodes, sheet.triangles, view, sheet.size)
    np.testing.assert_array_equal(at_once, by_and_by)


def test_no_points_and_triangles_seen_edge_on():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 1.0], [0, 0, 1]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    points = np.array([[0.5, 1.0, 0.3], [0.5, -1.0, 0.3]])
    from_above = hidden_points(points, square, triangles, View(90.0, -90.0), 1.0)
    np.testing.assert_array_equal(from_above, [False, False])
    in_front = hidden_points(points, square, triangles, View(0.0, -90.0), 1.0)
    np.testing.assert_array_equal(in_front, [True, False])
    assert not len(hidden_points(points[:0], square, triangles, View(), 1.0))


def test_the_pairs_tested_grow_like_the_triangles():
    """Of a sheet twice as long in both directions about four times, not sixteen times as many."""
    counts = []
    for cells in (8, 16):
        sheet, view = Sheet3D.of(patterns.miura(cells=(cells, cells))), View()
        seen = sheet.nodes @ view.basis.T
        corners = seen[sheet.triangles].transpose(1, 0, 2)[..., :2]
        points = corners.mean(axis=0)
        counts.append(sum(len(pair[0]) for pair in drawn_sheet._near_pairs(points, corners)))
    assert counts[1] < 5.0 * counts[0]
