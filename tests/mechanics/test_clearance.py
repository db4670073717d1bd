"""How far panels are apart that share no vertex."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import foldyn as fd
from foldyn.mechanics.contact.clearance import clearance

SQUARE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
PANELS = np.array([0, 0, 1, 1])


def of_squares(other) -> float:
    points = np.vstack([SQUARE, other])
    found = clearance(points, TRIANGLES, PANELS)
    vectors = np.einsum("kn,kna->ka", found.weights, points[found.nodes])
    assert len(vectors)
    assert np.linalg.norm(vectors, axis=1) == pytest.approx(found.distance, rel=1e-8)
    return found.distance


UPRIGHT = SQUARE[:, [0, 2, 1]]


@pytest.mark.parametrize(
    ("other", "shift", "distance"),
    [
        (SQUARE, (0.2, 0.3, 0.4), 0.4),  # faces
        (SQUARE, (1.3, 1.4, 0.0), 0.5),  # corners
        (SQUARE, (2.0, 0.2, 0.0), 1.0),  # sides
        (UPRIGHT, (0.3, 0.4, 0.2), 0.2),  # a side above a face
        (2.0 * SQUARE, (-0.5, -0.5, 0.1), 0.1),  # a face below a larger one
    ],
)
def test_two_squares(other, shift, distance):
    assert of_squares(other + np.array(shift)) == pytest.approx(distance, rel=1e-12)


def test_all_points_that_are_closest_are_told():
    """Of a tilted square the two corners of its lower side; turned a little one of them alone."""
    tilted = SQUARE * [0.6, 0.6, 0.0] + [0.2, 0.2, 0.3] + SQUARE[:, [2, 2, 1]]
    assert of_squares(tilted) == pytest.approx(0.3)
    found = clearance(np.vstack([SQUARE, tilted]), TRIANGLES, PANELS)
    assert {4, 5} <= set(found.nodes[np.abs(found.weights) == 1.0].tolist())
    tilted[1, 2] += 1e-3
    found = clearance(np.vstack([SQUARE, tilted]), TRIANGLES, PANELS)
    assert {*found.nodes[found.weights == 1.0].tolist()} == {4}


def test_panels_that_cross_have_none():
    found = clearance(np.vstack([SQUARE, UPRIGHT + np.array([0.3, 0.4, -0.5])]), TRIANGLES, PANELS)
    assert found.distance == 0.0


def test_panels_that_all_meet_have_no_end_of_it():
    made = fd.discretize(fd.patterns.miura(), fd.Sheet(1e6, 0.25, 0.01), preset="plate")
    assert clearance(made.nodes, made.triangles, made.triangle_panel).distance == np.inf


@pytest.mark.matrix
def test_a_folded_sheet_beside_points_all_over_its_panels():
    """The least distance of points on a fine grid is above by less than its spacing squared."""
    pattern = fd.patterns.miura((2, 2), panel_angle=70.0, dihedral=37.0)
    made = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01), preset="plate")
    turn = Rotation.random(random_state=3).as_matrix()
    found = clearance(made.nodes @ turn.T + 5.0, made.triangles, made.triangle_panel)
    share = np.linspace(0.0, 1.0, 21)
    s, t = np.meshgrid(share, share)
    corners = made.nodes[np.array(pattern.faces)]
    weights = np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t], axis=-1)
    dense = np.einsum("abk,pki->pabi", weights, corners).reshape(len(corners), -1, 3)
    least = min(
        np.linalg.norm(dense[i][:, None] - dense[j][None], axis=2).min()
        for i, one in enumerate(pattern.faces) for j, other in enumerate(pattern.faces[:i])
        if not set(one) & set(other)
    )  # fmt: skip
    assert found.distance <= least + 1e-12
    assert found.distance == pytest.approx(least, rel=0.01)
