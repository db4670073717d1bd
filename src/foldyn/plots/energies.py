"""Energies of a motion over time, with the audit of their balance."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from foldyn.dynamics import audit
from foldyn.errors import InputError
from foldyn.plots import style
from foldyn.plots.strain import PARTS, parts_of


def energy_error(trajectory: xr.Dataset) -> np.ndarray:
    """Return kinetic + strain + dissipated - work, less its value at the start.

    Parameters
    ----------
    trajectory : xarray.Dataset
        With the energies (J) over time.

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
        and ``strain_bends``, or of a shell ``strain_membrane``, ``strain_bending`` and
        ``strain_folds``), ``dissipated`` and ``work`` (J) over ``time`` (s).
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Two axes: the energies; the balance error.

    Raises
    ------
    InputError
        Where an energy is missing from the trajectory.
    """
    names = _names(trajectory)
    missing = [name for name in names if name not in trajectory]
    if missing:
        raise InputError(f"trajectory: no {', '.join(missing)}; give a dataset of foldyn.simulate")
    time = trajectory["time"].values
    figure = style.new_figure(7.5, 5.0, title)
    upper, lower = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [2.6, 1.0]})
    style.frame(upper, "", "energy (J)")
    style.frame(lower, "time (s)", "balance error (J)")
    handles = []
    for index, (name, label) in enumerate(names.items()):
        values = trajectory[name].values
        (line,) = upper.plot(time, values, label=label, **style.line_style(index))
        handles.append(line)
    error = energy_error(trajectory)
    worst = float(np.nanmax(np.abs(error)))
    largest = audit.energy_scale(_table(trajectory))
    lower.plot(time, error, color=style.BLACK, linewidth=1.0, label="balance error")
    lower.axhline(0.0, color=style.GRAY, linewidth=0.6, zorder=1)
    note = f"kinetic + strain + dissipated - work, less its start: at most {worst:.2g} J"
    if largest > 0.0:
        note += f", {worst / largest:.2g} of the energy at play"
    lower.set_title(note, fontsize=style.NOTE, color=style.BLACK, loc="right", y=1.0, pad=4.0)
    upper.margins(x=0.0)
    style.exponents(upper)
    style.exponents(lower, ticks=4)
    style.legend_below(figure, handles, columns=3)
    figure.align_ylabels()
    return style.finish(figure)


def _names(trajectory: xr.Dataset) -> dict[str, str]:
    """What the energies are called, in the order in which they are drawn."""
    strain = {part: f"strain, {PARTS[part][0]}" for part in parts_of(trajectory)}
    others = {"dissipated": "dissipated", "work": "work of the loads"}
    return {"kinetic": "kinetic", **strain, **others}


def _table(trajectory: xr.Dataset) -> np.ndarray:
    """Return the energies (J) as the audit has them, a column each."""
    names = audit.audited(parts_of(trajectory))
    return np.column_stack([trajectory[name].values for name in names])
