"""Cameras: projection, distortion, the way back, scales, and what is seen of what comes nearer."""

from __future__ import annotations

import numpy as np
import pytest
from miura_film import DISTANCE, SCALE, camera, cv2, moving_states
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from foldyn.errors import InputError
from foldyn.experiment import Camera, Scale, Sight, scale_of_lengths, scale_of_target
from foldyn.experiment.camera import axes_of_view
from foldyn.experiment.tracking.view import View

POINTS = moving_states(70.0)[0]


def rays(one: Camera, uv: NDArray) -> NDArray:
    """Slopes (x, y)/z of the rays through pixels (..., 2), by inverting the distortion."""
    seen = (uv - one.center) / one.focal
    slope = seen
    for _ in range(20):  # Newton's method for the radius
        s2 = np.sum(slope**2, axis=-1, keepdims=True)
        factor = 1.0 + one.k1 * s2 + one.k2 * s2**2
        slope = slope - (slope * factor - seen) / (1.0 + 3.0 * one.k1 * s2 + 5.0 * one.k2 * s2**2)
    return slope


def on_plane(one: Camera, uv: NDArray, depth: NDArray | float) -> NDArray:
    """Points (..., 3) in m seen at pixels (..., 2), at depths (m) in front of the camera."""
    slope = rays(one, uv)
    z = np.broadcast_to(depth, slope.shape[:-1])[..., np.newaxis]
    return one.position + np.concatenate([slope * z, z], axis=-1) @ one.rotation


def test_the_target_is_in_the_middle_at_its_scale():
    one = Camera.looking_at([0.1, 0.2, 0.3], 0.5, metres_per_pixel=1e-4, size=(400, 300))
    np.testing.assert_allclose(one.project([0.1, 0.2, 0.3]), [199.5, 149.5])
    # up = -x: x runs down; seen from +z, y runs to the right
    np.testing.assert_allclose(one.project([0.101, 0.2, 0.3]), [199.5, 159.5])
    np.testing.assert_allclose(one.project([0.1, 0.201, 0.3]), [209.5, 149.5])
    assert one.depth([0.1, 0.2, 0.3]) == pytest.approx(0.5)


@pytest.mark.parametrize("up", ["x", "-x", "y", "-y"])
@pytest.mark.parametrize("facing", ["z", "-z"])
def test_axes_of_a_view_are_right_handed(up, facing):
    axes = axes_of_view(up, facing)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)


def test_distortion_is_browns():
    straight, bent = camera(k1=0.0), camera(k1=0.05)
    slope = straight.straight(POINTS)
    r2 = (slope**2).sum(axis=1, keepdims=True)
    expected = straight.center + (straight.project(POINTS) - straight.center) * (1 + 0.05 * r2)
    np.testing.assert_allclose(bent.project(POINTS), expected, rtol=1e-12)


@pytest.mark.parametrize(("k1", "k2"), [(0.0, 0.0), (0.05, -0.02), (-0.1, 0.03)])
def test_rays_go_back_to_where_they_came_from(k1, k2):
    one = Camera.looking_at(
        POINTS.mean(axis=0), 0.2, metres_per_pixel=SCALE, size=(580, 620), k1=k1, k2=k2
    )
    back = on_plane(one, one.project(POINTS), one.depth(POINTS))
    np.testing.assert_allclose(back, POINTS, atol=1e-12)
    # the polynomial of the renderer alone, over the whole picture
    u, v = np.meshgrid(np.linspace(0, 579, 9), np.linspace(0, 619, 9))
    seen = (np.stack([u, v], axis=-1) - one.center) / one.focal
    r2 = (seen**2).sum(axis=-1, keepdims=True)
    quick = seen * np.polynomial.polynomial.polyval(r2, one.inverse)
    assert np.abs(quick - rays(one, np.stack([u, v], axis=-1))).max() * one.focal < 1e-3


def test_the_fitted_view_and_the_camera_agree():
    one = camera(k1=0.0)
    origin = on_plane(one, one.center, DISTANCE)
    view = View(one.rotation, origin, one.center, SCALE, DISTANCE, one.center)
    np.testing.assert_allclose(view.project(POINTS), one.project(POINTS), atol=1e-9)
    np.testing.assert_allclose(
        view.back(view.project(POINTS), view.depth(POINTS)), POINTS, atol=1e-12
    )


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"up": "z"}, "same axis"),
        ({"up": "upwards"}, "choose one of"),
        ({"distance": 0.0}, "distance"),
        ({"metres_per_pixel": -1.0}, "metres_per_pixel"),
        ({"k1": -2000.0}, "fold the image back"),
    ],
)
def test_cameras_that_cannot_be(options, match):
    given = {"target": [0, 0, 0], "distance": 0.5, "metres_per_pixel": 1e-4, "size": (400, 300)}
    with pytest.raises(InputError, match=match):
        Camera.looking_at(**(given | options))


def test_scale_of_two_lengths():
    scale = scale_of_lengths([(0, 0, 300, 400, 0.05), (0, 0, 0, 100, 0.0101)])
    assert scale.metres_per_pixel == pytest.approx(1.005e-4)
    assert scale.spread == pytest.approx(0.005 / 1.005, rel=1e-3)


@pytest.mark.parametrize(
    "lengths",
    [[], [(5, 5, 5, 5, 0.1)], [(0, 0, 9, 0, 0.0)], [(0, 0, 9, 0, 0.1), (0, 0, 0, 9, 0.2)]],
)
def test_lengths_that_give_no_scale(lengths):
    with pytest.raises(InputError, match="--reference"):
        scale_of_lengths(lengths)


@pytest.mark.parametrize("value", [0.0, -1e-4, np.nan, np.inf])
def test_a_scale_is_positive(value):
    with pytest.raises(InputError, match="--scale"):
        Scale(value)


def test_scale_of_a_chessboard():
    square = 30  # pixels
    board = np.kron((np.indices((6, 8)).sum(axis=0) % 2) * 200 + 25, np.ones((square, square)))
    photo = np.full((400, 500), 225, np.uint8)
    photo[60:240, 70:310] = board
    photo = cv2.GaussianBlur(photo, (0, 0), 0.8)
    scale = scale_of_target(photo, 7, rows=5, square=0.003)
    assert scale.metres_per_pixel == pytest.approx(1e-4, rel=1e-3)
    assert scale.spread < 0.01
    with pytest.raises(InputError, match="no chessboard"):
        scale_of_target(np.full((400, 500), 128, np.uint8), 7, rows=5, square=0.003)


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
