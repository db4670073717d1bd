"""Photographs under a sheet: the camera from points and pixels, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from page_samples import camera

from foldyn.errors import InputError
from foldyn.experiment.tracking.view import View
from foldyn.viewer import Backdrop, projection

POINTS = np.random.default_rng(2).uniform(0.0, 1.0, (12, 3))
PNG = b"\x89PNG\r\n"


def seen(matrix, points):
    whole = np.column_stack([points, np.ones(len(points))]) @ np.asarray(matrix).T
    return whole[:, :2] / whole[:, 2:]


@pytest.mark.parametrize("distance", [0.5, 3.0, np.inf])
def test_the_camera_of_a_tracked_film_comes_back(distance):
    at, center = np.array([310.0, 200.0]), np.array([320.0, 240.0])
    view = View(camera().rotation, np.full(3, 0.5), at, 2e-3, distance, center)
    others = np.random.default_rng(3).uniform(0.0, 1.0, (5, 3))
    matrix = projection(POINTS, view.project(POINTS))
    assert np.abs(seen(matrix, others) - view.project(others)).max() < 1e-6


def test_of_pixels_with_errors_the_nearest_camera_is_taken():
    pixels = camera().project(POINTS)
    off = pixels + np.random.default_rng(4).normal(scale=0.3, size=pixels.shape)
    assert np.abs(seen(projection(POINTS, off), POINTS) - pixels).max() < 2.0


def test_points_that_leave_the_camera_open_are_refused():
    flat = POINTS * [1.0, 1.0, 0.0]
    with pytest.raises(InputError, match="in a plane"):
        projection(flat, camera().project(flat))
    with pytest.raises(InputError, match="six or more points"):
        projection(POINTS[:5], camera().project(POINTS[:5]))


@pytest.mark.parametrize(
    ("pictures", "columns", "message"),
    [
        ({0.0: b"GIF89a"}, 4, "neither JPEG nor PNG"),
        ({}, 4, "none; give at least one photograph"),
        ({0.0: PNG}, 3, r"of shape \(3, 3\)"),
    ],
)
def test_other_pictures_and_matrices_are_refused(pictures, columns, message):
    with pytest.raises(InputError, match=message):
        Backdrop(pictures, (8, 8), np.eye(3, columns))


def test_pictures_come_in_the_order_of_their_moments():
    about = Backdrop({2.0: PNG, 0.5: PNG}, (8, 8), np.eye(3, 4)).about()
    assert [moment for moment, _ in about["pictures"]] == [0.5, 2.0]
    assert all(uri.startswith("data:image/png;base64,") for _, uri in about["pictures"])
