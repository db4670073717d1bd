"""Tracked nodes: their histories, and the model drawn over the picture that it was matched to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.plots import style
from foldyn.plots.chart_figures import figure_of
from foldyn.plots.charts import Chart, Curve
from foldyn.plots.readings import AXES, alone, check_nodes_of
from foldyn.plots.track_charts import dimension, track_charts
from foldyn.values import choice

_MARGIN = 0.08  # margin around the model in an overlay, relative to its size
_WIDTH = 8.0  # inches


def plot_tracks(
    tracks: xr.Dataset,
    nodes: int | Sequence[int],
    *,
    axis: str | None = None,
    truth: Mapping[int, ArrayLike] | None = None,
    title: str = "",
) -> Figure:
    """Draw the measured displacements of nodes, a row for each; gaps show where a node was lost.

    Parameters
    ----------
    tracks : xarray.Dataset
        Tracks of `foldyn.experiment` that were made with a model.
    nodes : int or sequence of int
    axis : str or None
        "x", "y" or "z"; None means the axis with the largest measured motion.
    truth : mapping of int to array_like, optional
        True displacements (m) of nodes at the same times, drawn behind the measured ones.
    title : str

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        The tracks have no model, lack a node or an axis, or a node was never measured.
    """
    if "displacement" not in alone("tracks", tracks):
        raise InputError("tracks: without a model there are pixels only; track with a model")
    nodes = check_nodes_of({"tracks": tracks}, nodes)
    moved = tracks["displacement"]
    if axis is None:
        size = np.nan_to_num(moved.sel(node=nodes).values)
        axis = AXES[int(np.ptp(size.reshape(-1, 3), axis=0).argmax())]
    choice("axis", axis, AXES)
    charts = track_charts(tracks, nodes, [axis], truth)
    return figure_of(charts, (_WIDTH, 1.1 + 1.6 * len(nodes)), title, sharex=True)


def plot_steps(
    steps: Mapping[str, tuple[ArrayLike, ArrayLike]], unit: str = "m", *, title: str = ""
) -> Figure:
    """Draw a history after each step of its processing, a row for each step.

    Parameters
    ----------
    steps : mapping of str to (time, values)
        The name of each step, and the record (s, `unit`) after it; the first is the measured
        record.
    unit : str
    title : str

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        There are no steps, or times and values differ in number.
    """
    if not isinstance(steps, Mapping) or not steps:
        raise InputError(": give a mapping with at least {'as measured': (time, values)}", "steps")
    charts = [
        Chart("time (s)", f"({unit})", [Curve(name, np.asarray(time), np.asarray(values))], name)
        for name, (time, values) in steps.items()
    ]
    return figure_of(charts, (7.5, 0.8 + 1.35 * len(steps)), title, legend=0, sharex=True)


def draw_overlay(
    picture: NDArray[np.uint8], tracks: xr.Dataset, *, at: int | None = None, title: str = ""
) -> Figure:
    """Draw the projected model, the tracked nodes and their numbers over a picture.

    Parameters
    ----------
    picture : ndarray of uint8, shape (height, width)
        The whole frame or photograph.
    tracks : xarray.Dataset
        From `foldyn.experiment`; with a model, its edges are drawn in the recognized pose.
    at : int or None
        Index of the frame or photograph; None means the frame in which the model was recognized.
    title : str

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        There is no such frame.
    """
    along = dimension(alone("tracks", tracks))
    index = int(tracks.attrs.get("match_frame", 0)) if at is None else int(at)
    if not 0 <= index < tracks.sizes[along]:
        raise InputError(f"at: {index}; there are {tracks.sizes[along]} along {along}")
    seen = tracks["position_px"].values[index]
    nodes = tracks["node_of_point"].values
    projected = tracks.get("projected_px")
    model = np.zeros((0, 2))
    if projected is not None:
        model = projected.values[index] if along in projected.dims else projected.values
    low, high = _extent(np.concatenate([seen, model]), picture.shape)
    span = high - low
    # a line above for the title, two below for the legend
    height = 0.9 + _WIDTH * float(np.clip(span[1] / span[0], 0.3, 1.6))
    figure = style.new_figure(_WIDTH, height, title)
    axes = figure.add_subplot()
    axes.imshow(picture, cmap="gray", vmin=0, vmax=255, interpolation="nearest")
    keys = []
    if len(model):
        for a, b in tracks["edges"].values:
            axes.plot(*model[[a, b]].T, color=style.SKY, linewidth=0.7, linestyle="solid")
        keys.append(style.key("model, projected", color=style.SKY, linewidth=0.9))
    known = np.isfinite(seen[:, 0])
    named, others = known & (nodes >= 0), known & (nodes < 0)
    missing = np.setdiff1d(np.arange(len(model)), nodes[named])
    look = {"linestyle": "none", "markerfacecolor": "none", "markeredgewidth": 1.1}
    for points, marker, size, color, label in (
        (seen[named], "o", 6, style.VERMILLION, "tracked node"),
        (seen[others], "s", 6, style.ORANGE, "other tracked corner"),
        (model[missing], "x", 5, style.YELLOW, "node not found"),
    ):
        if len(points):
            look |= {"marker": marker, "markersize": size, "markeredgecolor": color}
            keys += axes.plot(*points.T, label=label, **look)
    for point in np.flatnonzero(named):
        axes.annotate(
            str(nodes[point]), seen[point], xytext=(4, 4), textcoords="offset points",
            fontsize=style.NOTE, color=style.YELLOW,
            path_effects=[withStroke(linewidth=1.6, foreground=style.BLACK)],
        )  # fmt: skip
    style.frame(axes, "u (pixels)", "v (pixels)")
    axes.grid(False)
    axes.set(xlim=(low[0], high[0]), ylim=(high[1], low[1]))
    return style.finish(figure, keys, columns=4)


def _extent(
    points: NDArray[np.float64], shape: tuple[int, ...]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Part of the picture that surrounds all points."""
    whole = np.array([shape[1], shape[0]], dtype=np.float64) - 0.5
    known = points[np.isfinite(points[:, 0])]
    if not len(known):
        return np.full(2, -0.5), whole
    low, high = known.min(axis=0), known.max(axis=0)
    margin = _MARGIN * float((high - low).max()) + 4.0
    return np.maximum(low - margin, -0.5), np.minimum(high + margin, whole)
