"""Panels that pass through each other, told from panels that touch."""

from __future__ import annotations

import numpy as np
import pytest

from foldyn.mechanics.crossings import crossing_panels

FLOOR = [(0, 0, 0), (4, 0, 0), (0, 4, 0)]


def crosses(*corners) -> bool:
    """Whether a triangle crosses the floor, in either order."""
    points = np.array([*FLOOR, *corners], float)
    triangles = np.array([(0, 1, 2), (3, 4, 5)])
    found = [crossing_panels(points, t, np.array([7, 3])) for t in (triangles, triangles[::-1])]
    for pairs in found:
        assert pairs.tolist() in ([], [[3, 7]])
    assert len(found[0]) == len(found[1])
    return bool(len(found[0]))


@pytest.mark.parametrize(
    ("corners", "expected"),
    [
        ([(1, 1, -1), (1, 1, 1), (9, 9, 0.5)], True),  # a side pierces the floor
        ([(-1, 1, -1), (-1, 1, 1), (9, 1, 0.1)], True),  # it is pierced by sides of the floor
        ([(1, 1, 0), (1, 2, 1), (2, 1, 1)], False),  # a corner stands on it
        ([(1, 1, 0), (2, 1, 0), (1, 1, 1)], False),  # a side lies on it
        ([(1, 1, 0), (2, 1, 0), (1, 2, 0)], False),  # a layer upon it
        ([(1, 1, 1e-3), (2, 1, 1e-3), (1, 2, 1e-3)], False),  # a layer above it
        ([(3, 3, -1), (3, 3, 1), (9, 9, 0.5)], False),  # beside it
        ([(4, 0, 0), (4, 0, 3), (0, 4, 3)], False),  # at its corner
    ],
)
def test_crossings_of_two_triangles(corners, expected):
    assert crosses(*corners) is expected
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    points = (np.array([*FLOOR, *corners], float) @ turn) * 1e-3 + 5.0  # elsewhere, in millimeters
    pairs = crossing_panels(points, np.array([(0, 1, 2), (3, 4, 5)]), np.array([0, 1]))
    assert bool(len(pairs)) is expected


def test_neighbors_may_cross_only_beyond_what_they_share():
    points = np.array([*FLOOR, (2, 1, -1), (1, 2, 1), (0, 0, 3)], float)
    panels = np.array([0, 1])
    hinged = np.array([(0, 1, 2), (0, 1, 5)])
    assert not len(crossing_panels(points, hinged, panels))  # at a crease
    pierced = np.array([(0, 1, 2), (0, 3, 4)])  # share a corner, and cross
    assert crossing_panels(points, pierced, panels).tolist() == [[0, 1]]
    assert not len(crossing_panels(points, pierced, np.array([4, 4])))  # pieces of one panel


def test_panels_cross_along_sides_of_their_triangles():
    # each touches the other with sides only, along the line y = 0, z = 0: two planes that cross
    # there, and two roofs, one standing on the ridge of the other
    line = [(0, 0, 0), (1, 0, 0), (0.2, 0, 0), (1.2, 0, 0)]
    left_up, right_down = (0.5, -1, 1), (0.5, 1, -1)
    left_down, right_up = (0.5, -1, -1), (0.5, 1, 1)
    triangles = np.array([(0, 1, 4), (1, 0, 5), (2, 3, 6), (3, 2, 7)])
    panels = np.array([0, 0, 1, 1])
    planes = np.array([*line, left_up, right_down, left_down, right_up])
    assert crossing_panels(planes, triangles, panels).tolist() == [[0, 1]]
    roofs = np.array([*line, left_down, right_down, left_up, right_up])
    assert not len(crossing_panels(roofs, triangles, panels))


def test_boxes_of_all_sizes_are_compared():
    # upright triangles that stand apart but for the last two, which cross, upon a wide floor
    points = [(k, y, z) for k in range(60) for y, z in ((0, 0), (1, 0), (0, 1))]
    points += [(58.5, 0.2, 0.2), (59.5, 0.2, 0.2), (59.0, 0.2, 2.0)]
    points += [(-1e3, -1e3, 0.0), (1e3, -1e3, 0.0), (0.0, 1e3, 0.0)]
    triangles = np.arange(62 * 3).reshape(62, 3)
    pairs = crossing_panels(np.array(points, float), triangles, np.arange(62))
    assert pairs.tolist() == [[59, 60]]


def test_nothing_and_triangles_without_area_cross_nothing():
    none = np.zeros((0, 3), np.int64)
    assert not len(crossing_panels(np.zeros((0, 3)), none, none[:, 0]))
    points = np.array([*FLOOR, (1, 1, -1), (1, 1, 1), (1, 1, 1)], float)
    assert not len(crossing_panels(points, np.array([(0, 1, 2), (3, 4, 5)]), np.array([0, 1])))


@pytest.mark.matrix
@pytest.mark.parametrize("count", [2, 60])
def test_crossings_are_those_of_an_independent_library(count):
    """`has_intersections` of the IPC Toolkit (Ferguson et al., https://ipctk.xyz), by sides."""
    ipctk = pytest.importorskip("ipctk")
    rng = np.random.default_rng(count)
    seen = []
    for _ in range(400):
        # half of the triangles have a first corner that is one of few
        shared = rng.random((1 + count // 8, 3))
        center = rng.random((count, 1, 3))
        own = center + rng.normal(size=(count, 3, 3)) * 0.8 / count
        triangles = len(shared) + np.arange(3 * count).reshape(-1, 3)
        some = rng.random(count) < 0.5
        triangles[some, 0] = rng.integers(len(shared), size=some.sum())
        points = np.concatenate([shared, own.reshape(-1, 3)])
        ours = crossing_panels(points, triangles, np.arange(count))
        mesh = ipctk.CollisionMesh(points, ipctk.edges(triangles), triangles)
        seen.append(ipctk.has_intersections(mesh, points))
        assert bool(len(ours)) == seen[-1]
    assert 0.05 < np.mean(seen) < 0.95
