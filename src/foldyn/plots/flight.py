"""Free flight: how a body, or a panel, turns over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from foldyn.plots.charts import Chart, Curve
from foldyn.results.free_flight import attitude

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_attitude(trajectory: xr.Dataset, panel: int | None = None, *, title: str = "") -> Figure:
    """Draw the rotation of a body or a panel from rest, and its angular velocity, over time.

    Parameters
    ----------
    trajectory : xarray.Dataset
        A motion.
    panel : int, optional
        Number of a panel; by default the whole body. See `foldyn.attitude`.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Two axes: the rotation vector (degrees), and the angular velocity (rad/s).

    Raises
    ------
    InputError
        The result is no motion, or the pattern has no such panel.

    Examples
    --------
    >>> import foldyn as fd
    >>> case = fd.Case(fd.discretize(fd.patterns.miura(), fd.Sheet(1e6, 0.25, 0.01, 1.0)))
    >>> thrown = fd.State(velocity=case.structure.nodes[:, [1, 0, 2]] * [-3.0, 3.0, 0.0])
    >>> flight = fd.simulate(case, 0.01, interval=0.005, initial=thrown)
    >>> len(fd.plots.plot_attitude(flight).axes)
    2
    """
    from foldyn.plots.chart_figures import figure_of  # loads Matplotlib

    return figure_of(attitude_charts(trajectory, panel), (9.0, 3.2), title, 2)


def attitude_charts(trajectory: xr.Dataset, panel: int | None = None) -> list[Chart]:
    """Charts of the rotation and the angular velocity; see `plot_attitude`."""
    found = attitude(trajectory, panel)
    times, axes = found["time"].values, found["axis"].values
    shown = ("rotation", np.degrees(1.0), "degrees"), ("angular_velocity", 1.0, "rad/s")
    return [
        Chart(
            "time (s)", f"{found[name].attrs['long_name']} ({units})",
            [Curve(f"about {axis}", times, scale * found[name].sel(axis=axis)) for axis in axes],
        )
        for name, scale, units in shown
    ]  # fmt: skip
