"""Mode shapes side by side, with the equilibrium behind them in gray, and matrices of MAC."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import cast

import numpy as np
import xarray as xr
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike

from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.plots import style
from foldyn.plots.readings import case_from_result, chosen_modes
from foldyn.plots.scene import Points, Sheet3D, View
from foldyn.plots.sheet import rest_keys, side_by_side
from foldyn.structures import Structure
from foldyn.values import length, listed, numbers

_AMPLITUDE = 0.12  # largest displacement, relative to the sheet's size
_STRETCH = 0.4  # largest relative displacement of a bar's ends, relative to its length
_SHADES = LinearSegmentedColormap.from_list("mac", ["#FFFFFF", "#9CC7E4", style.BLUE, "#00304A"])
_MOST_NUMBERS = 16  # largest number of rows or columns with legible numbers
_CELL, _MARGIN, _BAR = 0.42, 1.1, 0.9  # inches


@case_from_result
def draw_modes(
    case_or_structure: Case | Structure,
    modes: xr.Dataset,
    *,
    which: Sequence[int] | None = None,
    amplitude: float | None = None,
    names: Mapping[int, str] | xr.Dataset | None = None,
    view: tuple[float, float] = (28.0, -60.0),
    title: str = "",
) -> Figure:
    """Draw mode shapes, each with the state of the oscillation behind it in gray.

    All shapes are drawn at the same scale. Below each shape are its number, frequency, damping
    ratio and character.

    Parameters
    ----------
    case_or_structure : Case or Structure
        The structure that vibrates; by default from the modes: ``draw_modes(modes)``.
    modes : xarray.Dataset
        Modes of `foldyn.modes`.
    which : sequence of int, optional
        Mode numbers, from 1; by default all modes that are not rigid, at most 12.
    amplitude : float, optional
        Largest displacement (m) in each picture; by default 12 % of the sheet's size, or less if
        neighboring nodes would move too far apart for a legible shape.
    names : xarray.Dataset or mapping of int to str, optional
        Character of the modes: a result of `foldyn.linear.character`, or words by mode number; by
        default the character along the axis that leads away from the supports, or the longest axis.
    view : tuple of float
        Elevation above the xy plane and azimuth around z (degrees).
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        One orthographic view for each mode.

    Raises
    ------
    InputError
        The modes belong to another structure, or a mode does not exist.
    """
    sheet, swings, captions, notes = shown_modes(case_or_structure, modes, which, amplitude, names)
    return side_by_side(sheet, sheet.nodes + swings, captions, View(*view), notes, title)[0]


def shown_modes(
    case_or_structure: Case | Structure, modes: xr.Dataset, which: Sequence[int] | None,
    amplitude: float | None, names: Mapping[int, str] | xr.Dataset | None,
) -> tuple[Sheet3D, Points, list[str], list[Line2D]]:  # fmt: skip
    """Mode shapes as figures and films show them.

    Returns
    -------
    sheet : Sheet3D
        The sheet in the state about which it oscillates.
    swings : ndarray, shape (k, n, 3)
        Displacements from that state (m) at full amplitude.
    captions : list of str
    notes : list of Line2D
        Legend entries.
    """
    drawn = Sheet3D.of(case_or_structure)
    numbers = chosen_modes(modes, which)
    sheet, swings, notes = about_state(drawn, modes, numbers, amplitude, "modes: they have")
    named = mode_names(sheet, modes, names)
    captions = [describe_mode(modes, number, named.get(number, "")) for number in numbers]
    return sheet, swings, captions, notes


def about_state(
    sheet: Sheet3D, found: xr.Dataset, numbers: Sequence[int], amplitude: float | None, whose: str
) -> tuple[Sheet3D, Points, list[Line2D]]:
    """Sheet in the state about which shapes were found, scaled shapes (k, n, 3) and legend.

    whose : begins the message if the result belongs to another structure.
    """
    if amplitude is not None:
        length("amplitude", amplitude)
    moved = found["displacement"].transpose("node", "axis").values
    sheet.check_nodes(whose, moved)
    sheet = replace(sheet, nodes=sheet.nodes + moved)
    shapes = found["shape"].transpose("mode", "node", "axis").sel(mode=numbers).values
    swings = np.array([readable(sheet, shape, amplitude) for shape in shapes])
    return sheet, swings, rest_keys(state="undeformed" if not moved.any() else "equilibrium")


def mode_names(
    sheet: Sheet3D, modes: xr.Dataset, names: Mapping[int, str] | xr.Dataset | None
) -> Mapping[int, str]:
    """Character of each mode that is not rigid, with the share of motion, by mode number."""
    if names is None:
        from foldyn.linear import character

        try:
            names = character(modes, case=sheet.case)
        except InputError:  # a bare structure with laws that the result does not contain
            return {}
    if not hasattr(names, "data_vars"):
        return cast("Mapping[int, str]", names)
    words = cast("xr.Dataset", names)
    columns = modes["mode"], words["name"], words["share"].max("kind"), modes["rigid"]
    rows = zip(*(column.values.tolist() for column in columns), strict=True)
    return {k: f"{name} ({100.0 * share:.0f} %)" for k, name, share, rigid in rows if not rigid}


def describe_mode(modes: xr.Dataset, number: int, name: str = "") -> str:
    """Text for a mode: number, frequency and damping, with its character below."""
    mode = modes.sel(mode=number)
    eigenvalue = float(mode["eigenvalue"])
    if bool(mode["rigid"]):
        text = "rigid motion"
    elif eigenvalue < 0.0:
        text = f"unstable, grows e-fold in {1.0 / np.sqrt(-eigenvalue):.3g} s"
    elif eigenvalue == 0.0:
        text = "0 Hz, nothing resists it"
    else:
        text = f"{hertz(float(mode['frequency']))} Hz"
        ratio = float(mode["damping_ratio"]) if "damping_ratio" in mode else 0.0
        if np.isfinite(ratio) and ratio > 0.0:
            text += f", damping {100.0 * ratio:.3g} %"
    return f"mode {number}: {text}" + (f"\n{name}" if name else "")


def hertz(frequency: float) -> str:
    """Write a frequency (Hz) with four digits."""
    if frequency >= 1e4 or 0.0 < frequency < 1e-2:
        return f"{frequency:.4g}"
    return f"{frequency:#.4g}".rstrip(".") if frequency else "0"


def readable(sheet: Sheet3D, shape: Points, amplitude: float | None) -> Points:
    """Scale a shape to an amplitude (m), or by default to a legible amplitude."""
    largest = float(np.linalg.norm(shape, axis=1).max())
    if largest == 0.0:
        return shape
    if amplitude is not None:
        return shape * (amplitude / largest)
    first, second = np.concatenate([sheet.pieces, sheet.inner_bars]).T
    length = np.linalg.norm(sheet.nodes[second] - sheet.nodes[first], axis=1)
    parting = np.linalg.norm(shape[second] - shape[first], axis=1)
    limit = float((_STRETCH * length / np.maximum(parting, 1e-30)).min())
    return shape * min(_AMPLITUDE * sheet.size / largest, limit)


def plot_mac(
    mac: ArrayLike,
    rows: Sequence[str] | None = None,
    *,
    columns: Sequence[str] | None = None,
    row_title: str = "mode",
    column_title: str = "mode",
    title: str = "",
) -> Figure:
    """Draw a matrix of modal assurance criteria: 1 (dark) for equal shapes, 0 (white) for others.

    Parameters
    ----------
    mac : array_like, shape (a, b)
        Values from 0 to 1, as from `foldyn.mac`: rows are the modes of the first set.
    rows, columns : sequence of str, optional
        Labels of the rows and columns; by default the numbers from 1.
    row_title, column_title : str
        Names of the two sets.
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        The matrix, first mode at the top left, with a color bar. With up to 16 rows and columns the
        cells show their values.

    Raises
    ------
    InputError
        `mac` is not a matrix, has values out of range, or labels do not match it.
    """
    if isinstance(mac, xr.Dataset):
        raise InputError("mac: is a dataset; give the matrix of fd.mac(modes, other_modes)")
    values = numbers("mac", mac)
    if values.ndim != 2 or not values.size:
        raise InputError(f"mac: shape {values.shape}; give a matrix, one row per mode")
    if not (values.min() >= -1e-9 and values.max() <= 1.0 + 1e-9):
        raise InputError("mac: has values that are not between 0 and 1")
    labels = []
    for name, given, count in (("rows", rows, len(values)), ("columns", columns, values.shape[1])):
        asked = range(1, count + 1) if given is None else listed(name, given, "labels")
        labels.append([str(label) for label in asked])
        if len(labels[-1]) != count:
            raise InputError(f"{name}: {len(labels[-1])} labels for {count} modes; give one each")
    down, across = values.shape
    cell = min(_CELL, 6.0 / max(down, across))
    long = 0.07 * max(len(label) for label in labels[1]) > cell  # labels that would overlap
    width, height = max(_MARGIN + _BAR + cell * across, 3.2), max(_MARGIN + cell * down, 2.2)
    figure = style.new_figure(width, height, title)
    axes = figure.subplots()
    image = axes.imshow(values, cmap=_SHADES, vmin=0.0, vmax=1.0, interpolation="nearest")
    style.frame(axes, column_title, row_title)
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(True)
    axes.set_xticks(range(across), labels[1], rotation=90 if long else 0)
    axes.set_yticks(range(down), labels[0])
    axes.tick_params(length=0.0)
    if max(down, across) <= _MOST_NUMBERS:
        for (row, column), value in np.ndenumerate(values):
            text = f"{value:.2f}" if value >= 0.005 else "0"
            ink = "white" if value > 0.5 else style.BLACK
            axes.text(column, row, text, ha="center", va="center", fontsize=style.NOTE, color=ink)
    style.color_bar(figure, image, "MAC", ax=axes, fraction=0.08, shrink=0.9)
    return style.finish(figure)
