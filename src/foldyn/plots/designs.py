"""Figures of a design search: its convergence, and the sensitivity of a sheet's entries."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.plots import scene, style
from foldyn.plots.chart_figures import figure_of
from foldyn.plots.design_charts import convergence_charts
from foldyn.plots.scene import Sheet3D, View
from foldyn.plots.sheet import DrawnSheet, split_edges
from foldyn.values import choice, of_kind

COLORS = "coolwarm"
WIDE, HIDDEN = 3.5, 0.25  # width of colored creases in points, and their opacity behind panels
ROWS = 4  # rows of a legend in whose room the color bar fits


def plot_convergence(history: xr.Dataset) -> Figure:
    """Draw the objective and the largest violation against the number of evaluations.

    Parameters
    ----------
    history : xarray.Dataset
        The `history` of a result of `foldyn.design`.
    """
    of_kind("history", history, xr.Dataset)
    charts = convergence_charts(history)
    return figure_of(charts, (4.5 * len(charts), 3.4), columns=len(charts))


def draw_sensitivity(
    case_or_structure: Any,
    values: ArrayLike,
    *,
    label: str = "",
    on: str | None = None,
    view: tuple[float, float] = (28.0, -60.0),
    title: str = "",
) -> Figure:
    """Color each crease or panel of a sheet, for example by the gradient of a frequency.

    Parameters
    ----------
    case_or_structure : Case, Structure or Pattern, or a result with its case
    values : array_like, shape (creases,) or (panels,)
        Value of each crease or panel; red is above 0, blue below.
    label : str
        Title of the color bar, with its unit.
    on : {"crease", "panel"}, optional
        Parts to color; by default creases if their number matches the values, otherwise panels.
    view : tuple of float
        Elevation above the xy plane and azimuth around z (degrees).
    title : str

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        The number of values does not match the number of creases or panels.
    """
    sheet, sight = Sheet3D.of(case_or_structure), View(*view)
    shown = np.asarray(values, float)
    counts = {"crease": len(sheet.pattern.creases), "panel": len(sheet.pattern.faces)}
    if on is not None:
        counts = {choice("on", on, counts): counts[on]}
    fits = [name for name, count in counts.items() if shown.shape == (count,)]
    if not fits:
        known = " or ".join(f"{count} {name}s" for name, count in counts.items())
        raise InputError(f": shape {shown.shape}; give one value for each of the {known}", "values")
    reach = float(np.abs(shown).max(initial=0.0)) or 1.0
    scale = ScalarMappable(Normalize(-reach, reach), colormaps[COLORS])
    return draw_colored(sheet, fits[0], shown, scale, label, sight, title)


def draw_colored(
    sheet: Sheet3D, on: str, shown: NDArray, scale: ScalarMappable, label: str, sight: View,
    title: str,
) -> Figure:  # fmt: skip
    """Color the creases or the panels of a sheet by their values, with a color bar."""
    figure, axes = scene.view_figure(sheet.nodes, sight, title, legend_rows=ROWS)
    DrawnSheet(axes, sheet, sheet.nodes, sight)
    if on == "crease":
        _color_creases(axes, sheet, sight, scale.to_rgba(shown))
    else:
        own = scale.to_rgba(shown[_panels(sheet)])[:, :3]
        colors = scene.shades(sheet.nodes, sheet.triangles, own)
        scene.add_panels(axes, sheet.nodes[sheet.triangles], colors, zorder=1.2)
    high = figure.get_size_inches()[1]
    there = figure.add_axes((0.2, 0.5 / high, 0.6, 0.1 / high))
    style.color_bar(figure, scale, label, cax=there, orientation="horizontal")
    return figure


def _color_creases(axes: Any, sheet: Sheet3D, view: View, colors: NDArray) -> None:
    """Draw creases in their own colors, pale if a panel hides them."""
    for crease, color in zip(sheet.edges[sheet.lines.number], colors, strict=True):
        seen, hidden = split_edges(crease[None], sheet.nodes, sheet.triangles, view, sheet.size)
        scene.add_segments(axes, seen, color, WIDE, zorder=3.0)
        scene.add_segments(axes, hidden, color, WIDE, zorder=1.6, alpha=HIDDEN)


def _panels(sheet: Sheet3D) -> NDArray:
    """Panel of each triangle."""
    if sheet.structure is not None:
        return sheet.structure.triangle_panel
    return np.repeat(np.arange(len(sheet.pattern.faces)), [len(f) - 2 for f in sheet.pattern.faces])
