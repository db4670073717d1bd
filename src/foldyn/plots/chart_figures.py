"""Charts as figures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from foldyn.plots import style
from foldyn.plots.charts import Chart, Curve

TIME = "time (s)"
# Most points of a line with markers, if no other curve has dots; more dots are drawn smaller.
FEW = 60


def figure_of(
    charts: Sequence[Chart],
    size: tuple[float, float],
    title: str = "",
    columns: int = 1,
    legend: int = 3,
    **grid: Any,
) -> Figure:
    """Draw charts, `columns` of them in a row, with one legend below them.

    Parameters
    ----------
    charts : sequence of Chart
        Curves of the same name look alike in all charts.
    size : tuple of float
        Width and height of the figure (inches).
    title : str
        Title of the figure.
    columns : int
    legend : int
        Largest number of columns of the legend; 0 draws no legend.
    **grid
        Arguments of `Figure.subplots`: "sharex", "sharey".
    """
    figure = style.new_figure(*size, title)
    frames = figure.subplots(-(-len(charts) // columns), columns, squeeze=False, **grid)
    keys: dict[str, Line2D] = {}
    for k, (axes, chart) in enumerate(zip(frames.flat, charts, strict=False)):
        below, left = k + columns >= len(charts), k % columns == 0
        across = chart.xlabel if below or not grid.get("sharex") else ""
        upward = chart.ylabel if left or not grid.get("sharey") else ""
        style.frame(axes, across, upward, chart.title)
        draw(axes, chart, keys if legend else {})
    for spare in frames.flat[len(charts) :]:
        spare.set_visible(False)
    for column in frames.T:
        figure.align_ylabels(list(column))
    told = [line for name, line in keys.items() if name] if legend else []
    return style.finish(figure, told, legend, size[0] - 0.3)


def draw(axes: Axes, chart: Chart, keys: dict[str, Line2D]) -> None:
    """Draw a chart's curves into axes, and add their lines to `keys`, which holds lines by name."""
    alone = not any(curve.dots for curve in chart.curves)
    for curve in chart.curves:
        names = list(keys)
        look = style.line_style(names.index(curve.name) if curve.name in keys else len(names))
        keys[curve.name] = _curve(axes, curve, look, alone)
    if chart.zero:
        axes.axhline(0.0, color=style.GRAY, linewidth=0.8, zorder=1)
    if chart.words:
        axes.set_xticks(range(len(chart.words)), chart.words)
    elif chart.by_ratio:
        axes.set_xscale("log")
    else:
        style.exponents(axes, 8, "x")
    if chart.xlabel == TIME:
        axes.margins(x=0.0)
    if chart.reach:
        axes.set_ylim(-chart.reach, chart.reach)
    style.exponents(axes)


def _curve(axes: Axes, curve: Curve, look: dict[str, Any], alone: bool) -> Line2D:
    x, y = np.asarray(curve.x, float), np.asarray(curve.y, float)
    if curve.dots:
        size = 4.5 if len(x) <= FEW else 2.5
        look |= {"linestyle": "none", "marker": "o", "markersize": size, "zorder": 1.9}
        look |= {"markerfacecolor": "none"}
    elif alone and len(x) <= FEW:
        look |= {"marker": "o", "markersize": 3.0}
    if curve.spread is not None and curve.dots:
        bars = {"fmt": "none", "ecolor": look["color"], "capsize": 2.5, "elinewidth": 0.8}
        axes.errorbar(x, y, yerr=curve.spread, **bars)
    elif curve.spread is not None:
        band = {"color": style.SKY, "alpha": 0.3, "linewidth": 0.0}
        axes.fill_between(x, y - curve.spread, y + curve.spread, **band)
    (line,) = axes.plot(x, y, label=curve.name, **look)
    return line
