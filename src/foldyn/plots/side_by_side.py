"""Several deformed sheets side by side, each over the undeformed one, all at one scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from foldyn.plots import scene, style
from foldyn.plots.scene import Sheet3D, View
from foldyn.plots.sheet import DrawnSheet, add_undeformed, edge_keys

_MARGIN = 0.15  # inches
_CAPTION, _LINE = 0.42, 0.16  # inches; the caption stands below its sheet, more lines take more
_TALLEST = 3.2  # inches


@dataclass(frozen=True)
class SideBySide:
    """A figure of several sheets.

    Attributes
    ----------
    figure : Figure
        One orthographic view for each sheet, in the order of the shapes.
    sheets : list of DrawnSheet
        They can be moved within the extent that the figure was made for.
    """

    figure: Figure
    sheets: list[DrawnSheet]


def side_by_side(
    sheet: Sheet3D,
    shapes: NDArray[np.float64],
    captions: Sequence[str],
    view: View,
    notes: Sequence[Line2D] = (),
    title: str = "",
    extent: NDArray[np.float64] | None = None,
    width: float = 9.0,
    most_columns: int = 3,
) -> SideBySide:
    """Draw a sheet in several positions, over where its nodes are in gray.

    Parameters
    ----------
    sheet : Sheet3D
        The sheet; its `nodes` are the gray ones.
    shapes : ndarray, shape (k, n, 3)
        Positions of its nodes (m).
    captions : sequence of str
        What stands below each shape, all of as many lines as the longest.
    view : View
    notes : sequence of Line2D
        Legend entries that come before those of the edges.
    title : str
        Title of the figure.
    extent : ndarray, shape (p, 3), optional
        Points (m) that every view has room for, beside the gray nodes; by default the shapes.
    width : float
        Width of the figure (inches).
    most_columns : int
        Shapes in a row at most.
    """
    sight, count = view, len(shapes)
    room = np.vstack([sheet.nodes, shapes.reshape(-1, 3) if extent is None else extent])
    seen = scene.Seen.of(room, sight)
    keys = [*notes, *edge_keys(sheet, actuated=sheet.glows)]

    columns = min(count, most_columns)
    columns = -(-count // -(-count // columns))  # rows as full as can be
    rows = -(-count // columns)
    cell = width / columns
    flat = sight.flat(room)
    low, size = flat.min(axis=0), np.ptp(flat, axis=0)
    inches = min((cell - 2 * _MARGIN) / size[0], _TALLEST / size[1])  # per meter
    aside = inches * (sight.flat(seen.middle) - low - 0.5 * size)  # of the box from its contents
    below = _CAPTION + _LINE * max(caption.count("\n") for caption in captions)
    top = 0.42 if title else 0.1
    entries = style.columns_that_fit(keys, width, 4)
    bottom = 0.12 + 0.19 * -(-len(keys) // entries)
    step = size[1] * inches + below
    figure = style.new_figure(width, top + rows * step + bottom, title, constrained=False)
    height = figure.get_figheight()
    sheets = []
    for place, (caption, shape) in enumerate(zip(captions, shapes, strict=True)):
        row, column = divmod(place, columns)
        here = min(columns, count - row * columns)  # the last row stands in the middle
        middle = width / 2 + (column - 0.5 * (here - 1)) * cell
        floor = height - top - (row + 1) * step + below
        center = middle + aside[0], floor + 0.5 * size[1] * inches + aside[1]
        axes = scene.add_view(figure, seen, center, inches)
        axes.set_axis_off()
        add_undeformed(axes, sheet)
        sheets.append(DrawnSheet(axes, sheet, shape, sight, actuated=sheet.glows))
        figure.text(
            middle / width,
            (floor - 0.08) / height,
            caption,
            ha="center",
            va="top",
            fontsize=style.LABEL,
            color=style.BLACK,
        )
    style.legend_below(figure, keys, entries)
    return SideBySide(style.finish(figure), sheets)
