"""Load against displacement along paths, with their stability."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.cases.supports import signed
from foldyn.errors import InputError
from foldyn.plots import style
from foldyn.plots.along import CRITICAL, along, asked, check_paths, runs
from foldyn.plots.chosen import AXES

_UNSTABLE = (0, (4, 2))
_MARKS: Mapping[str, dict[str, Any]] = {
    "limit": {"marker": "o", "markersize": 5.0},
    "bifurcation": {"marker": "D", "markersize": 5.0, "markerfacecolor": "white"},
}
_NAMES = {"limit": "limit point", "bifurcation": "bifurcation"}


def plot_load_displacement(
    paths: Mapping[str, xr.Dataset],
    nodes: Sequence[int],
    direction: str | None = None,
    title: str = "",
) -> Figure:
    """Draw the load factor over the displacement of chosen nodes.

    Solid lines are stable, dashed ones unstable (the tangent has negative eigenvalues, the supports
    as they are); limit points are dots, bifurcations diamonds.

    Parameters
    ----------
    paths : mapping of str to xarray.Dataset
        Label and path of `foldyn.trace`.
    nodes : sequence of int
        Nodes to show, a curve each.
    direction : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Direction of the displacement; by default that in which the nodes move farthest.
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
        No path or node, a node that a path does not have, another direction.
    """
    check_paths(paths)
    numbers, direction = asked(paths, nodes, direction)
    of = f" of node {numbers[0]}" if len(numbers) == 1 else ""
    figure, axes = _figure(title, f"displacement{of} along {direction} (m)", "load factor")
    curves = []
    for label, path in paths.items():
        for node in numbers:
            parts = [label] if len(paths) > 1 else []
            parts += [f"node {node}"] if len(numbers) > 1 else []
            curves.append((", ".join(parts), along(path, [node], direction), path))
    handles = [
        _draw(axes, x, path["load_factor"].values, path, index, label)
        for index, (label, x, path) in enumerate(curves)
    ]
    return _finish(figure, axes, handles, paths)


def plot_reaction(
    paths: Mapping[str, xr.Dataset],
    nodes: Sequence[int],
    direction: str | None = None,
    title: str = "",
) -> Figure:
    """Draw the total force of supports over the displacement that they impose.

    Solid lines are stable, dashed ones unstable, as long as the supports are where they are; limit
    points are dots, bifurcations diamonds.

    Parameters
    ----------
    paths : mapping of str to xarray.Dataset
        Label and path of `foldyn.trace`, a curve each.
    nodes : sequence of int
        Supported nodes: their reactions are added up, their mean displacement is shown.
    direction : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Direction of force and displacement; by default that in which the nodes move farthest.
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
        No path or node, a node that a path does not have or does not support along the direction,
        another direction.
    """
    check_paths(paths)
    numbers, direction = asked(paths, nodes, direction)
    figure, axes = _figure(
        title, f"imposed displacement along {direction} (m)", f"force along {direction} (N)"
    )
    handles = []
    for index, (label, path) in enumerate(paths.items()):
        force = total_reaction(path, numbers, direction)
        name = label if len(paths) > 1 else ""
        handles.append(_draw(axes, along(path, numbers, direction), force, path, index, name))
    return _finish(figure, axes, handles, paths)


def total_reaction(path: xr.Dataset, nodes: Sequence[int], direction: str) -> NDArray[np.float64]:
    """Sum of the forces of supports on nodes in a direction.

    Parameters
    ----------
    path : xarray.Dataset
        A path of `foldyn.trace`.
    nodes : sequence of int
    direction : {"x", "y", "z", "-x", "-y", "-z"}

    Returns
    -------
    ndarray, shape (steps,)
        The sum (N) at each point.

    Raises
    ------
    InputError
        A node is not supported along the direction.
    """
    axis, sign = signed("direction", direction)
    chosen = path["support_node"].isin(list(nodes)) & (path["support_axis"] == AXES[axis])
    held = path["support_node"].values[chosen.values]
    loose = sorted(set(nodes) - set(held.tolist()))
    if loose:
        raise InputError(f"nodes: no support holds node {loose[0]} along {AXES[axis]}")
    return sign * path["reaction"].values[:, chosen.values].sum(axis=1) + 0.0  # no -0


def _figure(title: str, xlabel: str, ylabel: str) -> tuple[Figure, Axes]:
    figure = style.new_figure(6.5, 4.4, title)
    axes = figure.subplots()
    style.frame(axes, xlabel, ylabel)
    axes.axhline(0.0, color=style.GRAY, linewidth=0.6, zorder=1)
    return figure, axes


def _draw(axes: Axes, x: NDArray, y: NDArray, path: xr.Dataset, index: int, label: str) -> Line2D:
    """Draw a curve, and return its legend entry."""
    color = style.CYCLE[index % len(style.CYCLE)]
    for number, run in enumerate(runs(path)):
        part = slice(run.start, run.stop + 1)
        axes.plot(
            x[part],
            y[part],
            color=color,
            linewidth=1.4,
            linestyle="solid" if run.stable else _UNSTABLE,
            label=label if number == 0 and label else f"_{label}{number}",
            zorder=2.0 + 0.01 * index,
        )
    if len(x) == 1:  # a single point has no line
        axes.plot(x, y, marker=".", color=color, label=label)
    for kind in CRITICAL:
        at = path["point"].values == kind
        if at.any():
            axes.plot(
                x[at], y[at], linestyle="none", color=color, zorder=3.0, label=f"_{kind}",
                **_MARKS[kind],
            )  # fmt: skip
    return Line2D([], [], color=color, linewidth=1.4, label=label)


def _finish(
    figure: Figure, axes: Axes, handles: list[Line2D], paths: Mapping[str, xr.Dataset]
) -> Figure:
    """Add the legend, whose entries are those that occur."""
    keys = [handle for handle in handles if handle.get_label()]
    gray: dict[str, Any] = {"color": style.GRAY, "linewidth": 1.4}
    if any(not run.stable for path in paths.values() for run in runs(path)):
        keys.append(Line2D([], [], **gray, label="stable"))
        keys.append(Line2D([], [], **gray, linestyle=_UNSTABLE, label="unstable"))
    for kind in CRITICAL:
        if any((path["point"].values == kind).any() for path in paths.values()):
            look = {"color": style.GRAY, "linestyle": "none", **_MARKS[kind]}
            keys.append(Line2D([], [], **look, label=_NAMES[kind]))
    if keys:
        style.legend_below(figure, keys, 4, figure.get_figwidth())
    style.exponents(axes)
    axes.ticklabel_format(axis="x", scilimits=(-4, 4), useMathText=True)
    axes.xaxis.get_offset_text().set(fontsize=style.TICK, color=style.BLACK)
    return style.finish(figure)


def moved_supports(case: Case) -> tuple[list[int], str] | None:
    """Nodes that supports move together and farthest, and the direction; None where none moves."""
    motion = sum((vector for vector, _ in case.imposed_terms), np.zeros(case.imposed.shape))
    if not motion.any():
        return None
    _, axis = np.unravel_index(np.abs(motion).argmax(), motion.shape)
    largest = motion[np.abs(motion[:, axis]).argmax(), axis]
    together = np.isclose(motion[:, axis], largest, rtol=1e-9, atol=0.0)
    return np.flatnonzero(together).tolist(), ("-" if largest < 0.0 else "") + AXES[axis]
