"""The GIF or MP4 of a motion."""

from __future__ import annotations

import re
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from pictures import assert_white_rim, frames
from PIL import Image

from foldyn import cases
from foldyn.errors import ComputationError, InputError
from foldyn.plots import animate, scene, style, writers
from foldyn.plots.animation import frame_displacements, pace
from foldyn.plots.scene import Sheet3D, View


@pytest.mark.matrix
def test_asked_frames_and_rate(case, trajectory, tmp_path):
    swing = trajectory.isel(time=slice(0, 40))
    path = animate(case, swing, path=tmp_path / "motion.gif", frames=9, fps=20, scale=5.0)
    with Image.open(path) as gif:
        assert gif.n_frames == 9
        assert gif.info["duration"] == 50
        assert gif.info["loop"] == 0
    pictures = frames(path)
    # The sheet moves: frames differ below the clock, too.
    lower = slice(pictures[0].shape[0] // 5, None)
    assert all(np.abs(a[lower] - b[lower]).max() > 60 for a, b in pairwise(pictures))


@pytest.mark.matrix
def test_the_rate_of_a_gif_is_the_one_told(case, trajectory, tmp_path, monkeypatch):
    told = []
    monkeypatch.setattr("foldyn.plots.animation.pace", lambda s: told.append(s) or "")
    with Image.open(animate(case, trajectory, path=tmp_path / "a.gif", frames=4, fps=14)) as gif:
        shown = gif.info["duration"] / 1000  # s a picture; 1/14 s is rounded to 0.07 s
    assert told == [pytest.approx(9.99 / 3 / shown)]


@pytest.mark.matrix
def test_a_sheet_at_rest_keeps_all_frames(case, trajectory, tmp_path):
    still = trajectory.assign(displacement=0.0 * trajectory["displacement"])
    with Image.open(animate(case, still, path=tmp_path / "rest.gif", frames=5)) as gif:
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
        ({"path": "motion.avi"}, r"\.gif or \.mp4"),
        ({"path": "missing/motion.gif"}, "directory"),
        ({"fps": 0}, "fps"),
        ({"fps": 60}, "fps"),
        ({"frames": 1}, "frames"),
    ],
)
def test_bad_input(case, trajectory, tmp_path, change, words):
    path = tmp_path / change.pop("path", "motion.gif")
    with pytest.raises(InputError, match=words):
        animate(case, trajectory, path=path, **change)
    assert list(tmp_path.iterdir()) == []


def test_foreign_or_broken_trajectory(case, trajectory, tmp_path):
    with pytest.raises(InputError, match="9 nodes, the structure 13"):
        animate(case, trajectory.isel(node=slice(9)), path=tmp_path / "a.gif")
    broken = trajectory.where(trajectory["time"] < 5.0)
    with pytest.raises(InputError, match="NaN"):
        animate(case, broken, path=tmp_path / "a.gif")
    with pytest.raises(InputError, match="single sample"):
        animate(case, trajectory.isel(time=[0]), path=tmp_path / "a.gif")
    assert list(tmp_path.iterdir()) == []


# ---------------------------------------------------------------------------- large motions


@pytest.fixture
def flight(structure, trajectory):
    """A free sheet that flies four of its lengths far, and higher than it is long."""
    t = np.linspace(0.0, 1.0, 41)
    path = np.stack([8.0 * t, 0.0 * t, 20.0 * t * (1.0 - t)], axis=1)
    motion = trajectory.isel(time=slice(0, 41)).assign_coords(time=t)
    still = np.zeros((1, len(structure.nodes), 1))
    motion["displacement"] = (("time", "node", "axis"), path[:, None] + still)
    return cases.Case(structure), motion


def count(picture: np.ndarray, color: str) -> int:
    """Pixels that have a color but for the few colors of a GIF."""
    near = np.abs(picture - np.round(255 * np.array(to_rgb(color)))).max(axis=2) < 30
    return int(near[: int(0.85 * len(picture))].sum())  # above the legend


@pytest.mark.matrix
def test_the_frame_holds_a_free_flight(flight, tmp_path):
    case, motion = flight
    drawn = frames(animate(case, motion, path=tmp_path / "flight.gif", frames=7))
    creases = [count(frame, style.CREASES["M"]) for frame in drawn]
    assert min(creases) > 20
    # the same number of pixels everywhere: nothing is cut off
    assert max(creases) < 1.3 * min(creases)
    for frame in drawn:
        assert_white_rim(frame)


@pytest.mark.matrix
def test_a_free_flight_leaves_the_path_of_its_center(flight, case, trajectory, tmp_path):
    free, motion = flight
    drawn = frames(animate(free, motion, path=tmp_path / "a.gif", frames=3))
    assert all(count(frame, style.GREEN) > 100 for frame in drawn)
    held = frames(animate(case, motion, path=tmp_path / "b.gif", frames=3))
    assert all(count(frame, style.GREEN) == 0 for frame in held)
    staying = frames(animate(free, trajectory, path=tmp_path / "c.gif", frames=3))
    assert all(count(frame, style.GREEN) == 0 for frame in staying)


@pytest.mark.matrix
def test_creases_glow_unless_all_are_actuated(structure, trajectory, tmp_path):
    some = cases.Case(structure, loads=[cases.Actuate([0], 90.0)])
    glowing = frames(animate(some, trajectory, path=tmp_path / "some.gif", frames=2))
    assert all(count(frame, style.ACTUATED) > 50 for frame in glowing)
    everything = cases.Case(structure, loads=[cases.Actuate("all", 90.0)])
    plain = frames(animate(everything, trajectory, path=tmp_path / "all.gif", frames=2))
    assert all(count(frame, style.ACTUATED) == 0 for frame in plain)


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (1.0, "at real speed"),
        (1.03, "at real speed"),
        (0.084, "12 times slower"),
        (2.5, "2.5 times faster"),
        (1e-4, "10000 times slower"),
        (123.0, "120 times faster"),
    ],
)
def test_the_pace_is_told(seconds, words):
    assert pace(seconds) == f"shown {words}"


@pytest.mark.parametrize("depth", [0.05, 0.15, 0.3, 0.6, 1.0])
@pytest.mark.parametrize("view", [View(), View(28.0, 30.0), View(40.0, 200.0)])
def test_numbers_of_two_axes_do_not_touch(depth, view):
    box = np.array([[0.0, 0.0, -0.2], [1.03, depth, 1.1]])
    figure, axes = scene.view_figure(box, view)
    figure.canvas.draw()
    x, y = (
        [label.get_window_extent() for label in axis.get_ticklabels() if label.get_visible()]
        for axis in (axes.xaxis, axes.yaxis)
    )
    assert x and y
    assert not any(a.overlaps(b) for a in x for b in y)


# --------------------------------------------------------------------------------------- MP4


@pytest.fixture
def ffmpeg() -> str:
    try:
        return writers.find_ffmpeg()
    except InputError:
        pytest.skip("needs ffmpeg or imageio-ffmpeg")


def test_a_film_has_the_asked_frames_and_rate(ffmpeg, case, trajectory, tmp_path):
    film = animate(case, trajectory, path=tmp_path / "motion.mp4", frames=12, fps=6)
    assert film.read_bytes()[4:8] == b"ftyp"
    told = subprocess.run(
        [ffmpeg, "-i", str(film), "-f", "null", "-"], capture_output=True, text=True, check=True
    ).stderr
    assert "h264" in told and "yuv420p" in told and " 6 fps" in told
    assert re.findall(r"frame=\s*(\d+)", told)[-1] == "12"
    width, height = map(int, re.search(r" (\d{3,4})x(\d{3,4})", told).groups())
    assert width == 1200 and height % 2 == 0


FAKE = """#!{python}
import sys
arguments = sys.argv[1:]
if {fail}:
    sys.exit("Unknown encoder 'h264'")
data = sys.stdin.buffer.read()
with open(arguments[-1], "w") as file:
    file.write(f"{{len(data)}} {{' '.join(arguments)}}")
"""


@pytest.fixture
def fake(tmp_path, monkeypatch):
    """Put a program on the PATH that only notes what ffmpeg would get."""
    if sys.platform == "win32":
        pytest.skip("scripts are no programs here")

    def put(fail: bool) -> None:
        program = tmp_path / "bin" / "ffmpeg"
        program.parent.mkdir()
        program.write_text(FAKE.format(python=sys.executable, fail=fail))
        program.chmod(0o755)
        monkeypatch.setenv("PATH", str(program.parent))

    return put


@pytest.mark.matrix
def test_ffmpeg_gets_every_frame(fake, case, trajectory, tmp_path):
    fake(fail=False)
    film = animate(case, trajectory, path=tmp_path / "motion.mp4", frames=5, fps=30)
    size, *arguments = film.read_text().split()
    width, height = map(int, arguments[arguments.index("-s") + 1].split("x"))
    assert (width % 2, height % 2) == (0, 0)
    assert int(size) == 5 * 4 * width * height
    assert arguments[arguments.index("-framerate") + 1] == "30"
    assert "h264" in arguments and "yuv420p" in arguments


def test_an_ffmpeg_that_fails_is_quoted(fake, case, trajectory, tmp_path):
    fake(fail=True)
    with pytest.raises(ComputationError, match=r"Unknown encoder 'h264'.*imageio-ffmpeg"):
        animate(case, trajectory, path=tmp_path / "motion.mp4", frames=3)


def test_without_ffmpeg_a_film_is_refused(case, trajectory, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(InputError, match=r"MP4 needs ffmpeg.*pip install imageio-ffmpeg"):
        animate(case, trajectory, path=tmp_path / "motion.mp4")
    assert list(tmp_path.iterdir()) == []
