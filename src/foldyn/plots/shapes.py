"""Deformed sheets side by side, each over the undeformed one; among them the points of a path."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.plots import scene, style
from foldyn.plots.along import CRITICAL, check_path, displacements, evenly
from foldyn.plots.scene import Sheet3D, View
from foldyn.plots.sheet import DrawnSheet, add_undeformed, edge_keys, rest_keys
from foldyn.structures import Structure

_MARGIN = 0.15  # inches
_CAPTION, _LINE = 0.42, 0.16  # inches; the caption stands below its sheet, more lines take more
_TALLEST = 3.2  # inches


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
) -> tuple[Figure, list[DrawnSheet]]:
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

    Returns
    -------
    figure : Figure
        One orthographic view for each sheet, in the order of the shapes.
    sheets : list of DrawnSheet
        They can be moved within the extent that the figure was made for.
    """
    count = len(shapes)
    room = np.vstack([sheet.nodes, shapes.reshape(-1, 3) if extent is None else extent])
    seen = scene.Seen.of(room, view)
    keys = [*notes, *edge_keys(sheet, actuated=sheet.glows)]

    columns = min(count, most_columns)
    columns = -(-count // -(-count // columns))  # rows as full as can be
    rows = -(-count // columns)
    cell = width / columns
    flat = view.flat(room)
    low, size = flat.min(axis=0), np.ptp(flat, axis=0)
    inches = min((cell - 2 * _MARGIN) / size[0], _TALLEST / size[1])  # per meter
    aside = inches * (view.flat(seen.middle) - low - 0.5 * size)  # of the box from its contents
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
        sheets.append(DrawnSheet(axes, sheet, shape, view, actuated=sheet.glows))
        figure.text(
            middle / width,
            (floor - 0.08) / height,
            caption,
            ha="center",
            va="top",
            fontsize=style.LABEL,
            color=style.BLACK,
        )
    return style.finish(figure, keys, entries), sheets


def draw_shapes(
    case_or_structure: Case | Structure,
    path: xr.Dataset,
    points: int | Sequence[int] = 4,
    scale: float = 1.0,
    view: tuple[float, float] = (28.0, -60.0),
    title: str = "",
) -> Figure:
    """Draw the deformed sheet at points of a path, over the undeformed one in gray.

    All shapes are drawn at the same scale.

    Parameters
    ----------
    case_or_structure : Case or Structure
        What moves.
    path : xarray.Dataset
        A path of `foldyn.trace`.
    points : int or sequence of int
        How many points, spread evenly over the way of the nodes with the first and the last among
        them; or their numbers, negative ones from the end.
    scale : float
        Factor on the displacement in the picture.
    view : tuple of float
        Elevation above the xy plane and azimuth around z (degrees).
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        One orthographic view for each point; below it the number of the point, its load factor
        and what kind of point it is.

    Raises
    ------
    InputError
        A path of another structure, or no such point.
    """
    check_path(path, "path")
    sheet = Sheet3D.of(case_or_structure)
    numbers = chosen_points(path, points)
    moved = displacements(path)[numbers]
    sheet.check_nodes("path: it has", moved, "traced")
    captions = [describe_point(path, number) for number in numbers]
    notes = rest_keys(scale)
    return side_by_side(sheet, sheet.nodes + scale * moved, captions, View(*view), notes, title)[0]


def chosen_points(path: xr.Dataset, points: int | Sequence[int]) -> list[int]:
    """Numbers of points from 0 on, of a wanted count or of numbers, negative ones from the end."""
    count = path.sizes["step"]
    if isinstance(points, int | np.integer):
        if points < 1:
            raise InputError(f"points: {points}; give at least one")
        return evenly(path, int(points))
    for number in points:
        if not -count <= number < count:
            raise InputError(f"points: {number}; the path has points 0 to {count - 1}")
    if not len(points):
        raise InputError("points: empty; give at least one")
    return [int(number) % count for number in points]


def describe_point(path: xr.Dataset, number: int) -> str:
    """Text for a point: its number, load factor, and what is special about it."""
    point = path.isel(step=number)
    kind = str(point["point"].values)
    remark = CRITICAL.get(kind, "")
    if not remark and int(point["negative_eigenvalues"]) > 0:
        remark = "unstable"
    text = f"point {number}: load factor {float(point['load_factor']):.4g}"
    return f"{text}, {remark}" if remark else text
