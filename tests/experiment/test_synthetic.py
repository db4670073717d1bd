"""Synthetic films: what they show is where the truth says, and they are the same every time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from miura_film import FRONT, camera, cv2, folded, make_film, moving_states
from scipy.spatial.transform import Rotation

import foldyn as fd
from foldyn.errors import InputError
from foldyn.experiment import Look, film_of, refine, write_film
from foldyn.experiment.rendering.picture import two_colors


@pytest.mark.matrix
def test_the_same_seed_gives_the_same_film():
    first, again, other = (
        make_film(2, seed=seed, read_noise=1.0, exposure=1e-3, samples=4).frame(1)
        for seed in (5, 5, 6)
    )
    np.testing.assert_array_equal(first, again)
    assert (first != other).mean() > 0.3


@pytest.mark.matrix
def test_corners_are_where_the_truth_says():
    film = make_film(1)
    true = film.truth()["position_px"].values[0, FRONT]
    picture = film.frame(0)
    found = refine(picture, true + 0.4, reach=10.0, moved=5.0)
    error = np.hypot(*(found.position - true).T)
    assert np.isfinite(error).sum() >= 8
    assert np.sqrt(np.nanmean(error**2)) < 0.25
    # Foerstner's refinement is drawn into the sharp panels, by several times as much
    start = (true + 0.4).astype(np.float32).reshape(-1, 1, 2).copy()
    usual = cv2.cornerSubPix(picture, start, (6, 6), (-1, -1), (3, 50, 1e-3))[:, 0]
    assert np.sqrt(np.mean((usual - true) ** 2)) > 2.0 * np.sqrt(np.nanmean(error**2) / 2.0)
    # where refining starts does not matter
    ways = [
        refine(picture, true + shift, reach=10.0, moved=5.0).position for shift in (-0.8, 0.0, 0.8)
    ]
    assert np.nanmax(np.abs(ways[0] - ways[1])) < 0.3
    assert np.nanmedian(np.abs(ways[0] - ways[2])) < 0.03


@pytest.mark.matrix
def test_blur_spreads_edges_about_the_middle_of_the_exposure():
    sharp, blurred = make_film(3), make_film(3, exposure=1 / 480, samples=16)
    a, b = sharp.frame(2).astype(float), blurred.frame(2).astype(float)
    # the same light, less steep
    assert b.mean() == pytest.approx(a.mean(), rel=5e-3)
    assert np.abs(np.diff(b, axis=0)).max() < np.abs(np.diff(a, axis=0)).max()


@pytest.mark.matrix
def test_noise_has_the_given_size():
    film = make_film(2, read_noise=2.0, samples=4)
    background = film.frame(0)[:20, :20].astype(float)
    assert background.std() == pytest.approx(2.0, rel=0.15)


@pytest.mark.matrix
def test_dropped_frames_repeat_the_last_one():
    film = make_film(4, dropped=(2,), read_noise=1.0, samples=4)
    pictures = list(film.frames())
    np.testing.assert_array_equal(pictures[1], pictures[2])
    assert (pictures[2] != pictures[3]).any()
    assert film.truth()["dropped"].values.tolist() == [False, False, True, False]


@pytest.mark.matrix
def test_panels_hide_what_is_behind_them():
    film = make_film(1, samples=4)
    film.frame(0)
    assert film.truth()["seen"].values[0, FRONT].all()
    # from the side at a low angle the ridges hide the valleys
    low = camera()
    turn = Rotation.from_euler("y", 65, degrees=True).as_matrix()
    middle = moving_states(75.0)[0].mean(axis=0)
    rotation = low.rotation @ turn
    low = replace(low, rotation=rotation, position=middle - 0.4 * rotation[2])
    film = make_film(1, samples=4)
    studio = replace(film.studio, camera=low)
    _, seen = studio.take(moving_states(75.0)[0], np.random.default_rng(0))
    assert 3 <= seen[:25].sum() < 24


def test_neighboring_panels_differ_in_color():
    pattern = folded(70.0).pattern
    color = two_colors(pattern)
    a, b = np.asarray(pattern.crease_faces).T
    assert (color[a] != color[b]).all()


@pytest.mark.matrix
def test_films_of_simulations_and_photos_of_paths(tmp_path):
    structure = folded(70.0)
    held, pull = fd.Fix([20, 22, 24]), fd.Force([1, 3], (0.01, 0, 0))
    case = fd.Case(structure, [held], [pull], damping=fd.Rayleigh(alpha=10.0))
    motion = fd.simulate(case, duration=0.02, method="rk4", interval=0.001)
    film = film_of(motion, camera(), rate=200.0, start=0.005, duration=0.01)
    np.testing.assert_allclose(film.time, [0.0, 0.005, 0.01])
    true = film.truth()["position"].values[0]
    np.testing.assert_allclose(
        true, structure.nodes + motion["displacement"].sel(time=0.005).values, atol=1e-9
    )
    with pytest.raises(InputError, match="start, duration"):
        film_of(motion, camera(), duration=1.0)
    with pytest.raises(InputError, match="films are written to"):
        write_film(film, tmp_path / "film.gif")


@pytest.mark.parametrize("name", ["ink", "paper", "background", "ambient", "vignette"])
def test_reflectances_are_shares(name):
    with pytest.raises(InputError, match=name):
        Look(**{name: 1.5})
