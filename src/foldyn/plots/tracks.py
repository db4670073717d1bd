"""Histories of tracked nodes or points, with how well each was measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.plots import style

_LABELS = {"time": "time (s)", "photo": "photo", "load": "load (N)"}


def plot_tracks(
    tracks: xr.Dataset,
    nodes: Sequence[int],
    axis: str | None = None,
    truth: Mapping[int, ArrayLike] | None = None,
    title: str = "",
) -> Figure:
    """Draw the measured displacements of nodes, one row each; gaps are where a node was lost.

    Parameters
    ----------
    tracks : xarray.Dataset
        Of `foldyn.experiment`, with a model.
    nodes : sequence of int
    axis : str or None
        "x", "y" or "z"; None: the one in which most is measured to move.
    truth : mapping of int to array_like, optional
        True displacements (m) of nodes at the same times, drawn behind.
    title : str

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        Tracks without a model, a node or an axis that they do not have, or one never measured.
    """
    if "displacement" not in tracks:
        raise InputError("tracks: without a model there are pixels only; track with a model")
    if not len(nodes):
        raise InputError("nodes: empty; name at least one node to show")
    wrong = [node for node in nodes if node not in tracks["node"].values]
    if wrong:
        raise InputError(f"nodes: {wrong[0]} is none of the {tracks.sizes['node']} tracked nodes")
    moved = tracks["displacement"]
    if axis is None:
        size = np.nan_to_num(moved.sel(node=list(nodes)).values)
        axis = "xyz"[int(np.ptp(size.reshape(-1, 3), axis=0).argmax())]
    if axis not in ("x", "y", "z"):
        raise InputError(f'axis: {axis!r} is no direction; use "x", "y" or "z"')
    along = "photo" if "photo" in tracks.dims else "time"
    shown = "load" if along == "photo" and "load" in tracks.coords else along
    across, label = tracks[shown].values, _LABELS[shown]
    figure = style.new_figure(8.0, 1.1 + 1.6 * len(nodes), title)
    grid = figure.subplots(len(nodes), 1, squeeze=False, sharex="col")[:, 0]
    keys = []
    for row, (node, axes) in enumerate(zip(nodes, grid, strict=True)):
        last = row == len(nodes) - 1
        share = float(tracks["tracked"].sel(node=node))
        name = f"node {node}: measured in {share:.1%}"
        if "error" in tracks and np.isfinite(tracks["error"].sel(node=node)):
            name += f", standard error {1e6 * float(tracks['error'].sel(node=node)):.2g} µm"
        style.frame(axes, label if last else "", f"{axis} displacement (m)", name)
        if truth is not None and node in truth:
            (key,) = axes.plot(
                across, np.asarray(truth[node]), **style.line_style(1) | {"label": "true motion"}
            )
            keys += [key] if row == 0 else []
        look = style.line_style(0) | {"label": "tracked"}
        if along == "photo":
            look |= {"marker": "o", "markersize": 4}
        (key,) = axes.plot(across, moved.sel(node=node, axis=axis).values, **look)
        keys += [key] if row == 0 else []
        axes.margins(x=0.02 if along == "photo" else 0.0)
        style.exponents(axes, ticks=5)
    if len(keys) > 1:
        style.legend_below(figure, keys)
    figure.align_ylabels(grid)
    return style.finish(figure)


def plot_steps(
    steps: Mapping[str, tuple[ArrayLike, ArrayLike]], unit: str = "m", title: str = ""
) -> Figure:
    """Draw a history after each step of its preparation, one row each.

    Parameters
    ----------
    steps : mapping of str to (time, values)
        What was done, and the record (s, `unit`) after it; the first one is the record as measured.
    unit : str
    title : str

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        There is none, or times and values differ in number.
    """
    if not steps:
        raise InputError("steps: empty; give at least the record as measured")
    figure = style.new_figure(7.5, 0.8 + 1.35 * len(steps), title)
    grid = figure.subplots(len(steps), 1, squeeze=False, sharex="col")[:, 0]
    for row, (name, (time, values)) in enumerate(steps.items()):
        t: NDArray = np.asarray(time, dtype=np.float64)
        x: NDArray = np.asarray(values, dtype=np.float64)
        if t.shape != x.shape:
            raise InputError(f"steps: {name!r} has {t.shape} times and {x.shape} values")
        last = row == len(steps) - 1
        style.frame(grid[row], "time (s)" if last else "", f"({unit})", name)
        grid[row].plot(t, x, **style.line_style(0))
        style.exponents(grid[row], ticks=4)
        grid[row].margins(x=0.0)
    figure.align_ylabels(grid)
    return style.finish(figure)
