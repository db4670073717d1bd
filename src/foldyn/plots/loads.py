"""Histories of a case: its loads and the motions that it imposes."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.plots import style
from foldyn.plots.load_curves import load_curves
from foldyn.plots.scene import Sheet3D
from foldyn.values import number

_SAMPLES = 2001


def plot_load_history(
    case: Case | xr.Dataset, duration: float, title: str = "", start: float = 0.0
) -> Figure:
    """Draw the loads of a case and the motions it imposes over time.

    Each kind has axes of its own:

    - one curve per history of forces: the force at the most heavily loaded of its nodes, that is
      the largest magnitude among the nodes times the factor of the history;
    - pressure, changes of temperature and moments of creases: one curve per load, the largest in
      magnitude of its panels or creases times the factor;
    - gravity: the magnitude of its acceleration times the factor;
    - imposed displacements and displacements of the base, one curve per value and axis;
    - rest angles of actuated creases, one curve per pair of first and last angle.

    Of the last two, at most four curves per history are drawn.

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
        Where the duration is not positive, or there is no case.
    """
    own = Sheet3D.of(case).case
    if own is None:
        raise InputError(": has no loads; give a case", "case")
    number("duration", duration, above=0.0, unit="s")
    panels = load_curves(own) or [("force at a node (N)", [])]
    entries = sum(len(curves) for _, curves in panels)
    height = 2.9 + 1.7 * (len(panels) - 1) + 0.17 * max(entries - len(panels), 0)
    ylabels = [ylabel for ylabel, _ in panels]
    figure, rows = style.rows((6.5, height), title, "time (s)", ylabels)
    time = np.linspace(start, start + duration, _SAMPLES)
    handles = []
    for axes, (_, curves) in zip(rows, panels, strict=True):
        for curve in curves:
            look = style.line_style(len(handles)) | {"linewidth": 1.6}
            handles += axes.plot(time, curve.values(time), label=curve.label, **look)
        if not any(curve.offset for curve in curves):
            axes.axhline(0.0, color=style.GRAY, linewidth=0.8, zorder=1)
        style.exponents(axes)
    rows[-1].set_xlim(time[0], time[-1])
    if not handles:
        place = {"transform": rows[0].transAxes, "ha": "center"}
        rows[0].text(0.5, 0.6, "no loads", **place, **style.TEXT)
    return style.finish(figure, handles, columns=1)
