"""A model over the picture in which it was recognized, to check the nodes' identities by eye."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.plots import style

_MARGIN = 0.08  # of the model's size, around it
_WIDTH = 8.0


def draw_overlay(
    picture: NDArray[np.uint8], tracks: xr.Dataset, at: int | None = None, title: str = ""
) -> Figure:
    """Draw the projected model, the tracked nodes and their numbers over a picture.

    Parameters
    ----------
    picture : ndarray of uint8, shape (height, width)
        The frame or photograph, whole.
    tracks : xarray.Dataset
        Of `foldyn.experiment`; with a model, whose edges are then drawn as it was recognized.
    at : int or None
        Index of the frame or photograph; None: the frame in which the model was recognized.
    title : str

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        There is no such frame.
    """
    along = "photo" if "photo" in tracks.dims else "time"
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
    figure = style.new_figure(
        _WIDTH, 0.9 + _WIDTH * float(np.clip(span[1] / span[0], 0.3, 1.6)), title
    )
    axes = figure.add_subplot()
    axes.imshow(picture, cmap="gray", vmin=0, vmax=255, interpolation="nearest")
    keys = []
    if len(model):
        for a, b in tracks["edges"].values:
            axes.plot(*model[[a, b]].T, color=style.SKY, linewidth=0.7, linestyle="solid")
        keys.append(Line2D([], [], color=style.SKY, linewidth=0.9, label="model, projected"))
    known = np.isfinite(seen[:, 0])
    named, others = known & (nodes >= 0), known & (nodes < 0)
    look = {"linestyle": "none", "markerfacecolor": "none", "markeredgewidth": 1.1}
    for some, marker, color, label in (
        (named, "o", style.VERMILLION, "tracked node"),
        (others, "s", style.ORANGE, "other tracked corner"),
    ):
        if some.any():
            keys += axes.plot(
                *seen[some].T, marker=marker, markersize=6, markeredgecolor=color, label=label,
                **look,
            )  # fmt: skip
    missing = np.setdiff1d(np.arange(len(model)), nodes[named])
    if len(missing):
        keys += axes.plot(
            *model[missing].T, marker="x", markersize=5, markeredgecolor=style.YELLOW,
            label="node not found", **look,
        )  # fmt: skip
    for point in np.flatnonzero(named):
        axes.annotate(
            str(nodes[point]), seen[point], xytext=(4, 4), textcoords="offset points",
            fontsize=style.NOTE, color=style.YELLOW,
            path_effects=[withStroke(linewidth=1.6, foreground=style.BLACK)],
        )  # fmt: skip
    style.frame(axes, "u (pixels)", "v (pixels)")
    axes.grid(False)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(high[1], low[1])
    if keys:
        style.legend_below(figure, keys, columns=4)
    return style.finish(figure)


def _extent(
    points: NDArray[np.float64], shape: tuple[int, ...]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Part of the picture around all points."""
    whole = np.array([shape[1], shape[0]], dtype=np.float64) - 0.5
    known = points[np.isfinite(points[:, 0])]
    if not len(known):
        return np.full(2, -0.5), whole
    low, high = known.min(axis=0), known.max(axis=0)
    margin = _MARGIN * float((high - low).max()) + 4.0
    return np.maximum(low - margin, -0.5), np.minimum(high + margin, whole)
