"""Displacement histories and their frequency content, several motions in one frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.plots.chart_figures import figure_of
from foldyn.plots.charts import Chart, Curve
from foldyn.plots.readings import AXES, by_label, check_nodes_of, directions
from foldyn.signals import sampling_interval, spectrum
from foldyn.values import number

VISIBLE = 0.02  # smaller shares of a curve's height count as invisible
ROUND = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)


def plot_history(
    trajectories: xr.Dataset | Mapping[str, xr.Dataset],
    nodes: int | str | Sequence[int],
    *,
    axes: str | Sequence[str] | None = None,
    max_frequency: float | None = None,
    title: str = "",
    window: str | None = None,
    detrend: str | None = None,
) -> Figure:
    """Draw the motion of chosen nodes: history on the left, frequency content on the right.

    One row per node; every trajectory is one curve in each frame.

    Parameters
    ----------
    trajectories : xarray.Dataset, or mapping of str to xarray.Dataset
        A trajectory, or several by their labels, for example one per mass rule; each with
        ``displacement`` (time, node, axis) in m at evenly spaced times. Intervals and lengths may
        differ between them.
    nodes : int, sequence of int, or str
        Nodes to show, one row for each; a selection ("xmax") means vertices of the pattern.
    axes : str, sequence of str, or None
        Direction shown: one of "x", "y", "z" for all nodes, or one for each node (a sequence of
        length one serves all). None: the direction in which each node moves most.
    max_frequency : float or None
        Upper end of the frequency axis (Hz). None: a round number above the last frequency at which
        any curve of a node has 2 % of the height of that node's highest curve; at most half the
        smallest sampling frequency.
    title : str
        Title of the figure.
    window, detrend : str or None
        Passed to `foldyn.signals.spectrum`; by default the record is transformed unchanged.

    Returns
    -------
    matplotlib.figure.Figure
        Axes in the order history, content, history, content ... from the first node down.

    Raises
    ------
    InputError
        There is no trajectory or no node, a result is no motion, a trajectory lacks a node or
        direction, times are uneven, or a displacement contains NaN.
    """
    trajectories = by_label("trajectories", trajectories)
    for one in trajectories.values():
        if "displacement" not in one or "time" not in one["displacement"].dims:
            raise InputError(
                ": one of them is not a motion; give results of fd.simulate", "trajectories"
            )
    numbers = check_nodes_of(trajectories, nodes)
    moved = {
        label: one["displacement"].transpose("time", ...).sel(node=numbers, axis=list(AXES)).values
        for label, one in trajectories.items()
    }
    chosen = directions(axes, len(numbers), moved.values())
    times = {label: dataset["time"].values for label, dataset in trajectories.items()}
    intervals = {label: sampling_interval(time) for label, time in times.items()}
    if max_frequency is not None:
        number("max_frequency", max_frequency, above=0.0, unit="Hz")
    rows = len(numbers)
    contents = {
        (label, row): spectrum(
            moved[label][:, row, AXES.index(direction)], intervals[label], window=window,
            detrend=detrend,
        )
        for label in times
        for row, direction in enumerate(chosen)
    }  # fmt: skip
    nyquist = 0.5 / max(intervals.values())
    largest = [max(contents[label, row][1][1:].max() for label in times) for row in range(rows)]
    reach = max(_reach(*content, largest[row]) for (_, row), content in contents.items())
    highest = max_frequency or min(nyquist, reach) or nyquist

    charts = []
    for row, (node, direction) in enumerate(zip(numbers, chosen, strict=True)):
        axis = AXES.index(direction)
        motions = [Curve(label, time, moved[label][:, row, axis]) for label, time in times.items()]
        spectra = []
        for label in times:
            frequencies, amplitude = contents[label, row]
            shown = frequencies <= highest * (1.0 + 1e-9)
            spectra.append(Curve(label, frequencies[shown], amplitude[shown]))
        charts.append(Chart("time (s)", f"{direction} displacement (m)", motions, f"node {node}"))
        charts.append(Chart("frequency (Hz)", "amplitude (m)", spectra, f"node {node}"))
    widths = {"width_ratios": [1.45, 1.0]}
    size = 9.0, 1.15 + 1.75 * rows
    figure = figure_of(charts, size, title, 2, legend=5, sharex="col", gridspec_kw=widths)
    for right in figure.axes[1::2]:
        right.set_xlim(0.0, highest)
        right.set_ylim(bottom=0.0)
    return figure


def _reach(
    frequencies: NDArray[np.float64], amplitude: NDArray[np.float64], largest: float
) -> float:
    """A round number (Hz) above the frequencies with a visible amplitude; or 0."""
    visible = (amplitude >= VISIBLE * largest) & (amplitude > 0.0) & (frequencies > 0.0)
    seen = np.flatnonzero(visible)
    if not seen.size:
        return 0.0
    end = frequencies[seen[-1]]
    decade = 10.0 ** np.floor(np.log10(end))
    return float(decade * next(step for step in ROUND if step * decade >= end))
