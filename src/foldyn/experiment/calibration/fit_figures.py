"""Figures of a fit: charts of measurements, and the correlation of parameters."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from foldyn.cases import Case
from foldyn.experiment.calibration.fit_charts import charts_of
from foldyn.experiment.calibration.fitted import Fit
from foldyn.experiment.calibration.measured import Shapes
from foldyn.experiment.calibration.measurement import Measurement
from foldyn.experiment.calibration.modal import ModeShapes
from foldyn.plots import style
from foldyn.plots.chart_figures import figure_of

WIDTH = 9.0  # inches


def plot_measured(one: Measurement, result: xr.Dataset, case: Case, note: str = "") -> Figure:
    """Draw measurements and a result of the fitted model.

    Shapes are drawn in the plane of the two measured axes along which the nodes lie farthest apart,
    with the bars between measured nodes.
    """
    charts = charts_of(one, result, case)
    square = isinstance(one, Shapes | ModeShapes)
    columns = min(len(charts), 4 if square else 2)
    width = WIDTH if columns > 1 else 6.0
    height = 0.8 * width / columns if square else 2.4
    title = ", ".join([*([note] if note else []), *(["held out"] if one.held_out else [])])
    figure = figure_of(charts, (width, 0.8 + height * -(-len(charts) // columns)), title, columns)
    if not isinstance(one, Shapes):
        return figure
    place = {node: k for k, node in enumerate(one.where(case).tolist())}
    bars = [(place[a], place[b]) for a, b in case.structure.bars.tolist()
            if a in place and b in place]  # fmt: skip
    for frame, chart in zip(figure.axes, charts, strict=False):
        points = np.stack([chart.curves[0].x, chart.curves[0].y], axis=-1)
        frame.add_collection(LineCollection(list(points[bars]), colors=style.SKY, linewidths=0.8))
        frame.set_aspect("equal", adjustable="datalim")
        if chart.ylabel.startswith("x"):
            frame.invert_yaxis()  # pressed along x: drawn upright as in a test
    return figure


def plot_correlation(fit: Fit, note: str = "") -> Figure:
    """Draw the correlation of the parameters of a fit."""
    keys = [key.rsplit(".", 1)[-1] for key in fit.values]
    size = 1.2 + 0.6 * len(keys)
    figure = style.new_figure(size + 1.2, size, note)
    axes = figure.subplots()
    others = np.where(np.eye(len(keys)) > 0.0, 0.0, fit.correlation)
    axes.imshow(others, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    for (i, j), value in np.ndenumerate(others):
        text = "1" if i == j else "?" if np.isnan(value) else f"{value:.3f}"
        color = "white" if abs(value) > 0.6 else style.BLACK
        axes.text(j, i, text, ha="center", va="center", fontsize=style.LABEL, color=color)
    axes.set_xticks(range(len(keys)), keys, fontsize=style.TICK, rotation=20, ha="right")
    axes.set_yticks(range(len(keys)), keys, fontsize=style.TICK)
    axes.tick_params(length=0)
    return style.finish(figure)
