"""Figures of sweeps: maps, lines, main effects and Sobol indices of measures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.plots import style, sweep_charts
from foldyn.plots.chart_figures import figure_of
from foldyn.results.sweep_dataset import SobolIndices, is_grid, label, measured, parameters_of
from foldyn.values import choice

COLUMNS = 3
_SHADES = LinearSegmentedColormap.from_list("sweep", ["#FFFFFF", style.SKY, style.BLUE])
_FAILED: dict[str, Any] = {"marker": "x", "color": style.VERMILLION, "linestyle": "none"}


def plot_sweep_map(
    sweep: xr.Dataset,
    measure: str,
    *,
    x: str | None = None,
    y: str | None = None,
    at: Mapping[str, Any] | None = None,
    title: str = "",
) -> Figure:
    """Draw a measure in the plane of two parameters of a sweep, in shades with contour lines.

    Parameters
    ----------
    sweep : xarray.Dataset
        A result of `foldyn.sweep`.
    measure : str
        One of its variables.
    x, y : str, optional
        Parameters along the axes, by default the first two that `at` does not fix.
    at : mapping, optional
        Position along the measure's own dimensions, such as {"mode": 2}, by default the first; and
        the value of each further parameter of a grid.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        One axes and a color bar. Points that failed or lack the measure are crosses. Sampled points
        are shaded dots, without contour lines.

    Raises
    ------
    InputError
        `sweep` is not a sweep of two parameters, there is no such measure or parameter, or no point
        has a value.
    """
    found = measured(sweep, measure, at)
    first, second = _two(sweep, x, y, at)
    grid = is_grid(sweep)
    if grid:
        sweep_charts.check_left(found, (first, second))
    figure, axes = style.single((6.2, 4.4), title, label(sweep[first]), label(sweep[second]))
    axes.grid(False)
    across, down = _places(axes, sweep[first], "x"), _places(axes, sweep[second], "y")
    values = found.transpose(second, first).values if grid else found.values
    sweep_charts.check_some(values, measure)
    missing = ~np.isfinite(values)
    if grid:
        mesh = np.ma.masked_invalid(values)
        look = {"cmap": _SHADES, "shading": "nearest", "rasterized": True}
        drawn = axes.pcolormesh(across, down, mesh, **look)
        if min(values.shape) > 2 and np.ptp(mesh) > 0.0:
            lines = axes.contour(across, down, mesh, levels=6, colors=style.BLACK, linewidths=0.7)
            axes.clabel(lines, fontsize=style.NOTE, fmt=lambda value: f"{value:.4g}")
        across, down = np.meshgrid(across, down)
    else:
        look = {"c": values[~missing], "cmap": _SHADES, "s": 26.0, "edgecolors": style.GRAY}
        drawn = axes.scatter(across[~missing], down[~missing], linewidths=0.5, **look)
    axes.plot(across[missing], down[missing], **_FAILED)
    style.color_bar(figure, drawn, sweep_charts.named(found), ax=axes)
    return style.finish(figure, [style.key("no value", **_FAILED)] if missing.any() else ())


def plot_sweep_lines(
    sweep: xr.Dataset,
    measure: str,
    *,
    x: str | None = None,
    by: str | None = None,
    at: Mapping[str, Any] | None = None,
    title: str = "",
) -> Figure:
    """Draw a measure against one parameter of a sweep, a curve for each value of another one.

    Parameters
    ----------
    sweep : xarray.Dataset
        A result of `foldyn.sweep`.
    measure : str
        One of its variables.
    x : str, optional
        Parameter along the axis, by default the first that `at` does not fix.
    by : str, optional
        Parameter, or dimension of the measure such as "mode", with a curve for each value; by
        default the next parameter of a grid, if any.
    at : mapping, optional
        As in `plot_sweep_map`.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        One axes with at most 12 curves, spread over the values of `by`. Sampled points are dots.

    Raises
    ------
    InputError
        `sweep` is not a sweep, there is no such measure or parameter, no point has a value, or `at`
        does not name a further parameter of a grid.
    """
    return figure_of([sweep_charts.line_chart(sweep, measure, x, by, at)], (6.2, 4.0), title)


def plot_main_effects(
    sweep: xr.Dataset, measure: str, *, at: Mapping[str, Any] | None = None, title: str = ""
) -> Figure:
    """Draw the mean of a measure against each parameter of a sweep.

    Parameters
    ----------
    sweep, measure, at, title
        As in `plot_sweep_map`.

    Returns
    -------
    matplotlib.figure.Figure
        Axes for each parameter, with a common vertical axis: the mean over all other parameters,
        with a band of one standard deviation to either side. Sampled points are averaged in 8
        ranges of the parameter.

    Raises
    ------
    InputError
        As in `plot_sweep_map`.
    """
    charts = sweep_charts.effect_charts(sweep, measure, at)
    columns = min(COLUMNS, len(charts))
    size = 0.6 + 2.8 * columns, 0.5 + 2.6 * -(-len(charts) // columns)
    keys = [
        style.key("mean over everything else", color=style.BLUE, marker="o", markersize=3.0),
        style.key("standard deviation", color=style.SKY, alpha=0.3, linewidth=6.0),
    ]
    return style.finish(figure_of(charts, size, title, columns, legend=0, sharey=True), keys)


def plot_sobol_indices(indices: SobolIndices, title: str = "") -> Figure:
    """Draw the shares of a measure's variance due to each parameter.

    Parameters
    ----------
    indices : SobolIndices
        From `foldyn.results.sobol_indices`.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Two bars for each parameter, with intervals: its share alone, and with interactions.

    Raises
    ------
    InputError
        The input is not Sobol indices.
    """
    if not isinstance(indices, SobolIndices):
        raise InputError("indices: give what foldyn.results.sobol_indices returns")
    places = np.arange(len(indices.names))
    size = max(3.6, 1.2 + 0.9 * len(places)), 3.4
    figure, axes = style.single(size, title, "", "share of the variance")
    keys = []
    for k, (name, values, interval, color) in enumerate((
        ("alone (first order)", indices.first, indices.first_interval, style.BLUE),
        ("with interactions (total)", indices.total, indices.total_interval, style.ORANGE),
    )):  # fmt: skip
        at = places + 0.38 * (k - 0.5)
        axes.bar(at, values, width=0.34, color=color)
        reach = np.abs(np.clip(interval.T - values, [[-np.inf], [0.0]], [[0.0], [np.inf]]))
        axes.errorbar(at, values, yerr=reach, fmt="none", ecolor=style.BLACK, elinewidth=1.0,
                      capsize=3.0)  # fmt: skip
        keys.append(style.key(name, color=color, linewidth=6.0))
    words = [name.replace("_", " ") for name in indices.names]
    long = max(map(len, words)) > 12 and len(words) > 2
    axes.set_xticks(places, words, rotation=25 if long else 0, ha="right" if long else "center")
    axes.axhline(0.0, color=style.GRAY, linewidth=0.8)
    axes.set_ylim(top=max(1.02, axes.get_ylim()[1]))
    return style.finish(figure, keys)


def _two(
    sweep: xr.Dataset, x: str | None, y: str | None, at: Mapping[str, Any] | None
) -> tuple[str, str]:
    """Parameters along both axes."""
    names = [name for name in parameters_of(sweep) if name not in (at or {})]
    for name, given in (("x", x), ("y", y)):
        if given is not None:
            choice(name, given, names)
    left = [name for name in names if name not in (x, y)]
    chosen = [given if given is not None else (left.pop(0) if left else "") for given in (x, y)]
    if "" in chosen or chosen[0] == chosen[1]:
        raise InputError(
            f"sweep: a map needs two parameters, and there are {', '.join(names) or 'none'}; draw "
            "lines of one"
        )
    return chosen[0], chosen[1]


def _places(axes: Axes, one: xr.DataArray, which: Literal["x", "y"]) -> NDArray:
    """Coordinates of a parameter's values along an axis; also sets the axis's ticks or scale."""
    values, words = sweep_charts.places(one.values)
    if words:
        getattr(axes, f"set_{which}ticks")(range(len(words)), words)
    elif sweep_charts.by_ratio(values):
        getattr(axes, f"set_{which}scale")("log")
    else:
        style.exponents(axes, which=which)
    return values
