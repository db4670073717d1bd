"""Paths: load against displacement with stability, and deformed shapes along paths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.plots import readings, style
from foldyn.plots.scene import Sheet3D, View
from foldyn.plots.sheet import rest_keys, side_by_side
from foldyn.structures import Structure

_UNSTABLE = (0, (4, 2))
_MARKS: Mapping[str, dict[str, Any]] = {
    "limit": {"marker": "o", "markersize": 5.0},
    "bifurcation": {"marker": "D", "markersize": 5.0, "markerfacecolor": "white"},
}
_BAR = {"marker": "|", "markersize": 10.0}


def plot_load_displacement(
    paths: xr.Dataset | Mapping[str, xr.Dataset],
    nodes: int | str | Sequence[int],
    *,
    direction: str | None = None,
    title: str = "",
) -> Figure:
    """Draw the load factor against the displacement of chosen nodes.

    Solid lines are stable, dashed lines unstable (the tangent has negative eigenvalues with the
    supports held in place). Limit points are dots, bifurcations diamonds. A critical point that
    could not be located is drawn as a bar along its interval of load factors.

    Parameters
    ----------
    paths : xarray.Dataset, or mapping of str to xarray.Dataset
        A path of `foldyn.trace`, or several by their labels.
    nodes : int, sequence of int, or str
        Nodes to show, a curve each; a selection ("xmax") means vertices of the pattern.
    direction : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Direction of the displacement; by default the direction in which the nodes move farthest.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        One axes. The stretches of a curve follow each other as lines; the first of them has the
        curve's label.

    Raises
    ------
    InputError
        There is no path or no node, a path lacks a node, or the direction does not exist.
    """
    paths = readings.by_label("paths", paths)
    numbers, direction = readings.asked(paths, nodes, direction)
    curves = []
    for label, path in paths.items():
        for node in numbers:
            parts = [label] if len(paths) > 1 else []
            parts += [f"node {node}"] if len(numbers) > 1 else []
            x, factor = readings.along(path, [node], direction), path["load_factor"].values
            curves.append(_Curve(", ".join(parts), x, factor, path, readings.is_loose(path)))
    of = f" of node {numbers[0]}" if len(numbers) == 1 else ""
    return _draw(curves, title, f"displacement{of} along {direction} (m)", "load factor")


def plot_reaction(
    paths: xr.Dataset | Mapping[str, xr.Dataset],
    nodes: int | str | Sequence[int],
    *,
    direction: str | None = None,
    title: str = "",
) -> Figure:
    """Draw the total force of supports against the displacement that they impose.

    Solid lines are stable, dashed lines unstable, both with the supports held in place; limit
    points are dots, bifurcations diamonds.

    Parameters
    ----------
    paths : xarray.Dataset, or mapping of str to xarray.Dataset
        A path of `foldyn.trace`, or several by their labels; each is a curve.
    nodes : int, sequence of int, or str
        Supported nodes, or a selection ("xmax"). The sum of their reactions is drawn against their
        mean displacement.
    direction : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Direction of force and displacement; by default the direction in which the nodes move
        farthest.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        One axes. The stretches of a curve follow each other as lines; the first of them has the
        curve's label.

    Raises
    ------
    InputError
        There is no path or no node, a path lacks a node or does not support it along the direction,
        or the direction does not exist.
    """
    paths = readings.by_label("paths", paths)
    numbers, direction = readings.asked(paths, nodes, direction)
    curves = []
    for label, path in paths.items():
        x = readings.along(path, numbers, direction)
        force = readings.total_reaction(path, numbers, direction=direction)
        curves.append(_Curve(label if len(paths) > 1 else "", x, force, path))
    xlabel = f"imposed displacement along {direction} (m)"
    return _draw(curves, title, xlabel, f"force along {direction} (N)")


class _Curve(NamedTuple):
    """A path to draw, and its name."""

    label: str
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    path: xr.Dataset
    loose: NDArray[np.bool_] | bool = False  # points drawn with their interval of load factors


def _draw(curves: list[_Curve], title: str, xlabel: str, ylabel: str) -> Figure:
    """Draw curves, with a legend of the marks that occur."""
    figure, axes = style.single((6.5, 4.4), title, xlabel, ylabel)
    axes.axhline(0.0, color=style.GRAY, linewidth=0.6, zorder=1)
    keys = []
    for index, curve in enumerate(curves):
        color = style.CYCLE[index % len(style.CYCLE)]
        _draw_curve(axes, curve, color, 2.0 + 0.01 * index)
        if curve.label:
            keys.append(style.key(curve.label, color=color, linewidth=1.4))
    gray: dict[str, Any] = {"color": style.GRAY, "linewidth": 1.4}
    if any(not stretch.stable for curve in curves for stretch in readings.stretches(curve.path)):
        keys.append(style.key("stable", **gray))
        keys.append(style.key("unstable", **gray, linestyle=_UNSTABLE))
    for kind, name in readings.CRITICAL.items():
        if any((curve.path["point"].values == kind).any() for curve in curves):
            keys.append(style.key(name, color=style.GRAY, linestyle="none", **_MARKS[kind]))
    if any(np.any(curve.loose) for curve in curves):
        keys.append(style.key("where it lies", color=style.GRAY, linestyle="none", **_BAR))
    style.exponents(axes)
    axes.ticklabel_format(axis="x", scilimits=(-4, 4), useMathText=True)
    axes.xaxis.get_offset_text().set(fontsize=style.TICK, color=style.BLACK)
    return style.finish(figure, keys, 4, figure.get_figwidth())


def _draw_curve(axes: Axes, curve: _Curve, color: str, zorder: float) -> None:
    """Draw the stretches of a curve and its critical points."""
    label, x, y, path, loose = curve
    for number, (start, stop, stable) in enumerate(readings.stretches(path)):
        part = slice(start, stop + 1)
        look: dict[str, Any] = {"color": color, "linewidth": 1.4, "zorder": zorder}
        name = label if number == 0 and label else f"_{label}{number}"
        axes.plot(x[part], y[part], linestyle="solid" if stable else _UNSTABLE, label=name, **look)
    if len(x) == 1:  # a single point has no line
        axes.plot(x, y, marker=".", color=color, label=label)
    for kind, mark in _MARKS.items():
        at = path["point"].values == kind
        if at.any():
            look = {"linestyle": "none", "color": color, "zorder": 3.0, **mark}
            axes.plot(x[at], y[at], label=f"_{kind}", **look)
    if np.any(loose):
        low, high = path["interval"].transpose("end", "step").values[:, loose]
        ends = np.concatenate([low, high])
        axes.vlines(x[loose], low, high, color=color, linewidth=1.4, zorder=3.0)
        axes.plot(np.tile(x[loose], 2), ends, "_", color=color, markersize=8.0, label="_interval")


@readings.case_from_result
def draw_shapes(
    case_or_structure: Case | Structure,
    path: xr.Dataset,
    *,
    points: int | Sequence[int] = 4,
    scale: float = 1.0,
    view: tuple[float, float] = (28.0, -60.0),
    title: str = "",
) -> Figure:
    """Draw the deformed sheet at points of a path, with the undeformed sheet behind it in gray.

    All shapes are drawn at the same scale.

    Parameters
    ----------
    case_or_structure : Case or Structure
        The structure that moves; by default from the path: ``draw_shapes(path)``.
    path : xarray.Dataset
        A path of `foldyn.trace`.
    points : int or sequence of int
        Number of points, evenly spread over the distance that the nodes travel, including the first
        and the last; or the numbers of the points, where negative numbers count from the end.
    scale : float
        Factor on the displacement in the picture.
    view : tuple of float
        Elevation above the xy plane and azimuth around z (degrees).
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        One orthographic view for each point, with the number, load factor and kind of the point
        below it.

    Raises
    ------
    InputError
        The path belongs to another structure, or a point does not exist.
    """
    readings.check_path(path, "path")
    sheet = Sheet3D.of(case_or_structure)
    numbers = readings.chosen_points(path, points)
    moved = readings.displacements(path)[numbers]
    sheet.check_nodes("path: it has", moved, "traced")
    captions = [describe_point(path, number) for number in numbers]
    notes = rest_keys(scale)
    return side_by_side(sheet, sheet.nodes + scale * moved, captions, View(*view), notes, title)[0]


def describe_point(path: xr.Dataset, number: int) -> str:
    """Text for a point: its number, load factor, and kind if critical."""
    point = path.isel(step=number)
    remark = readings.critical_word(path, number)
    if not remark and int(point["negative_eigenvalues"]) > 0:
        remark = "unstable"
    text = f"point {number}: load factor {float(point['load_factor']):.4g}"
    return f"{text}, {remark}" if remark else text
