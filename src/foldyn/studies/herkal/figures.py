"""Figures of the case studies that are not those of any case file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from foldyn.plots import style

if TYPE_CHECKING:
    import xarray

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
