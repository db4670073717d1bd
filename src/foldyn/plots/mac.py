"""Picture of a MAC matrix: how alike the modes of two sets are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from foldyn.errors import InputError
from foldyn.plots import style

_SHADES = LinearSegmentedColormap.from_list("mac", ["#FFFFFF", "#9CC7E4", style.BLUE, "#00304A"])
_MOST_NUMBERS = 16  # rows or columns with which the numbers can be read
_CELL, _MARGIN, _BAR = 0.42, 1.1, 0.9  # inches


def plot_mac(
    mac: ArrayLike,
    rows: Sequence[str] | None = None,
    columns: Sequence[str] | None = None,
    row_title: str = "mode",
    column_title: str = "mode",
    title: str = "",
) -> Figure:
    """Draw a matrix of modal assurance criteria: 1 (dark) for equal shapes, 0 (white) for others.

    Parameters
    ----------
    mac : array_like, shape (a, b)
        Values from 0 to 1 of `foldyn.mac`: the rows are the modes of the first set.
    rows, columns : sequence of str, optional
        What is written at the rows and the columns; by default the numbers from 1 on.
    row_title, column_title : str
        Names of the two sets.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        The matrix, first mode at the top left, and the scale of its colors. Up to 16 rows and
        columns have the values in their cells.

    Raises
    ------
    InputError
        No matrix, values out of range, or labels that do not fit it.
    """
    values = np.asarray(mac, dtype=np.float64)
    if values.ndim != 2 or not values.size:
        raise InputError(f"mac: shape {values.shape}; give a matrix, one row per mode")
    if not (np.isfinite(values).all() and values.min() >= -1e-9 and values.max() <= 1.0 + 1e-9):
        raise InputError("mac: has values that are not between 0 and 1")
    labels = []
    for name, given, count in (("rows", rows, len(values)), ("columns", columns, values.shape[1])):
        labels.append([str(k + 1) for k in range(count)] if given is None else list(given))
        if len(labels[-1]) != count:
            raise InputError(f"{name}: {len(labels[-1])} labels for {count} modes; give one each")
    down, across = values.shape
    cell = min(_CELL, 6.0 / max(down, across))
    long = 0.07 * max(len(label) for label in labels[1]) > cell  # labels that would touch
    width, height = max(_MARGIN + _BAR + cell * across, 3.2), max(_MARGIN + cell * down, 2.2)
    figure = style.new_figure(width, height, title)
    axes = figure.subplots()
    image = axes.imshow(values, cmap=_SHADES, vmin=0.0, vmax=1.0, interpolation="nearest")
    style.frame(axes, column_title, row_title)
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(True)
    axes.set_xticks(range(across), labels[1], rotation=90 if long else 0)
    axes.set_yticks(range(down), labels[0])
    axes.tick_params(length=0.0)
    if max(down, across) <= _MOST_NUMBERS:
        for (row, column), value in np.ndenumerate(values):
            axes.text(
                column,
                row,
                f"{value:.2f}" if value >= 0.005 else "0",
                ha="center",
                va="center",
                fontsize=style.NOTE,
                color="white" if value > 0.5 else style.BLACK,
            )
    bar = figure.colorbar(image, ax=axes, fraction=0.08, shrink=0.9)
    bar.set_label("MAC", fontsize=style.LABEL, color=style.BLACK)
    bar.ax.tick_params(labelsize=style.TICK, labelcolor=style.BLACK, color=style.GRAY)
    bar.outline.set_visible(False)  # pyright: ignore[reportCallIssue]
    return style.finish(figure)
