"""Deformed shapes at points of a path, side by side."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.plots.along import check_path, evenly
from foldyn.plots.scene import Sheet3D, View
from foldyn.plots.sheet import rest_keys
from foldyn.plots.side_by_side import side_by_side
from foldyn.structures import Structure


def draw_shapes(
    case_or_structure: Case | Structure,
    path: xr.Dataset,
    points: int | Sequence[int] = 4,
    scale: float = 1.0,
    view: tuple[float, float] = (28.0, -60.0),
    title: str = "",
) -> Figure:
    """Draw the deformed sheet at points of a path, over the undeformed one in gray.

    All shapes are drawn at the same scale.

    Parameters
    ----------
    case_or_structure : Case or Structure
        What moves.
    path : xarray.Dataset
        A path of `foldyn.trace`.
    points : int or sequence of int
        How many points, spread evenly over the way of the nodes with the first and the last among
        them; or their numbers, negative ones from the end.
    scale : float
        Factor on the displacement in the picture.
    view : tuple of float
        Elevation above the xy plane and azimuth around z (degrees).
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        One orthographic view for each point; below it the number of the point, its load factor
        and what kind of point it is.

    Raises
    ------
    InputError
        A path of another structure, or no such point.
    """
    check_path(path, "path")
    sheet = Sheet3D.of(case_or_structure)
    numbers = chosen_points(path, points)
    displacement = path["displacement"].transpose("step", "node", "axis").values[numbers]
    sheet.check_nodes("path: it has", displacement, "traced")
    positions = sheet.nodes + scale * displacement
    captions = [describe_point(path, number) for number in numbers]
    return side_by_side(sheet, positions, captions, View(*view), rest_keys(scale), title).figure


def chosen_points(path: xr.Dataset, points: int | Sequence[int]) -> list[int]:
    """Numbers of points from 0 on, for how many there shall be or numbers with negative ones."""
    count = path.sizes["step"]
    if isinstance(points, int | np.integer):
        if points < 1:
            raise InputError(f"points: {points}; give at least one")
        return evenly(path, int(points))
    for number in points:
        if not -count <= number < count:
            raise InputError(f"points: {number}; the path has points 0 to {count - 1}")
    if not len(points):
        raise InputError("points: empty; give at least one")
    return [int(number) % count for number in points]


def describe_point(path: xr.Dataset, number: int) -> str:
    """Text for a point: its number, load factor, and what is special about it."""
    point = path.isel(step=number)
    kind = str(point["point"].values)
    said = {"limit": ", limit point", "bifurcation": ", bifurcation"}.get(kind, "")
    if not said and int(point["negative_eigenvalues"]) > 0:
        said = ", unstable"
    return f"point {number}: load factor {float(point['load_factor']):.4g}{said}"
