"""Buckling shapes side by side, with the base state behind them in gray."""

from __future__ import annotations

from collections.abc import Sequence

import xarray as xr
from matplotlib.figure import Figure

from foldyn.cases import Case
from foldyn.plots.modes import about_state
from foldyn.plots.readings import case_from_result, chosen_modes
from foldyn.plots.scene import Sheet3D, View
from foldyn.plots.sheet import side_by_side
from foldyn.structures import Structure


@case_from_result
def draw_buckling(
    case_or_structure: Case | Structure,
    buckling: xr.Dataset,
    *,
    which: Sequence[int] | int | None = None,
    amplitude: float | None = None,
    view: tuple[float, float] = (28.0, -60.0),
    title: str = "",
) -> Figure:
    """Draw buckling shapes, each with the base state behind it in gray and its load factor.

    Parameters
    ----------
    case_or_structure : Case or Structure
        The structure that buckles; by default from the result: ``draw_buckling(buckling)``.
    buckling : xarray.Dataset
        A result of `foldyn.buckling`.
    which : sequence of int, or int, optional
        Mode numbers, from 1, or how many; by default the first, at most 12.
    amplitude : float, optional
        Largest displacement (m) in each picture; by default 12 % of the sheet's size, or less if
        neighboring nodes would move too far apart for a legible shape.
    view : tuple of float
        Elevation above the xy plane and azimuth around z (degrees).
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        One orthographic view for each shape.

    Raises
    ------
    InputError
        The result belongs to another structure, has no shapes, or a mode does not exist.
    """
    drawn, whose = Sheet3D.of(case_or_structure), "buckling: its shapes have"
    numbers = chosen_modes(buckling, which, "buckling")
    sheet, swings, notes = about_state(drawn, buckling, numbers, amplitude, whose)
    factors = buckling["load_factor"].sel(mode=numbers).values.tolist()
    captions = [
        f"mode {number}: load factor {factor:.4g}"
        for number, factor in zip(numbers, factors, strict=True)
    ]
    return side_by_side(sheet, sheet.nodes + swings, captions, View(*view), notes, title)[0]
