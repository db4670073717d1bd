"""Constitutive curves of a structure's folds, bends and bars."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.plots import style
from foldyn.plots.chart_figures import figure_of
from foldyn.plots.law_charts import law_charts
from foldyn.plots.scene import Sheet3D
from foldyn.shells import Shell
from foldyn.structures import Structure


def plot_laws(
    structure: Structure | Shell | Case | xr.Dataset,
    stretch: tuple[float, float] = (0.8, 1.2),
    *,
    title: str = "",
) -> Figure:
    """Draw moments of folds and bends against the dihedral, and stress of bars against stretch.

    A shell has only folds. Hinges of equal stiffness and rest angle share a curve; each kind has at
    most four curves, for the largest groups of hinges. A dot and a dotted line mark the rest angle.

    Parameters
    ----------
    structure : Structure or Shell, or a Case or result with one
        Structure whose laws are drawn, with the stiffnesses and rest angles of whole creases.
    stretch : tuple of float
        Range of the bars' stretch.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Axes for each kind of element that the structure has, in the order fold, bend, bar.

    Raises
    ------
    InputError
        The stretches are not positive and increasing, or there are no laws.
    """
    low, high = stretch
    if not (0.0 < low < high < np.inf):
        raise InputError(f"stretch: {stretch!r}; give two positive, increasing stretches")
    own = Sheet3D.of(structure).structure
    if own is None:
        raise InputError(": is a pattern, which has no laws; give a structure", "structure")
    charts = law_charts(own, stretch)
    if not charts:
        raise InputError("structure: is a shell without folds, which has no laws to draw")
    figure = figure_of(charts, (3.5 * len(charts), 3.9), title, len(charts), legend=0)
    for axes, chart in zip(figure.axes, charts, strict=True):
        *curves, rest = chart.curves
        if chart.xlabel.startswith("stretch"):
            axes.set_xlim(*np.asarray(curves[0].x)[[0, -1]])
            axes.locator_params(axis="x", nbins=5)
        else:
            for angle in np.asarray(rest.x):
                axes.axvline(angle, color=style.GRAY, lw=0.8, linestyle=":", zorder=1)
            axes.set(xlim=(0.0, 360.0), xticks=np.arange(0, 361, 60))
        axes.get_lines()[len(curves)].set(color=style.BLACK, markerfacecolor=style.BLACK, zorder=4)
        look = {"fontsize": style.NOTE, "handlelength": 2.2, **style.LEGEND}
        below = {"loc": "upper left", "bbox_to_anchor": (-0.2, -0.19), "borderaxespad": 0.0}
        note = {"title": chart.note or None, "title_fontsize": style.NOTE}
        axes.legend(handles=axes.get_lines()[: len(curves)], **look, **below, **note)
    return style.finish(figure)
