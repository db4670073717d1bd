"""Repeated sheets: bands along a path and as contours of frequency, and moduli by direction."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from foldyn.errors import InputError
from foldyn.linear.band_structure import ALL, band_gaps, frequencies_of
from foldyn.linear.cell_equilibrium import BY_STATE
from foldyn.plots import style
from foldyn.results import sweep_dataset
from foldyn.values import flag, whole

GAP = "0.88"  # gray of full gaps


def plot_bands(bands: xr.Dataset, gaps: bool = True, *, title: str = "") -> Figure:
    """Draw bands along a path of the Brillouin zone.

    Parameters
    ----------
    bands : xarray.Dataset
        From `foldyn.bands`, along a path (`UnitCell.path`) or along phases of one period.
    gaps : bool
        Whether to shade full gaps.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Frequencies against the phase, a line for each band, colored by the share of motion along z
        if the bands have a polarization.

    Raises
    ------
    InputError
        The result is not from `foldyn.bands`, or its phases form a grid instead of a path.
    """
    frequencies_of(bands)
    along, label = _along(bands)
    figure, axes = style.single((6.4, 4.4), title, label, "frequency (Hz)")
    if flag("gaps", gaps):
        found = band_gaps(bands)
        for k in np.flatnonzero(found["direction"].values == ALL):
            axes.axhspan(float(found["bottom"][k]), float(found["top"][k]), color=GAP, lw=0.0)
    values = bands["frequency"].values
    if "polarization" in bands:
        lines = _colored(along, values, bands["polarization"].values[..., 2])
        axes.add_collection(lines)
        style.color_bar(figure, lines, "share of motion along z", ax=axes, pad=0.02)
        axes.set_ylim(0.0, 1.05 * float(np.nanmax(values)))
    else:
        for band, line in enumerate(values.T):
            axes.plot(along, line, color=style.line_style(band)["color"], lw=1.4)
    axes.set_xlim(along.min(), along.max())
    axes.set_ylim(bottom=0.0)
    if "ticks" in bands.attrs:
        names = bands.attrs["tick_labels"].replace("G", "Γ").split("-")
        axes.set_xticks(np.atleast_1d(bands.attrs["ticks"]), names)
        axes.set_xlabel("")
        axes.grid(True, axis="x", color="0.6", lw=0.8)
    return figure


def plot_iso_frequency(
    bands: xr.Dataset, band: int = 1, *, levels: int = 12, title: str = ""
) -> Figure:
    """Draw contours of one band's frequency over the Brillouin zone of a sheet.

    Parameters
    ----------
    bands : xarray.Dataset
        From `foldyn.bands` at the phases of `UnitCell.grid`.
    band : int
        Number of the band, from 1, in the order of frequency.
    levels : int
        Number of contours.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Contours of the frequency (Hz) in the plane of the phases along the two periods. If the
        periods are at right angles, group velocities are at right angles to the contours.

    Raises
    ------
    InputError
        The phases form no grid, or there is no such band.
    """
    frequency = frequencies_of(bands)
    shape = np.atleast_1d(bands.attrs.get("grid", ()))
    if len(shape) != 2:
        raise InputError(": lines of one frequency need phases of cell.grid(n)", "bands")
    band = whole("band", band, least=1)
    if band > frequency.shape[1]:
        raise InputError(f" = {band}: there are {frequency.shape[1]} bands", "band")
    phases = bands["wave_vector"].values.reshape(*shape, 2)
    values = frequency[:, band - 1].reshape(*shape)
    x, y, z = (np.pad(each, (0, 1), "wrap") for each in (phases[..., 0], phases[..., 1], values))
    x[-1], y[:, -1] = np.pi, np.pi
    labels = "phase along period 1 (rad)", "phase along period 2 (rad)"
    figure, axes = style.single((5.2, 4.4), title, *labels)
    lines = axes.contour(x, y, z, levels=whole("levels", levels, least=1), cmap="viridis")
    axes.clabel(lines, fontsize=7)
    axes.set_aspect("equal")
    ticks, names = [-np.pi, 0.0, np.pi], ["-π", "0", "π"]
    axes.set_xticks(ticks, names)
    axes.set_yticks(ticks, names)
    return figure


def _colored(along: np.ndarray, values: np.ndarray, shares: np.ndarray) -> LineCollection:
    """Lines of bands (phase, band), cut at every phase into pieces that are colored by shares."""
    points = np.stack([np.broadcast_to(along[:, None], values.shape), values], axis=-1)
    pieces = np.stack([points[:-1], points[1:]], axis=2).reshape(-1, 2, 2)
    lines = LineCollection(list(pieces), cmap="viridis", linewidths=1.6, capstyle="round")
    lines.set_array(0.5 * (shares[:-1] + shares[1:]).ravel())
    lines.set_clim(0.0, 1.0)
    return lines


def _along(bands: xr.Dataset) -> tuple[np.ndarray, str]:
    if "distance" in bands.coords:
        return bands["distance"].values, "along the path (rad)"
    phases: Any = bands["wave_vector"].values
    if phases.shape[1] == 1:
        return phases[:, 0], "phase per period (rad)"
    raise InputError(": its phases lie on no path; use cell.path, or plot_iso_frequency", "bands")


def plot_effective(effective: xr.Dataset, *, title: str = "") -> Figure:
    """Draw moduli of stretching and bending along all directions in a sheet, or all its states.

    Parameters
    ----------
    effective : xarray.Dataset
        A result of `foldyn.effective` for a sheet, or of a case file with several states.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        A polar diagram of each, with the angle from the axis x; of several states, what is in
        `BY_STATE` against the varied key.

    Raises
    ------
    InputError
        Not such a result.
    """
    if "state" in getattr(effective, "dims", ()):
        return _draw_states(effective, title)
    if "modulus_along" not in getattr(effective, "data_vars", ()):
        raise InputError(": give what foldyn.effective returns for a sheet", "effective")
    figure = style.new_figure(7.2, 3.8, title)
    angle = np.radians(effective["angle"].values)
    for k, (name, text) in enumerate((("modulus", "stretching"), ("bending_modulus", "bending"))):
        axes: Any = figure.add_subplot(1, 2, k + 1, projection="polar")
        values = effective[f"{name}_along"]
        axes.plot(np.append(angle, angle + np.pi), np.tile(values, 2), color=style.BLUE, lw=1.4)
        axes.set_title(f"{text} ({values.attrs['units']})", fontsize="medium")
        axes.set_rlabel_position(90.0)
    return figure


def _draw_states(effective: xr.Dataset, title: str) -> Figure:
    """Draw the short variables against the states, each in its axes."""
    shown = [name for name in BY_STATE if name in effective]
    state, rows = effective["state"], -(-len(shown) // 2)
    unstable = np.flatnonzero(~effective["stable"].values)
    figure = style.new_figure(7.2, 2.2 * rows + 0.3, title)
    for k, (name, axes) in enumerate(zip(shown, figure.subplots(rows, 2).flat, strict=False)):
        own = effective[name].transpose("state", ...)
        labels = own[own.dims[1]].values if own.ndim > 1 else [""]
        for label, values in zip(labels, own.values.reshape(len(state), -1).T, strict=True):
            (line,) = axes.plot(state.values, values, "o-", lw=1.4, ms=2.5, label=label)
            axes.plot(state[unstable], values[unstable], "o", ms=5, mfc="white", c=line.get_color())
        words = name.replace("poissons", "Poisson's").replace("_", " ")
        axes.set_title(sweep_dataset.label(own, words), fontsize="medium")
        if own.ndim > 1:
            axes.legend(fontsize="small")
        axes.locator_params(axis="x", nbins=4)
        if k >= len(shown) - 2:
            axes.set_xlabel(sweep_dataset.label(state))
    for axes in figure.axes[len(shown) :]:
        axes.set_axis_off()
    return figure
