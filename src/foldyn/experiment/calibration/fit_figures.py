"""Figures of a fit: what was measured beside what the model says, and how parameters hang together.

The page of `foldyn fit` has the same as charts.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.cases.directions import AXES
from foldyn.errors import InputError
from foldyn.experiment.calibration.fitted import Fit
from foldyn.experiment.calibration.histories import Spectrum, TimeHistory
from foldyn.experiment.calibration.measured import (
    MOST,
    ForceDisplacement,
    Shapes,
    dense_curve,
    picture_plane,
)
from foldyn.experiment.calibration.measurement import Measurement
from foldyn.experiment.calibration.modal import ModeShapes
from foldyn.experiment.calibration.responses import FrequencyResponse
from foldyn.plots import style

WIDTH = 9.0  # inches


def plot_measured(one: Measurement, result: Any, case: Case) -> Figure:
    """Draw what was measured beside a result of the fitted model."""
    if isinstance(one, ForceDisplacement):
        curve = dense_curve(one)
        return plot_forces(one, (curve.displacement, curve.predicted(result, case)))
    if isinstance(one, Shapes):
        return plot_shapes(one, case, one.shapes(result, case))
    if isinstance(one, TimeHistory):
        return plot_histories(one, case, one.curves(result, case))
    if isinstance(one, Spectrum):
        return plot_spectra(one, case, one.spectra(result, case))
    if isinstance(one, ModeShapes):
        return plot_mode_shapes(one, one.shapes(result, case))
    if isinstance(one, FrequencyResponse):
        return plot_responses(one, case, one.curves(result, case))
    raise InputError(f"{one.name}: there is no figure of a {one.kind}")


def plot_forces(
    one: ForceDisplacement, curve: tuple[NDArray[np.float64], NDArray[np.float64]]
) -> Figure:
    """Draw measured forces over displacements, on the curve of the fitted model.

    Parameters
    ----------
    one : ForceDisplacement
    curve : (ndarray, ndarray)
        Displacements (m) and forces (N) of the model.
    """
    figure = style.new_figure(6.0, 3.8)
    axes = figure.subplots()
    title = f"{one.name}, held out" if one.held_out else ""
    style.frame(axes, f"{one.axis} displacement (mm)", f"{one.axis} force (N)", title)
    axes.plot(1e3 * curve[0], curve[1], color=style.BLUE, linewidth=1.5, label="model")
    axes.errorbar(
        1e3 * one.displacement, one.force, yerr=one.sigma, fmt="o", markersize=5,
        color=style.VERMILLION, capsize=3, linestyle="none", label=one.label,
    )  # fmt: skip
    axes.set_ylim(bottom=min(0.0, *axes.get_ylim()))
    axes.legend(fontsize=style.TICK, frameon=False)
    return style.finish(figure)


def plot_shapes(one: Shapes, case: Case, model: NDArray[np.float64]) -> Figure:
    """Draw measured points and those of the model, a frame for each load factor.

    The plane is that of the two measured axes along which the nodes lie farthest apart; lines are
    bars of the structure between measured nodes.

    Parameters
    ----------
    one : Shapes
        Of at least two axes.
    case : Case
        Of the fitted model.
    model : ndarray, shape (s, m, a)
        As `Shapes.shapes` gives it.
    """
    nodes = one.where(case)
    across, up = picture_plane(one, case)
    rest = case.structure.nodes[nodes]
    letters = [AXES.index(axis) for axis in one.axes]
    origin = rest[:, letters] if one.quantity == "displacement" else 0.0
    steps = np.linspace(0, len(one.load_factor) - 1, min(MOST, len(one.load_factor))).astype(int)
    span = [np.ptp((model + origin)[..., k]) for k in (across, up)]
    shape = min(max(span[1] / span[0], 0.3), 1.6) if span[0] > 0.0 else 1.6
    columns = min(len(steps), 4)
    figure, frames = _frames(len(steps), columns, WIDTH / columns * shape + 0.6, 0.5, sharey=True)
    place = {int(node): k for k, node in enumerate(nodes)}
    bars = [(place[a], place[b]) for a, b in case.structure.bars.tolist()
            if a in place and b in place]  # fmt: skip
    for index, (frame, step) in enumerate(zip(frames, steps, strict=True)):
        left = f"{one.axes[up]} (mm)" if index % columns == 0 else ""
        title = f"load factor {one.load_factor[step]:.3g}"
        style.frame(frame, f"{one.axes[across]} (mm)", left, title)
        there, seen = 1e3 * (model[step] + origin), 1e3 * (one.values[step] + origin)
        for a, b in bars:
            ends = there[[a, b]]
            frame.plot(ends[:, across], ends[:, up], color=style.SKY, linewidth=0.8, zorder=1)
        frame.plot(there[:, across], there[:, up], ".", color=style.BLUE, label="model")
        frame.plot(
            seen[:, across], seen[:, up], "o", markersize=6, mfc="none", color=style.VERMILLION,
            label=one.label,
        )  # fmt: skip
        frame.set_aspect("equal")
    if one.axes[up] == "x" and not frames[0].yaxis_inverted():
        frames[0].invert_yaxis()  # pressed along x: as it stands in a test
    handles, _ = frames[0].get_legend_handles_labels()
    style.legend_below(figure, handles[-2:], columns=2)
    return style.finish(figure)


def plot_histories(one: TimeHistory, case: Case, model: NDArray[np.float64]) -> Figure:
    """Draw measured histories, those of the model and the differences, without trend.

    Parameters
    ----------
    one : TimeHistory
    case : Case
    model : ndarray, shape (t, m)
        As `TimeHistory.curves` gives it.
    """
    measured, model = one.values - one.trend(one.values), model - one.trend(model)
    labels = "time (s)", f"{one.axis} displacement (mm)"
    return _beside(one, one.where(case), one.time, measured, model, labels, model - measured)


def plot_spectra(one: Spectrum, case: Case, model: NDArray[np.float64]) -> Figure:
    """Draw measured amplitude spectra beside those of the model; arguments as `plot_histories`."""
    labels = "frequency (Hz)", f"{one.axis} amplitude (mm)"
    return _beside(one, one.where(case), one.frequency, one.values, model, labels)


def plot_mode_shapes(one: ModeShapes, model: NDArray[np.float64]) -> Figure:
    """Draw components of measured shapes over those of the model, a frame for each mode.

    Parameters
    ----------
    one : ModeShapes
    model : ndarray, shape (k, m, a)
        As `ModeShapes.shapes` gives it.
    """
    shown = one.mode[:MOST].tolist()
    columns = min(len(shown), 4)
    figure, frames = _frames(len(shown), columns, WIDTH / columns, 0.3)
    for frame, mode, seen, said in zip(frames, shown, one.values, model, strict=False):
        style.frame(frame, "component, model", f"component, {one.label}", f"mode {mode}")
        frame.axline((0.0, 0.0), slope=1.0, color=style.GRAY, linewidth=0.8)
        frame.errorbar(
            said.ravel(), seen.ravel(), yerr=one.sigma, fmt="o", markersize=4, linestyle="none",
            color=style.VERMILLION,
        )  # fmt: skip
    return style.finish(figure)


def plot_responses(one: FrequencyResponse, case: Case, model: NDArray) -> Figure:
    """Draw magnitudes of measured responses beside those of the model, a frame for each node.

    Parameters
    ----------
    one : FrequencyResponse
    case : Case
    model : ndarray, shape (f, m)
        As `FrequencyResponse.curves` gives it.
    """
    nodes = one.where(case)[:MOST].tolist()
    columns = min(len(nodes), 2)
    figure, frames = _frames(len(nodes), columns, 2.9, 0.8)
    unit = f" ({one.unit})" if one.unit else ""
    lines = []
    for k, (frame, node) in enumerate(zip(frames, nodes, strict=True)):
        title = f"node {node}" + (", held out" if one.held_out else "")
        style.frame(frame, "frequency (Hz)", f"{one.axis} {one.quantity}{unit}", title)
        mark = {"marker": ".", "markersize": 4.0, "linestyle": "none", "label": one.label}
        lines = frame.semilogy(
            one.frequency, np.abs(one.values[:, k]), color=style.VERMILLION, **mark
        )
        lines += frame.semilogy(
            one.frequency, np.abs(model[:, k]), color=style.BLUE, lw=1.2, label="model"
        )
    style.legend_below(figure, lines, columns=2)
    return style.finish(figure)


def plot_correlation(fit: Fit) -> Figure:
    """Draw the correlation of the parameters of a fit."""
    keys = [key.rsplit(".", 1)[-1] for key in fit.values]
    size = 1.2 + 0.6 * len(keys)
    figure = style.new_figure(size + 1.2, size)
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


def _beside(
    one: TimeHistory | Spectrum,
    nodes: NDArray[np.int64],
    along: NDArray[np.float64],
    measured: NDArray[np.float64],
    model: NDArray[np.float64],
    labels: Sequence[str],
    misfit: NDArray[np.float64] | None = None,
) -> Figure:
    """Curves of nodes, a frame each: measured, of the model, and the misfit."""
    shown = nodes[:MOST]
    columns = min(len(shown), 2)
    figure, frames = _frames(len(shown), columns, 2.9 if len(shown) <= columns else 2.2, 0.8)
    lines = []
    for k, (frame, node) in enumerate(zip(frames, shown, strict=True)):
        below = labels[0] if k >= len(shown) - columns else ""
        title = f"node {node}" + (", held out" if one.held_out else "")
        style.frame(frame, below, labels[1] if k % columns == 0 else "", title)
        mark = {"marker": ".", "markersize": 3.0, "linestyle": "none"}
        lines = frame.plot(along, 1e3 * measured[:, k], color=style.VERMILLION, **mark)
        lines[0].set_label(one.label)
        lines += frame.plot(along, 1e3 * model[:, k], color=style.BLUE, lw=1.2, label="model")
        if misfit is not None:
            label = f"model minus {one.label}"
            lines += frame.plot(along, 1e3 * misfit[:, k], color=style.GRAY, lw=0.8, label=label)
        frame.locator_params(axis="y", nbins=6)
    style.legend_below(figure, lines, columns=3)
    return style.finish(figure)


def _frames(
    count: int, columns: int, height: float, rest: float, sharey: bool = False
) -> tuple[Figure, list[Axes]]:
    """A figure of so many frames; each row has a height (inches), legend and title the rest."""
    rows = -(-count // columns)
    figure = style.new_figure(WIDTH, rows * height + rest)
    frames = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=sharey).ravel()
    for frame in frames[count:]:
        frame.set_visible(False)
    return figure, list(frames[:count])
