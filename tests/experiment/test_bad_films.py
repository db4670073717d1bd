"""What cannot be tracked gets one message that says why."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from miura_film import cv2, model

from foldyn.cli.main import main
from foldyn.errors import FoldynWarning, InputError
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
    track_photos,
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


@pytest.mark.matrix
@pytest.mark.parametrize("roi", [(0, 0, 10, 10), (-1, 0, 100, 100), (500, 500, 100, 500)])
def test_regions_outside_the_picture(sharp, roi):
    with pytest.raises(InputError, match="--roi"):
        open_film(sharp.path, roi)


@pytest.mark.matrix
def test_a_rate_is_positive(sharp):
    with pytest.raises(InputError, match="--rate"):
        open_film(sharp.path, rate=0.0)
    assert open_film(sharp.path, rate=960.0).rate == 960.0


@pytest.mark.matrix
@pytest.mark.parametrize("kind", ["black", "noise"])
def test_pictures_without_corners(kind):
    picture = np.zeros((200, 200), np.uint8)
    if kind == "noise":
        picture += np.random.default_rng(0).integers(100, 103, picture.shape, dtype=np.uint8)
    with pytest.raises(InputError, match=r"corners"):
        find_corners(picture)


@pytest.mark.matrix
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


@pytest.mark.matrix
def test_more_nodes_than_points(sharp):
    few = Tracking(corners=CornerSettings(most=8), nodes=tuple(range(20)))
    with pytest.raises(InputError, match="8 points are tracked, fewer than the 20 nodes"):
        track_film(str(sharp.path), sharp.model, tracking=few)
    with pytest.raises(InputError, match="99: the model has vertices"):
        track_film(str(sharp.path), sharp.model, tracking=Tracking(nodes=(99,)))


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


def copied(sharp, path, frames: int):
    """The first frames of a film in a file of their own."""
    code = cv2.VideoWriter_fourcc(*"FFV1")
    writer = cv2.VideoWriter(str(path), code, 240.0, sharp.film.studio.camera.size, False)
    for _, picture in zip(range(frames), open_film(sharp.path).frames(), strict=False):
        writer.write(picture[1])
    writer.release()
    return path


@pytest.mark.matrix
def test_a_film_that_breaks_off_is_tracked_and_named(sharp, tmp_path):
    whole = copied(sharp, tmp_path / "whole.mkv", 12)
    half = tmp_path / "half.mkv"
    half.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    with pytest.warns(FoldynWarning, match=r"half\.mkv: breaks off: \d frames can be read.* 12;"):
        tracks = track_film(str(half), sharp.model)
    assert 2 <= tracks.sizes["time"] <= 7
    assert track_film(str(whole)).sizes["time"] == 12  # without a warning


@pytest.mark.matrix
def test_one_frame_shows_no_motion(sharp, tmp_path):
    with pytest.raises(InputError, match=r"one\.mkv: one frame alone shows no motion"):
        track_film(str(copied(sharp, tmp_path / "one.mkv", 1)))


@pytest.mark.matrix
def test_photographs_have_one_size(sharp, tmp_path):
    picture = sharp.film.frame(0)
    for name, part in (("a.png", picture), ("b.png", picture[:500])):
        cv2.imwrite(str(tmp_path / name), part)
    files = [tmp_path / "a.png", tmp_path / "b.png"]
    with pytest.raises(InputError, match=r"b\.png: is of 580 x 500 pixels, .*a\.png of 580 x 620"):
        track_photos(files, sharp.model)
    with pytest.raises(InputError, match="--roi 0,0,700,500: must lie in the image"):
        track_photos(files, sharp.model, roi=(0, 0, 700, 500))


def test_a_reach_longer_than_the_picture(sharp):
    long = Tracking(corners=CornerSettings(reach=1e9))
    with pytest.raises(InputError, match=r"--reach 1e\+09: at most 145 pixels"):
        track_film(str(sharp.path), sharp.model, tracking=long)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--roi", "1.5,2,300,300"], "--roi 1.5,2,300,300: 1.5 is not a whole number"),
        (["--model", "herkal/specimen", "--nodes", "1,2.5"], "--nodes 1,2.5: 2.5 is not a whole"),
        (["--rate", "nan"], "--rate = nan: must be a finite number"),
        (["--distance", "0"], "--distance = 0.0: must be greater than 0 m"),
        (["--model", "film.mkv"], "film.mkv: is not a text file in UTF-8; give a case file"),
    ],
)
def test_options_that_cannot_be(sharp, tmp_path, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "film.mkv").write_bytes(sharp.path.read_bytes())
    assert main(["track", "film.mkv", *arguments, "--out", "never/bad.nc"]) == 2
    said = capsys.readouterr()
    assert message in said.err
    assert (said.out, len(said.err.splitlines())) == ("", 1)
    assert [path.name for path in tmp_path.iterdir()] == ["film.mkv"]


def test_a_text_and_a_folder_are_no_films(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "text.mp4").write_bytes(b"hello")
    (tmp_path / "folder.mp4").mkdir()
    for name, reason in (("text", "no frame can be read: it is not a film"),
                         ("folder", "is a folder")):  # fmt: skip
        assert main(["track", f"{name}.mp4"]) == 2
        assert capsys.readouterr().err.startswith(f"foldyn: {name}.mp4: {reason}")


@pytest.mark.matrix
def test_a_broken_film_gets_one_line_decoders_included(sharp, tmp_path):
    (tmp_path / "film.mp4").write_bytes(sharp.path.read_bytes()[:200])
    done = subprocess.run(
        [sys.executable, "-m", "foldyn.cli.main", "track", "film.mp4"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.startswith("foldyn: film.mp4: no frame can be read: it is not a film")
    assert (done.stdout, len(done.stderr.splitlines())) == ("", 1)
    assert [path.name for path in tmp_path.iterdir()] == ["film.mp4"]
