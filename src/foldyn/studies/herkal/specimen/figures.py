"""Figures of the specimen: front nodes of the film and of the model, in time and frequency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from foldyn.plots import style
from foldyn.signals import sampling_interval
from foldyn.studies.herkal.calibration import WATCHED
from foldyn.studies.herkal.specimen.evaluation import content
from foldyn.studies.herkal.vibration import CORNER, Response

WIDTH = 9.0  # inches
COLUMNS = 3  # front nodes per row of the pattern
SUPPORT_NAMES = {
    "glued": "plate, node 59 glued",
    "plate": "plate alone (ideal)",
    "glue alone": "node 59 alone",
}


def plot_front(front: xarray.Dataset, support: str, label: str, note: str) -> Figure:
    """Draw all front nodes of the film and of the model over time, one frame each."""
    measured, model = front["measured"], front["model"].sel(support=support)
    curves = {
        node: (front["time"].values, measured.sel(node=node).values, model.sel(node=node).values)
        for node in front["node"].values.tolist()
    }
    return _grid(curves, ("time (s)", "x (mm)"), label, note)


def plot_front_content(front: xarray.Dataset, support: str, label: str, note: str) -> Figure:
    """Draw amplitude spectra of all front nodes of the film and of the model, one frame each."""
    step = sampling_interval(front["time"].values)
    curves = {}
    for node in front["node"].values.tolist():
        film = content(front["whole"].sel(node=node).values, step)
        said = content(front["model"].sel(node=node, support=support).values, step)
        if film is not None and said is not None:
            curves[node] = (*film, said[1])
    return _grid(curves, ("frequency (Hz)", "x (mm)"), label, note)


def _grid(
    curves: Mapping[int, tuple[NDArray, NDArray, NDArray]],
    labels: tuple[str, str],
    label: str,
    note: str,
) -> Figure:
    rows = -(-len(curves) // COLUMNS)
    figure = style.new_figure(WIDTH, 0.8 + 1.15 * rows, note)
    frames = figure.subplots(rows, COLUMNS, squeeze=False, sharex=True, sharey="row").ravel()
    lines = []
    for k, (frame, (node, (along, film, model))) in enumerate(
        zip(frames, curves.items(), strict=False)
    ):
        below = labels[0] if k >= len(curves) - COLUMNS else ""
        style.frame(frame, below, labels[1] if k % COLUMNS == 0 else "", f"node {node}")
        mark = {"marker": ".", "markersize": 2.5, "linestyle": "none", "label": label}
        lines = frame.plot(along, 1e3 * film, color=style.VERMILLION, **mark)
        lines += frame.plot(along, 1e3 * model, color=style.BLUE, linewidth=1.0, label="model")
        frame.margins(x=0.01)
        frame.locator_params(axis="y", nbins=4)
    for frame in frames[len(curves) :]:
        frame.set_visible(False)
    style.legend_below(figure, lines, columns=2)
    return style.finish(figure)


def plot_supports(front: xarray.Dataset, label: str, note: str) -> Figure:
    """Draw the watched node of the film and of the model with each support, and their spectra."""
    figure = style.new_figure(WIDTH, 3.6, note)
    left, right = figure.subplots(1, 2)
    style.frame(left, "time (s)", "x displacement (mm)", f"node {WATCHED}")
    style.frame(right, "frequency (Hz)", "x amplitude (mm)")
    time, step = front["time"].values, sampling_interval(front["time"].values)
    film = front["measured"].sel(node=WATCHED).values
    look = {"color": style.BLACK, "marker": ".", "markersize": 3.5, "linestyle": "none"}
    handles = left.plot(time, 1e3 * film, **look, label=label)
    _plot_content(right, front["whole"].sel(node=WATCHED).values, step, look)
    for k, (support, name) in enumerate(SUPPORT_NAMES.items()):
        x = front["model"].sel(node=WATCHED, support=support).values
        curve = style.line_style(k) | {"linewidth": 1.4}
        handles += left.plot(time, 1e3 * x, **curve, label=f"model: {name}")
        _plot_content(right, x, step, curve)
    right.set_xlim(0.0, 25.0)
    left.margins(x=0.01)
    style.legend_below(figure, handles, columns=4)
    return style.finish(figure)


def _plot_content(axes: Axes, x: NDArray[np.float64], step: float, look: Mapping) -> None:
    found = content(x, step)
    if found is not None:
        axes.plot(found[0], 1e3 * found[1], **look)


def plot_responses(
    responses: Mapping[str, xarray.Dataset], peaks: Sequence[float], note: str
) -> Figure:
    """Draw the magnitude of responses of a corner of the top along x, and the paper's peaks."""
    figure = style.new_figure(7.0, 3.8, note)
    axes = figure.subplots()
    style.frame(axes, "frequency (Hz)", "receptance (mm/N)", f"node {CORNER} along x")
    for k, (name, found) in enumerate(responses.items()):
        size = 1e3 * np.abs(found["receptance"].sel(node=CORNER, axis="x").values)
        axes.plot(found["frequency"].values, size, **style.line_style(k), label=name)
        spots = Response.of(found).frequencies
        heights = np.interp(spots, found["frequency"].values, size)
        axes.plot(spots, heights, "o", color=style.CYCLE[k], markersize=4)
    for k, frequency in enumerate(peaks):
        name = "peaks of the paper" if k == 0 else None
        axes.axvline(frequency, color=style.GRAY, linestyle=(0, (1, 1.5)), label=name)
    axes.margins(x=0.0)
    axes.set_ylim(bottom=0.0)
    style.legend_below(figure, axes.get_legend_handles_labels()[0], columns=3)
    return style.finish(figure)
