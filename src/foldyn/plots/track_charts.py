"""Charts of tracked nodes: their measured displacements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from foldyn.plots.charts import Chart, Curve

_LABELS = {"time": "time (s)", "photo": "photograph", "load": "load (N)"}


def track_charts(
    tracks: xr.Dataset,
    nodes: Sequence[int],
    axes: Sequence[str],
    truth: Mapping[int, ArrayLike] | None = None,
) -> list[Chart]:
    """Displacements (m) of nodes against time, photograph or load, a chart for each node.

    Each axis is a curve of dots. True displacements may be given for a single axis.
    """
    along = dimension(tracks)
    shown = "load" if along == "photo" and "load" in tracks.coords else along
    across = np.asarray(tracks[shown].values, float)
    several = len(axes) > 1
    ylabel = "displacement (m)" if several else f"{axes[0]} displacement (m)"
    charts = []
    for node in nodes:
        curves = []
        for axis in axes:
            moved = tracks["displacement"].sel(node=node, axis=axis).values
            if np.isfinite(moved).any():
                curves.append(Curve(axis if several else "tracked", across, moved, dots=several))
        if truth is not None and node in truth:
            curves.append(Curve("true motion", across, truth[node]))
        charts.append(Chart(_LABELS[shown], ylabel, curves, _name(tracks, node)))
    return charts


def dimension(tracks: xr.Dataset) -> str:
    """Dimension along which pictures were taken."""
    return "photo" if "photo" in tracks.dims else "time"


def _name(tracks: xr.Dataset, node: int) -> str:
    """Title of a node's history, with the quality of its measurement."""
    name = f"node {node}: measured in {float(tracks['tracked'].sel(node=node)):.1%}"
    if "error" in tracks and np.isfinite(tracks["error"].sel(node=node)):
        name += f", standard error {1e6 * float(tracks['error'].sel(node=node)):.2g} µm"
    return name
