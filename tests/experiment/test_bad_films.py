"""What cannot be tracked gets one message that says why."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from miura_film import cv2, model

from foldyn.errors import InputError
from foldyn.experiment import (
    CornerSettings,
    FollowSettings,
    Placing,
    Tracking,
    find_corners,
    load_tracks,
    open_film,
    read_photo,
    track_film,
)


def test_without_opencv_it_is_said_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(InputError, match="pip install opencv-python-headless"):
        open_film("film.mp4")


def test_files_that_are_no_films(tmp_path):
    text = tmp_path / "film.mp4"
    with pytest.raises(InputError, match="no such file"):
        open_film(text)
    text.write_text("no film", "utf-8")
    with pytest.raises(InputError, match="codec is unknown here"):
        open_film(text)
    with pytest.raises(InputError, match="not a picture"):
        read_photo(text)
    with pytest.raises(InputError, match="cannot be read as NetCDF"):
        load_tracks(text)


@pytest.mark.parametrize("roi", [(0, 0, 10, 10), (-1, 0, 100, 100), (500, 500, 100, 500)])
def test_regions_outside_the_picture(sharp, roi):
    with pytest.raises(InputError, match="--roi"):
        open_film(sharp.path, roi)


def test_a_rate_is_positive(sharp):
    with pytest.raises(InputError, match="--rate"):
        open_film(sharp.path, rate=0.0)
    assert open_film(sharp.path, rate=960.0).rate == 960.0


@pytest.mark.parametrize("kind", ["black", "noise"])
def test_pictures_without_corners(kind):
    picture = np.zeros((200, 200), np.uint8)
    if kind == "noise":
        picture += np.random.default_rng(0).integers(100, 103, picture.shape, dtype=np.uint8)
    with pytest.raises(InputError, match=r"corners"):
        find_corners(picture)


def test_a_model_that_is_not_there(tmp_path):
    picture = np.full((300, 300), 40, np.uint8)
    for k, (u, v) in enumerate([(40, 50), (150, 40), (60, 200), (190, 170), (220, 240)]):
        picture[v : v + 30 + 5 * k, u : u + 45 - 6 * k] = 210  # sheets of paper lie about
    writer = cv2.VideoWriter(
        str(tmp_path / "sheets.mkv"), cv2.VideoWriter_fourcc(*"FFV1"), 30.0, (300, 300), False
    )
    for _ in range(3):
        writer.write(picture)
    writer.release()
    with pytest.raises(InputError, match="do not fall on the"):
        track_film(str(tmp_path / "sheets.mkv"), model())


def test_more_nodes_than_points(sharp):
    few = Tracking(corners=CornerSettings(most=8), nodes=tuple(range(20)))
    with pytest.raises(InputError, match="8 points are tracked, fewer than the 20 nodes"):
        track_film(str(sharp.path), sharp.model, few)
    with pytest.raises(InputError, match="99 is no vertex"):
        track_film(str(sharp.path), sharp.model, Tracking(nodes=(99,)))


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: Tracking(match="middle"), "--match"),
        (lambda: Placing(distance=0.0), "--distance"),
        (lambda: Placing(up="z"), "same axis"),
        (lambda: CornerSettings(reach=-1.0), "reach"),
        (lambda: FollowSettings(window=1), "window"),
        (lambda: FollowSettings(back=0.0), "back"),
    ],
)
def test_settings_that_cannot_be(make, match):
    with pytest.raises(InputError, match=match):
        make()
