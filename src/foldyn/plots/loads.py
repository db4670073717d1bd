"""Histories of a case's loads and imposed motions."""

from __future__ import annotations

import xarray as xr
from matplotlib.figure import Figure

from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.plots import style
from foldyn.plots.chart_figures import figure_of
from foldyn.plots.charts import Chart
from foldyn.plots.load_curves import load_charts
from foldyn.plots.scene import Sheet3D
from foldyn.values import number


def plot_load_history(
    case: Case | xr.Dataset, duration: float, *, title: str = "", start: float = 0.0
) -> Figure:
    """Draw the loads of a case and the motions it imposes over time.

    Each kind of load has its own axes:

    - forces: one curve per history, the largest force at a node times the factor of the history;
    - pressure, changes of temperature and moments of creases: one curve per load, the value of the
      largest magnitude among its panels or creases times the factor;
    - gravity: the magnitude of its acceleration times the factor;
    - imposed displacements and displacements of the base, one curve per value and axis;
    - rest angles of actuated creases, one curve per pair of first and last angle.

    The last two kinds have at most four curves per history.

    Parameters
    ----------
    case : Case, or a result with one
        The curves are its ``force_terms``, ``following_terms``, ``gravity_terms``,
        ``imposed_terms``, ``base_terms`` and ``actuation_terms``.
    duration : float
        Length of the time axis (s).
    title : str
        Title of the figure.
    start : float
        Beginning of the time axis (s).

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        The duration is not positive, or there is no case.
    """
    own = Sheet3D.of(case).case
    if own is None:
        raise InputError(": has no loads; give a case", "case")
    number("duration", duration, above=0.0, unit="s")
    charts = load_charts(own, start, duration)
    entries = sum(len(chart.curves) for chart in charts)
    height = 1.2 + 1.7 * max(len(charts), 1) + 0.17 * max(entries - len(charts), 0)
    none = Chart("time (s)", "force at a node (N)", [])
    figure = figure_of(charts or [none], (6.5, height), title, legend=1, sharex=True)
    figure.axes[-1].set_xlim(start, start + duration)
    if not charts:
        place = {"transform": figure.axes[0].transAxes, "ha": "center"}
        figure.axes[0].text(0.5, 0.6, "no loads", **place, **style.TEXT)
    return style.finish(figure)
