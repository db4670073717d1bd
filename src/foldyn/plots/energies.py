"""Energies of a motion with the error of their balance, and strain energies along a path."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter
from numpy.typing import NDArray

from foldyn.dynamics import audit
from foldyn.errors import InputError
from foldyn.plots import readings, style
from foldyn.plots.chart_figures import figure_of
from foldyn.plots.charts import Chart, Curve


def energy_error(trajectory: xr.Dataset) -> NDArray[np.float64]:
    """Return kinetic + strain + air + dissipated - work, minus the same sum at the start.

    Parameters
    ----------
    trajectory : xarray.Dataset
        A motion with its energies (J) over time.

    Returns
    -------
    ndarray, shape (time,)
        The imbalance (J): zero for an exact motion.
    """
    return audit.energy_error(_table(trajectory))


def plot_energies(trajectory: xr.Dataset, title: str = "") -> Figure:
    """Draw all energies of a motion, and below them the error of their balance.

    Parameters
    ----------
    trajectory : xarray.Dataset
        With ``kinetic``, the strain energies of its structure (``strain_bars``, ``strain_folds``
        and ``strain_bends``; for a shell ``strain_membrane``, ``strain_bending`` and
        ``strain_folds``), ``dissipated``, ``work`` and, for a structure in air, ``air`` (J), over
        ``time`` (s).
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Two axes: the energies; the balance error.

    Raises
    ------
    InputError
        An energy is missing from the trajectory.
    """
    strain = {
        part: f"strain, {readings.strain_name(part)}"
        for part in readings.parts_of(readings.alone("trajectory", trajectory))
    }
    others = {"dissipated": "dissipated", "work": "work of the loads"}
    lost = "dissipated"
    if audit.AIR in trajectory:
        others, lost = {audit.AIR: "lost to the air"} | others, "air + dissipated"
    names = {"kinetic": "kinetic", **strain, **others}
    missing = [name for name in names if name not in trajectory]
    if missing:
        raise InputError(f"trajectory: no {', '.join(missing)}; give a dataset of foldyn.simulate")
    time = trajectory["time"].values
    error = energy_error(trajectory)
    curves = [Curve(label, time, trajectory[name].values) for name, label in names.items()]
    balance = Chart("time (s)", "balance error (J)", [Curve("", time, error)], zero=True)
    charts = [Chart("time (s)", "energy (J)", curves), balance]
    heights = {"height_ratios": [2.6, 1.0]}
    figure = figure_of(charts, (7.5, 5.0), title, sharex=True, gridspec_kw=heights)
    lower = figure.axes[1]
    lower.get_lines()[0].set(color=style.BLACK, linestyle="solid", linewidth=1.0)
    worst = float(np.nanmax(np.abs(error)))
    largest = audit.energy_scale(_table(trajectory), audit.AIR in trajectory)
    note = f"kinetic + strain + {lost} - work, less its start: at most {worst:.2g} J"
    if largest > 0.0:
        note += f", {worst / largest:.2g} of the energy at play"
    lower.set_title(note, **style.FINE, loc="right", y=1.0, pad=4.0)
    style.exponents(lower, ticks=4)
    return style.finish(figure)


def _table(trajectory: xr.Dataset) -> NDArray[np.float64]:
    """Return the energies (J) of the balance, one column for each."""
    names = audit.audited(readings.parts_of(trajectory), audit.AIR in trajectory)
    return np.column_stack([trajectory[name].values for name in names])


def plot_path_energies(
    path: xr.Dataset,
    nodes: int | str | Sequence[int] | None = None,
    *,
    direction: str | None = None,
    title: str = "",
) -> Figure:
    """Draw the parts of the strain energy along a path, stacked; see `energy_shares`.

    Parameters
    ----------
    path : xarray.Dataset
        A path of `foldyn.trace`.
    nodes : int, sequence of int, or str, optional
        Nodes, or a selection ("xmax"), whose mean displacement is the horizontal axis; it must grow
        monotonically along the path. By default the axis is the load factor or, if that turns back,
        the mean distance that the nodes have traveled.
    direction : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Direction of that displacement; by default the direction in which the nodes move farthest.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Two axes: above the energies (J) and, as a line, the work done on the structure; below the
        shares of the energies.

    Raises
    ------
    InputError
        `path` is not a path, or a node or the direction does not exist.
    """
    readings.check_path(path, "path")
    x, name = _abscissa(path, nodes, direction)
    labels = ["strain energy (J)", "share"]
    figure, (upper, lower) = style.rows((7.0, 5.0), title, name, labels, heights=[1.8, 1.0])
    energies = readings.stacked(path)
    names = [readings.strain_name(part) for part in energies]
    colors = [readings.strain_color(part) for part in energies]
    handles = upper.stackplot(x, *energies.values(), labels=names, colors=colors, alpha=0.75)
    work = path["work"].values
    work = float(sum(layer[0] for layer in energies.values())) + work - work[0]
    (line,) = upper.plot(
        x, work, color=style.BLACK, linewidth=1.2, linestyle=style.DASHES[1],
        label="at the start + work done",
    )  # fmt: skip
    lower.stackplot(x, *readings.energy_shares(path).values(), colors=colors, alpha=0.75)
    lower.set_ylim(0.0, 1.0)
    lower.yaxis.set_major_formatter(PercentFormatter(1.0))
    for axes in (upper, lower):
        axes.margins(x=0.0)
        axes.set_axisbelow(False)  # the grid must show through the areas
    style.exponents(upper)
    return style.finish(figure, [*reversed(handles), line], columns=4)


def _abscissa(
    path: xr.Dataset, nodes: int | str | Sequence[int] | None, direction: str | None
) -> tuple[NDArray[np.float64], str]:
    """Return a quantity that grows monotonically along the path, and its name."""
    if nodes is not None:
        numbers, direction = readings.asked({"path": path}, nodes, direction)
        moved = readings.along(path, numbers, direction)
        if not (np.diff(moved) > 0.0).all():
            raise InputError(f"nodes: they also move back along {direction}; leave them out")
        return moved, f"displacement along {direction} (m)"
    factor = path["load_factor"].values
    if (np.diff(factor) > 0.0).all():
        return factor, "load factor"
    return readings.way(path), "mean distance traveled by the nodes (m)"
