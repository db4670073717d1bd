"""What a camera sees of nodes that come nearer: the way back from pixels, without the pixels."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from foldyn.experiment import Sight
from foldyn.experiment.camera import axes_of_view
from foldyn.experiment.tracking.view import View

NODES = np.array([0, 3, 4])


def view(distance: float) -> View:
    """A camera that is a little turned, whose axis is not in the middle."""
    turned = Rotation.from_rotvec([0.03, -0.05, 0.02]).as_matrix() @ axes_of_view()
    origin, center, axis = np.array([0.01, 0.02, 0.03]), np.array([300.0, 410.0]), np.zeros(2)
    return View(turned, origin, center, 1e-4, distance, axis)


def sight(one: View, rest: np.ndarray) -> Sight:
    camera = one.camera()
    return Sight(camera, one.rotation[2], one.depth(rest) - one.depth(camera))


@pytest.mark.parametrize(("distance", "slack"), [(0.4, 1e-15), (np.inf, 1e-7)])
def test_it_is_the_way_from_pixels_to_the_plane_of_the_node(distance, slack) -> None:
    """To rounding; 1e-7 m where an infinite distance is one of 10 km."""
    random = np.random.default_rng(4)
    rest = random.uniform(-0.05, 0.05, (5, 3))
    moved = random.uniform(-4e-3, 4e-3, (7, 3, 3))
    one = view(distance)
    pixels = one.project(rest[NODES] + moved)
    tracked = one.back(pixels, one.depth(rest)[NODES]) - rest[NODES]
    seen = sight(one, rest).seen(NODES, rest[NODES], moved)
    assert np.abs(seen - tracked).max() < slack + 1e-15
    assert np.abs(seen - moved).max() > 1e-4  # of what moves along the line of sight


def test_what_stays_in_its_plane_is_seen_as_it_moves() -> None:
    rest = np.random.default_rng(5).uniform(-0.05, 0.05, (5, 3))
    one = view(0.4)
    across = 3e-3 * one.rotation[0]
    moved = np.broadcast_to(across, (2, 3, 3))
    assert np.abs(sight(one, rest).seen(NODES, rest[NODES], moved) - moved).max() < 1e-16
