"""Tracking of synthetic films against the motion that they show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from miura_film import DISTANCE, FRONT, RATE, SCALE, errors, make_film, model

import foldyn as fd
from foldyn.experiment import Placing, Tracking, open_film, track_film, write_film
from foldyn.experiment.tracking.corners import find_corners
from foldyn.experiment.tracking.follow import follow


@pytest.mark.matrix
def test_nodes_keep_their_identity_and_their_place(sharp, tracked):
    error = errors(tracked, sharp.truth)[:, FRONT]
    known = np.isfinite(error)
    assert known.mean() > 0.8
    # 0.16 mm per pixel, twice as coarse as the film of the benchmark
    assert np.sqrt(np.mean(error[known] ** 2)) < 0.25
    assert error[known].max() < 2.0  # the nearest other node is 35 pixels away


@pytest.mark.matrix
def test_standard_errors_are_of_the_size_of_the_errors(sharp, tracked):
    point = tracked["node_of_point"].values
    told = np.full((80, 25), np.nan)
    told[:, point[point >= 0]] = tracked["error_px"].values[:, point >= 0]
    error = errors(tracked, sharp.truth)
    known = np.isfinite(error)
    ratio = np.sqrt(np.mean(error[known] ** 2) / np.mean(told[known] ** 2))
    assert 0.3 < ratio < 3.0


@pytest.mark.matrix
def test_displacements_are_in_metres_along_the_models_axes(sharp, tracked):
    moved = sharp.truth["position"].values[:, FRONT] - sharp.model.rest[FRONT]
    error = tracked["displacement"].values[:, FRONT] - moved
    assert np.isnan(tracked["displacement"].sel(axis="z")).all()  # along the line of sight
    assert np.ptp(moved[..., 0], axis=0).max() > 5e-3
    assert np.sqrt(np.nanmean(error[..., 0] ** 2)) < 1.5e-4
    assert np.sqrt(np.nanmean(error[..., 1] ** 2)) < 1.5e-4


def test_a_repeated_frame_measures_nothing(tracked):
    assert tracked["repeated"].values.nonzero()[0].tolist() == [30]
    assert np.isnan(tracked["position_px"].values[30]).all()
    assert np.isfinite(tracked["position_px"].values[31]).any()


def test_frequency_and_damping_from_the_film_are_those_of_the_motion(sharp, tracked):
    node = 6  # of the front, in the row next to the top
    true = sharp.truth["position"].sel(node=node, axis="x").values
    seen = fd.signals.fill_gaps(tracked["displacement"].sel(node=node, axis="x").values, longest=8)
    film = fd.signals.log_decrement(seen, 1.0 / RATE)
    motion = fd.signals.log_decrement(true, 1.0 / RATE)
    assert film.damped_frequency == pytest.approx(motion.damped_frequency, rel=0.01)
    assert film.damping_ratio == pytest.approx(motion.damping_ratio, rel=0.10)


def test_times_and_quality(sharp, tracked):
    np.testing.assert_allclose(tracked["time"], sharp.film.time, atol=1e-9)
    assert tracked.attrs["match_frame"] == 0
    assert tracked.attrs["match_rms_px"][0] < 1.0
    share = np.isfinite(tracked["displacement"].values[..., 0]).mean(axis=0)
    np.testing.assert_allclose(tracked["tracked"], share)
    assert (tracked["longest_gap"].values[share == 79 / 80] == 1).all()


@pytest.mark.matrix
def test_without_a_model_corners_are_followed(sharp):
    ds = track_film(str(sharp.path))
    assert (ds["node_of_point"] == -1).all()
    assert "displacement" not in ds
    assert ds.sizes["point"] >= 15
    assert np.isfinite(ds["position_px"].values[-1, :, 0]).sum() >= 12


@pytest.mark.matrix
def test_in_a_region_of_interest_a_model_is_recognized_in_the_last_frame(sharp):
    """Without its scale; the region shifts nothing."""
    film = open_film(sharp.path, (20, 10, 540, 600))
    few = replace(sharp.model, states=sharp.model.states[4:7])  # to be tried in all places
    ds = track_film(film, few, tracking=Tracking(match="last", placing=Placing(distance=DISTANCE)))
    assert ds.attrs["match_frame"] == 79
    assert (ds["node_of_point"] >= 0).sum() >= 12
    error = errors(ds, sharp.truth)[:, FRONT]
    assert np.sqrt(np.nanmean(error**2)) < 0.25
    assert np.nanmax(error) < 2.0


@pytest.mark.matrix
def test_a_covered_corner_is_lost_and_found_again():
    film = make_film(24)
    film_frames = [picture.copy() for picture in film.frames()]
    truth = film.truth()["position_px"].values
    corners = find_corners(film_frames[0])
    node = 11  # of the front, in the middle
    point = int(np.argmin(np.hypot(*(corners - truth[0, node]).T)))
    assert np.hypot(*(corners[point] - truth[0, node])) < 1.0
    for k in range(8, 16):
        u, v = np.rint(truth[k, node]).astype(int)
        film_frames[k][v - 14 : v + 15, u - 14 : u + 15] = 60
    steps = list(follow(((k / RATE, f) for k, f in enumerate(film_frames)), corners, reach=9.0))
    seen = np.array([step.position[point] for step in steps])
    error = np.hypot(*(seen - truth[:24, node]).T)
    assert np.isfinite(error[:8]).all()
    # the patch has corners of its own: they must not be taken for the node's
    assert np.isnan(error[9:16]).all()
    assert np.isfinite(error[-4:]).all()
    assert np.nanmax(error) < 1.0
    assert steps[-1].status[point] == 2
    assert 1 in [step.status[point] for step in steps[16:]]


@pytest.mark.matrix
def test_blur_and_noise_cost_little(tmp_path):
    film = make_film(12, seed=3, exposure=1 / 1000, read_noise=1.5, shot_noise=3.0)
    write_film(film, tmp_path / "blurred.mkv")
    placed = Tracking(placing=Placing(metres_per_pixel=SCALE, distance=DISTANCE))
    ds = track_film(str(tmp_path / "blurred.mkv"), model(), tracking=placed)
    error = errors(ds, film.truth())[:, FRONT]
    assert np.isfinite(error).mean() > 0.7
    assert np.sqrt(np.nanmean(error**2)) < 0.4
    assert np.nanmax(error) < 3.0
