"""Panels that pass through each other, told from panels that touch."""

from __future__ import annotations

import numpy as np
import pytest

from foldyn.patterns.crossings import crossing_panels

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


def test_many_triangles_are_compared_in_blocks(monkeypatch):
    monkeypatch.setattr("foldyn.patterns.crossings.BLOCK", 2)
    # upright triangles that stand apart but for the last two, which cross
    points = [(k, y, z) for k in range(6) for y, z in ((0, 0), (1, 0), (0, 1))]
    points += [(4.5, 0.2, 0.2), (5.5, 0.2, 0.2), (5.0, 0.2, 2.0)]
    triangles = np.arange(21).reshape(7, 3)
    pairs = crossing_panels(np.array(points, float), triangles, np.arange(7))
    assert pairs.tolist() == [[5, 6]]
