"""Figures that only the case studies have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray
from matplotlib.figure import Figure

from foldyn.plots import style
from foldyn.studies.herkal.sheet_models import label
from foldyn.studies.herkal.variations import Variations

WIDTH, HEIGHT = 9.0, 3.4  # inches


def plot_statics(
    paths: Mapping[str, xarray.Dataset], nodes: Sequence[int], axis: str, force: float
) -> Figure:
    """Draw the force on each loaded node over the displacement of nodes, side by side.

    Parameters
    ----------
    paths : mapping of str to xarray.Dataset
        By label, a curve each.
    nodes : sequence of int
        A frame each.
    axis : {"x", "y", "z"}
    force : float
        Of the case, at load factor 1 (N).
    """
    figure = style.new_figure(WIDTH, HEIGHT)
    frames = figure.subplots(1, len(nodes), squeeze=False, sharey=True)[0]
    handles = []
    for frame, node in zip(frames, nodes, strict=True):
        first = node == nodes[0]
        style.frame(
            frame,
            f"{axis} displacement (m)",
            "force on each loaded node (N)" if first else "",
            f"node {node}",
        )
        for index, path in enumerate(paths.values()):
            moved = path["displacement"].sel(node=node, axis=axis).values
            look = style.line_style(index) | {"linewidth": 1.5}
            (line,) = frame.plot(moved, force * path["load_factor"].values, **look)
            if first:
                line.set_label(list(paths)[index])
                handles.append(line)
        frame.locator_params(axis="x", nbins=5)
        style.exponents(frame, ticks=6)
    style.legend_below(figure, handles, columns=3)
    return style.finish(figure)


SIDES = {"superlinear": (-0.3, style.BLUE), "linear": (0.08, style.ORANGE)}


def plot_sensitivity(
    found: Variations, models: Sequence[str], paper: Mapping[str, Mapping[str, float]]
) -> Figure:
    """Draw the errors under all combinations, a frame a case, a row a model.

    Parameters
    ----------
    found : Variations
    models : sequence of str
    paper : mapping
        The paper's errors by case and model.
    """
    cases = list(found.filed())
    figure = style.new_figure(WIDTH, 1.0 + 0.42 * len(models) * -(-len(cases) // 2))
    frames = figure.subplots(-(-len(cases) // 2), 2, squeeze=False, sharey=True, sharex=True)
    for frame, case in zip(frames.flat, cases, strict=False):
        style.frame(frame, "error", "", f"case {case[-1]}")
        filed = found.filed()[case]
        for place, model in enumerate(models):
            for law, (start, color) in SIDES.items():
                errors = [row[model] for row in found.chosen(case=case, bend_law=law)]
                heights = place + start + np.linspace(0.0, 0.22, len(errors))
                frame.plot(errors, heights, ".", color=color, markersize=3.5, label=f"{law} bends")
            ring = frame.plot(filed[model], place, "o", markersize=8, mfc="none", mec=style.BLACK)
            cross = frame.plot([], [], "x", color=style.VERMILLION, markersize=7, mew=1.8)
            if model in paper.get(case, {}):
                cross[0].set_data([paper[case][model]], [place])
            frame.axhline(place, color=style.LIGHT, linewidth=0.6, zorder=0)
        frame.set_yticks(range(len(models)), [label(m) for m in models], fontsize=style.TICK)
        frame.set_ylim(len(models) - 0.4, -0.6)
        frame.grid(False, axis="y")
    largest = max(row[model] for row in found.motions for model in models)
    frames.flat[0].set_xlim(0.0, 1.03 * largest)
    for spare in frames.flat[len(cases) :]:
        spare.set_visible(False)
    handles = [line for line in frames.flat[0].get_lines() if "bends" in str(line.get_label())][:2]
    ring[0].set_label("case files as they are")
    cross[0].set_label("paper")
    style.legend_below(figure, [*handles, ring[0], cross[0]], columns=4)
    return style.finish(figure)
