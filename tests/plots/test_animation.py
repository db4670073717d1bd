"""The GIF of a motion."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from PIL import Image

from foldyn.errors import InputError
from foldyn.plots import animate
from foldyn.plots.animation import frame_displacements
from foldyn.plots.scene import Sheet3D


def test_asked_frames_and_rate(case, trajectory, tmp_path):
    swing = trajectory.isel(time=slice(0, 40))
    path = animate(case, swing, tmp_path / "motion.gif", frames=9, fps=20, scale=5.0)
    with Image.open(path) as gif:
        assert gif.n_frames == 9
        assert gif.info["duration"] == 50
        assert gif.info["loop"] == 0
        pictures = []
        for k in range(9):
            gif.seek(k)
            pictures.append(np.asarray(gif.convert("RGB"), dtype=int))
    # The sheet moves: frames differ below the clock, too.
    lower = slice(pictures[0].shape[0] // 5, None)
    assert all(np.abs(a[lower] - b[lower]).max() > 60 for a, b in pairwise(pictures))


def test_a_sheet_at_rest_keeps_all_frames(case, trajectory, tmp_path):
    still = trajectory.assign(displacement=0.0 * trajectory["displacement"])
    with Image.open(animate(case, still, tmp_path / "rest.gif", frames=5)) as gif:
        assert gif.n_frames == 5


def test_frames_are_evenly_spread_and_interpolated(structure, trajectory):
    sheet = Sheet3D.of(structure)
    times, u = frame_displacements(sheet, trajectory, 4)
    np.testing.assert_allclose(times, np.linspace(0.0, 9.99, 4))
    stored = trajectory["displacement"].values
    np.testing.assert_array_equal(u[0], stored[0])
    np.testing.assert_allclose(u[-1], stored[-1], atol=1e-16)
    np.testing.assert_allclose(u[1], stored[333], atol=1e-15)
    short = trajectory.isel(time=[0, 5])
    _, half = frame_displacements(sheet, short, 3)
    np.testing.assert_allclose(half[1], 0.5 * stored[5], atol=1e-16)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"path": "motion.mp4"}, "gif"),
        ({"path": "missing/motion.gif"}, "directory"),
        ({"fps": 0}, "fps"),
        ({"fps": 60}, "fps"),
        ({"frames": 1}, "frames"),
    ],
)
def test_bad_input(case, trajectory, tmp_path, change, words):
    path = tmp_path / change.pop("path", "motion.gif")
    with pytest.raises(InputError, match=words):
        animate(case, trajectory, path, **change)
    assert list(tmp_path.iterdir()) == []


def test_foreign_or_broken_trajectory(case, trajectory, tmp_path):
    with pytest.raises(InputError, match="9 nodes, the structure 13"):
        animate(case, trajectory.isel(node=slice(9)), tmp_path / "a.gif")
    broken = trajectory.where(trajectory["time"] < 5.0)
    with pytest.raises(InputError, match="NaN"):
        animate(case, broken, tmp_path / "a.gif")
    with pytest.raises(InputError, match="single sample"):
        animate(case, trajectory.isel(time=[0]), tmp_path / "a.gif")
    assert list(tmp_path.iterdir()) == []
