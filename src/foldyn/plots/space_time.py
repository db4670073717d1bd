"""Waves in chains of cells: in space and time, by phase and frequency, and transmission."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from foldyn.errors import InputError
from foldyn.linear.cell_motions import space_time
from foldyn.linear.unit_cell import UnitCell
from foldyn.plots import style
from foldyn.plots.readings import alone, by_label
from foldyn.results.sweep_dataset import label
from foldyn.values import choice, number

SIGNED = LinearSegmentedColormap.from_list(
    "signed", [style.VERMILLION, "#F5C9B0", "#FFFFFF", "#A9D2EE", style.BLUE]
)
STRENGTH = LinearSegmentedColormap.from_list(
    "strength", ["#FFFFFF", "#C9DDEC", style.SKY, style.BLUE, "#00304A"]
)
QUANTITIES = ("displacement", "velocity", "strain")
DECADES = 3.0  # decades of amplitude that a spectrum shows


def plot_space_time(
    trajectory: xr.Dataset,
    cell: UnitCell,
    *,
    component: str = "z",
    quantity: str = "displacement",
    along: int = 0,
    limit: float | None = None,
    title: str = "",
) -> Figure:
    """Draw a motion of a chain: cells along the horizontal axis, time upward, motion as color.

    Parameters
    ----------
    trajectory : xarray.Dataset
        A motion of a chain or sheet of these cells.
    cell : UnitCell
    component : {"x", "y", "z", "rotation"}
        Component of displacement and velocity; see `foldyn.linear.space_time`.
    quantity : {"displacement", "velocity", "strain"}
        Displacement or velocity of each cell, or the strain between neighbors along the chain.
    along : int
        Which period of the cell runs along the chain.
    limit : float, optional
        Value at the ends of the color scale; by default the largest. For strains, the first quarter
        of the gaps between cells is ignored, because an impact strains them most.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Positive values (tension) are blue, negative values (compression) red.

    Raises
    ------
    InputError
        As in `foldyn.linear.space_time`; also if strains are asked for but the cells do not advance
        along the chain.
    """
    choice("quantity", quantity, QUANTITIES)
    found = space_time(trajectory, cell, component=component, along=along)
    if quantity not in found:
        raise InputError(' = "strain": the cells do not advance along the chain', "quantity")
    if limit is not None:
        limit = number("limit", limit, above=0.0)
    return drawn_cells(found, quantity, limit, title)


def drawn_cells(found: xr.Dataset, quantity: str, limit: float | None, title: str = "") -> Figure:
    """Figure of the result of `space_time`; see `plot_space_time`."""
    shown = found[quantity]
    places = found["between" if quantity == "strain" else "cell"].values
    if limit is None:
        later = shown.values[:, len(places) // 4 if quantity == "strain" else 0 :]
        limit = float(np.abs(later).max()) or 1.0
    figure, axes = style.single((6.2, 4.6), title, "cell", "time (s)")
    mesh = axes.pcolormesh(
        places, found["time"].values, shown.values, cmap=SIGNED, vmin=-limit, vmax=limit,
        shading="nearest", rasterized=True,
    )  # fmt: skip
    name = quantity if quantity == "strain" else f"{found.attrs['component']} {quantity}"
    style.color_bar(figure, mesh, label(shown, name), ax=axes, extend="both")
    axes.grid(False)
    return style.finish(figure)


def plot_wave_spectrum(
    spectrum: xr.Dataset,
    bands: xr.Dataset | None = None,
    *,
    max_frequency: float | None = None,
    title: str = "",
) -> Figure:
    """Draw the two-dimensional spectrum of a motion, with the bands of small motions.

    Parameters
    ----------
    spectrum : xarray.Dataset
        From `foldyn.linear.wave_spectrum`.
    bands : xarray.Dataset, optional
        From `foldyn.bands`, at phases of the one period along the chain; negative phases may be
        left out, as bands are symmetric.
    max_frequency : float, optional
        Upper end of the frequency axis (Hz); by default the end of the spectrum.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Phases along the horizontal axis, frequencies upward, three decades of amplitude as color;
        bands are dashed.

    Raises
    ------
    InputError
        The input is no such spectrum, or the bands are along a path or on a grid of a sheet.
    """
    if "amplitude" not in alone("spectrum", spectrum) or "phase" not in spectrum.dims:
        raise InputError(": give what foldyn.linear.wave_spectrum returns", "spectrum")
    size = spectrum["amplitude"].transpose("frequency", "phase").values
    frequency = spectrum["frequency"].values
    top = frequency[-1]
    if max_frequency is not None:
        top = number("max_frequency", max_frequency, above=0.0, unit="Hz")
    level = np.log10(np.maximum(size / (size.max() or 1.0), 10.0**-DECADES))
    figure, axes = style.single((6.2, 4.6), title, "phase (rad per cell)", "frequency (Hz)")
    mesh = axes.pcolormesh(
        spectrum["phase"].values, frequency, level, cmap=STRENGTH, vmin=-DECADES, vmax=0.0,
        shading="nearest", rasterized=True,
    )  # fmt: skip
    style.color_bar(figure, mesh, "amplitude relative to the largest (decades)", ax=axes)
    axes.grid(False)
    keys = []
    if bands is not None:
        if "wave_vector" not in alone("bands", bands) or bands["wave_vector"].shape[1] != 1:
            raise InputError(": give bands at phases of one period", "bands")
        look = {"color": style.VERMILLION, "linestyle": (0, (4, 2)), "linewidth": 0.9}
        phases, lines = bands["wave_vector"].values[:, 0], bands["frequency"].values
        order = np.argsort(phases)
        for sign in (1.0, -1.0) if phases.min() >= -1e-9 else (1.0,):
            axes.plot(sign * phases[order], lines[order], **look)
        keys = [style.key("bands", **look)]
    axes.set_xlim(-np.pi, np.pi)
    axes.set_xticks([-np.pi, 0.0, np.pi], ["-π", "0", "π"])
    axes.set_ylim(0.0, top)
    return style.finish(figure, keys)


def plot_transmission(
    transmissions: xr.Dataset | Mapping[str, xr.Dataset],
    attenuation: xr.Dataset | None = None,
    *,
    title: str = "",
) -> Figure:
    """Draw the transmission to the end of a chain, and the decay per cell, also from bands.

    Parameters
    ----------
    transmissions : xarray.Dataset, or mapping of str to xarray.Dataset
        A result of `foldyn.linear.transmission`, or several by their labels.
    attenuation : xarray.Dataset, optional
        From `foldyn.linear.attenuation`.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        Above, the response of the last cell divided by that of the first. Below, the decay (Np per
        cell) as dots, and as lines the attenuation of all waves of the periodic chain, of which a
        drive excites only some.

    Raises
    ------
    InputError
        The inputs are not results of these functions.
    """
    shown = by_label("transmissions", transmissions)
    for whose, one in shown.items():
        if "decay" not in one or "ratio" not in one:
            where = f"transmissions[{whose!r}]" if whose else "transmissions"
            raise InputError(": give what foldyn.linear.transmission returns", where)
    labels = ["last cell over first", "decay (Np per cell)"]
    figure, (upper, lower) = style.rows((6.8, 5.0), title, "frequency (Hz)", labels)
    keys = []
    top = max(float(np.nanmax(one["decay"].values, initial=0.0)) for one in shown.values())
    for k, (whose, one) in enumerate(shown.items()):
        look = style.line_style(k)
        upper.semilogy(one["frequency"].values, one["ratio"].values, **look)
        dots = style.ring(look["color"], 3.5)
        lower.plot(one["frequency"].values, one["decay"].values, **dots)
        keys.append(style.key(whose or "chain", **look | dots | {"linestyle": "solid"}))
    if attenuation is not None:
        if "phase" not in alone("attenuation", attenuation):
            raise InputError(": give what foldyn.linear.attenuation returns", "attenuation")
        phase = np.asarray(attenuation["phase"].values, complex)
        waves = np.sort(np.where(np.isfinite(phase), np.imag(phase), np.nan), axis=1)
        look = {"color": style.GRAY, "linewidth": 1.0, "zorder": 1.5}
        lower.plot(attenuation["frequency"].values, waves, **look)
        keys.append(style.key("waves of the repeated chain", **look))
    lower.set_ylim(-0.05 * top, 1.25 * top or 1.0)
    return style.finish(figure, keys)
