"""Histories and frequency content in one figure."""

from __future__ import annotations

import numpy as np
import pytest

from foldyn.errors import InputError
from foldyn.plots import plot_history


def _lines(axes):
    return {line.get_label(): line for line in axes.get_lines()}


@pytest.mark.matrix
def test_one_row_per_node_one_curve_per_trajectory(two_rules):
    figure = plot_history(two_rules, [6, 7, 8], axes="x", max_frequency=5.0)
    assert len(figure.axes) == 6
    for row, node in enumerate((6, 7, 8)):
        left, right = figure.axes[2 * row : 2 * row + 2]
        assert left.get_title() == right.get_title() == f"node {node}"
        assert left.get_ylabel() == "x displacement (m)"
        assert right.get_ylabel() == "amplitude (m)"
        for label, dataset in two_rules.items():
            line = _lines(left)[label]
            np.testing.assert_array_equal(line.get_xdata(), dataset["time"])
            np.testing.assert_array_equal(line.get_ydata(), dataset["displacement"][:, node, 0])
        assert right.get_xlim() == (0.0, 5.0)
    assert [a.get_xlabel() for a in figure.axes[-2:]] == ["time (s)", "frequency (Hz)"]


@pytest.mark.matrix
def test_content_peaks_at_frequency_and_amplitude(two_rules):
    figure = plot_history(two_rules, [7], axes=["x"], max_frequency=5.0)
    for label, frequency, amplitude in (("panel", 2.0, 0.014), ("consistent", 1.5, 0.021)):
        line = _lines(figure.axes[1])[label]
        peak = np.argmax(line.get_ydata())
        assert line.get_xdata()[peak] == pytest.approx(frequency, rel=1e-12)
        assert line.get_ydata()[peak] == pytest.approx(amplitude, rel=1e-12)
        assert line.get_xdata().max() == pytest.approx(5.0)


def test_frequencies_are_shown_as_far_as_there_is_content(two_rules):
    """Sines of 1.5 and 2 Hz, sampled far more often than that."""
    slow = {label: ds.sel(node=[6]) for label, ds in two_rules.items()}
    t = np.arange(0.0, 4.0, 1e-3)
    release = slow["panel"].isel(time=np.zeros(len(t), int)).assign_coords(time=t)
    ringing = (np.exp(-t) * np.cos(2 * np.pi * 9.5 * t))[:, None, None]
    release["displacement"] = (("time", "node", "axis"), ringing * [[[1.0, 0.0, 0.0]]])
    figure = plot_history({"release": release}, [6], window="hann")
    top = figure.axes[1].get_xlim()[1]
    assert 9.5 < top <= 15.0  # not 500
    (line,) = figure.axes[1].get_lines()
    assert line.get_ydata()[-1] < 0.05 * line.get_ydata().max()
    noise = 1e-15 * np.random.default_rng(0).normal(size=release["displacement"].shape)
    both = {
        "release": release,
        "at rest": release.assign(displacement=release["displacement"] * 0.0 + noise),
    }
    assert plot_history(both, [6], axes="x", window="hann").axes[1].get_xlim()[1] == top
    still = release.assign(displacement=0.0 * release["displacement"])
    assert plot_history({"still": still}, [6], axes="x").axes[1].get_xlim()[1] == pytest.approx(
        500.0
    )


@pytest.mark.matrix
def test_legend_holds_the_labels_once_outside_the_axes(two_rules):
    figure = plot_history(two_rules, [6, 7], axes="x")
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == list(two_rules)
    assert all(axes.get_legend() is None for axes in figure.axes)
    figure.canvas.draw()
    box = legend.get_window_extent()
    assert not any(box.overlaps(axes.get_tightbbox()) for axes in figure.axes)


def test_curves_differ_in_color_and_dashes(two_rules):
    figure = plot_history(two_rules, [6])
    first, second = figure.axes[0].get_lines()
    assert first.get_color() != second.get_color()
    assert first.get_linestyle() != second.get_linestyle()


def test_direction_of_largest_motion_is_the_default(two_rules):
    figure = plot_history(two_rules, [4, 6])
    assert [a.get_ylabel()[0] for a in figure.axes[::2]] == ["z", "x"]
    figure = plot_history(two_rules, [4, 6], axes=["y", "x"])
    assert [a.get_ylabel()[0] for a in figure.axes[::2]] == ["y", "x"]


def test_frequency_axis_ends_at_half_the_slowest_sampling_at_most(two_rules):
    """2 Hz sampled at 5 Hz in one motion: content up to there, not beyond 2.5 Hz."""
    slow = two_rules["panel"].isel(time=slice(None, None, 20))
    noise = np.random.default_rng(1).normal(size=slow["displacement"].shape)
    two_rules["panel"] = slow.assign(displacement=slow["displacement"] + noise)
    figure = plot_history(two_rules, [6])
    assert figure.axes[1].get_xlim()[1] == pytest.approx(2.5)


def test_nodes_are_known_by_number_not_by_place(trajectory):
    some = trajectory.isel(node=[7, 8])
    line = plot_history({"run": some}, [8], axes="x").axes[0].get_lines()[0]
    np.testing.assert_array_equal(line.get_ydata(), trajectory["displacement"][:, 8, 0])
    with pytest.raises(InputError, match=r"7\.\.8"):
        plot_history({"run": some}, [6])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"nodes": []}, "nodes"),
        ({"nodes": [13]}, r"0\.\.12"),
        ({"nodes": [-1]}, "nodes"),
        ({"axes": "w"}, "axes"),
        ({"axes": ["x", "y", "z"]}, "3 directions for 1 nodes"),
        ({"max_frequency": 0.0}, "max_frequency"),
        ({"trajectories": {}}, "trajectories"),
    ],
)
def test_bad_input(two_rules, arguments, words):
    with pytest.raises(InputError, match=words):
        plot_history(**({"trajectories": two_rules, "nodes": [6]} | arguments))


def test_uneven_times_are_refused(trajectory):
    uneven = trajectory.isel(time=[0, 1, 2, 3, 5, 8])
    with pytest.raises(InputError, match="not evenly spaced"):
        plot_history({"run": uneven}, [6])
    for still in (trajectory.isel(time=0), trajectory.drop_vars("displacement")):
        with pytest.raises(InputError, match="one of them is not a motion"):
            plot_history({"run": trajectory, "still": still}, [6])


@pytest.mark.matrix
def test_a_motion_alone_has_no_label(trajectory):
    figures = [plot_history(given, [6, 7]) for given in (trajectory, {"run": trajectory})]
    for one, other in zip(*(figure.axes for figure in figures), strict=True):
        np.testing.assert_array_equal(*(a.get_lines()[0].get_xydata() for a in (one, other)))
    assert not figures[0].legends and len(figures[1].legends) == 1
    assert len(plot_history(trajectory, 6).axes) == 2  # one number
    assert (
        len(plot_history(trajectory, [6, 6], axes=["x", "z"]).axes) == 4
    )  # one node, two directions
    named = plot_history(trajectory, "xmax").axes[::2]
    assert [axes.get_title() for axes in named] == [f"node {k}" for k in (6, 7, 8)]
