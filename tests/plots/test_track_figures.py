"""Overlays and histories of tracked nodes show what was measured, and what was not."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from foldyn.errors import InputError
from foldyn.plots import draw_overlay, plot_steps, plot_tracks


def tracks() -> xr.Dataset:
    """Four nodes of a square, one of them never found, and another corner, over 20 frames."""
    square = np.array([[100.0, 100.0], [300.0, 100.0], [300.0, 250.0], [100.0, 250.0]])
    seen = np.repeat(np.vstack([square[:3], [[200.0, 180.0]]])[np.newaxis], 20, axis=0)
    seen[:, :, 1] += 5.0 * np.sin(np.arange(20))[:, np.newaxis]
    seen[5:8, 1] = np.nan
    moved = np.full((20, 4, 3), np.nan)
    moved[:, :3, 0] = 1e-4 * (seen[:, :3, 1] - seen[0, :3, 1])
    moved[:, :3, 1] = 0.0
    return xr.Dataset(
        {
            "position_px": (("time", "point", "uv"), seen),
            "node_of_point": ("point", [0, 1, 2, -1]),
            "displacement": (("time", "node", "axis"), moved),
            "tracked": ("node", [1.0, 0.85, 1.0, 0.0]),
            "error": ("node", [1e-5, 1e-5, 1e-5, np.nan]),
            "projected_px": (("node", "uv"), square),
            "edges": (("edge", "end"), [[0, 1], [1, 2], [2, 3], [3, 0]]),
        },
        {"time": np.arange(20) / 240.0, "node": np.arange(4), "axis": ["x", "y", "z"]},
        {"foldyn_tracks": 1, "match_frame": 0},
    )


PICTURE = np.full((400, 500), 90, np.uint8)


def test_the_overlay_marks_every_kind_of_point():
    figure = draw_overlay(PICTURE, tracks())
    (axes,) = figure.axes
    marks = {line.get_marker(): line for line in axes.lines if line.get_marker() != "None"}
    np.testing.assert_allclose(marks["o"].get_xydata(), tracks().position_px.values[0, :3])
    np.testing.assert_allclose(marks["s"].get_xydata(), [[200.0, 180.0]])
    np.testing.assert_allclose(marks["x"].get_xydata(), [[100.0, 250.0]])
    assert [text.get_text() for text in axes.texts] == ["0", "1", "2"]
    assert sum(len(line.get_xydata()) == 2 for line in axes.lines) == 4  # edges
    (u0, u1), (v0, v1) = axes.get_xlim(), axes.get_ylim()
    assert 60 < u0 < 100 and 300 < u1 < 340 and v0 > v1  # around the model, v running down


def test_a_lost_node_is_not_drawn():
    (axes,) = draw_overlay(PICTURE, tracks(), at=6).axes
    assert [text.get_text() for text in axes.texts] == ["0", "2"]
    with pytest.raises(InputError, match="there are 20"):
        draw_overlay(PICTURE, tracks(), at=20)


def test_histories_have_gaps_and_say_how_much_was_measured():
    figure = plot_tracks(tracks(), [0, 1], truth={1: np.zeros(20)})
    first, second = figure.axes
    assert "100.0%" in first.get_title() and "85.0%" in second.get_title()
    assert "x displacement" in first.get_ylabel()  # the axis in which most moves
    (seen, true) = second.lines
    assert np.isnan(seen.get_ydata()[5:8]).all() and (true.get_ydata() == 0.0).all()


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"nodes": []}, "give nodes to show"),
        ({"nodes": [7]}, "7 is not in"),
        ({"nodes": [0], "axis": "w"}, "choose one of x, y, z"),
    ],
)
def test_histories_of_what_is_not_there(arguments, match):
    with pytest.raises(InputError, match=match):
        plot_tracks(tracks(), **arguments)


def test_histories_need_a_model():
    with pytest.raises(InputError, match="without a model"):
        plot_tracks(tracks().drop_vars("displacement"), [0])


def test_steps_share_their_time():
    time = np.arange(20) / 240.0
    figure = plot_steps({"raw": (time, np.sin(time)), "cut": (time[5:], np.sin(time[5:]))})
    assert [axes.get_title() for axes in figure.axes] == ["raw", "cut"]
    assert figure.axes[0].get_xlim() == figure.axes[1].get_xlim()
    with pytest.raises(InputError, match="20"):
        plot_steps({"raw": (time, np.zeros(3))})
