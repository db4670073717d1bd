"""Wave vectors in the Brillouin zone, as phases (rad) per period: paths and grids."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import xarray
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.ram_limit import check_memory
from foldyn.values import numbers, show, whole

OF_PHASES = ("ticks", "tick_labels", "grid")
"""Attributes of phases that bands take over."""
HEXAGONAL = 1e-6  # tolerance for lengths and angle of a hexagonal lattice


def zone_path(vectors: NDArray, points: str, count: int) -> xarray.DataArray:
    """Phases along a path, see `UnitCell.path`; vectors (d, 3) of the periods, m."""
    known = special_points(vectors)
    if not isinstance(points, str):
        raise InputError(f' = {show(points)}: give names, as in "G-X-M-G"', "points")
    names = [name.strip().replace("Γ", "G") for name in points.split("-")]
    unknown = [name for name in names if name not in known]
    if unknown or len(names) < 2:
        what = f"{show(unknown[0])} is no point" if unknown else "give at least two points"
        raise InputError(
            f" = {show(points)}: {what}; this cell has {', '.join(known)}, as in "
            f'"{"G-X-M-G" if len(vectors) == 2 else "G-X"}"',
            "points",
        )
    count = whole("count", count, least=len(names))
    _check_memory(count, len(vectors))
    corners = np.array([known[name] for name in names])
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    if not lengths.all():
        raise InputError(f" = {show(points)}: names a point twice in a row", "points")
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    marks = np.round(ends / ends[-1] * (count - 1)).astype(int)
    marks = np.maximum.accumulate(np.maximum(marks, np.arange(len(marks))))
    for k in range(len(marks) - 1, 0, -1):  # leave room for the remaining corners
        marks[k] = min(marks[k], count - len(marks) + k)
    rows = [
        corners[k]
        + np.linspace(0.0, 1.0, b - a, endpoint=False)[:, None] * (corners[k + 1] - corners[k])
        for k, (a, b) in enumerate(pairwise(marks.tolist()))
    ]
    phases = np.concatenate([*rows, corners[-1:]])
    distance = np.concatenate([[0.0], np.linalg.norm(np.diff(phases, axis=0), axis=1).cumsum()])
    return array(phases, distance, distance[marks], names)


def _check_memory(count: int, dimensions: int) -> None:
    """Refuse more phases than memory can hold; building them takes twice as much."""
    check_memory(
        "count", f"a list of {count:g} phases", 16.0 * count * (dimensions + 1), "take fewer"
    )


def array(
    phases: NDArray, distance: NDArray, ticks: ArrayLike, names: list[str]
) -> xarray.DataArray:
    """Phases (n, d) of a path, with the data for a plot."""
    return xarray.DataArray(
        phases,
        dims=("phase", "period"),
        coords={"distance": ("phase", distance, {"units": "rad", "long_name": "along the path"})},
        attrs={"units": "rad", "ticks": np.asarray(ticks), "tick_labels": "-".join(names)},
    )


def zone_grid(dimensions: int, count: int) -> xarray.DataArray:
    """Phases covering the zone; see `UnitCell.grid`."""
    count = whole("count", count, least=2)
    _check_memory(count**dimensions, dimensions)
    along = -np.pi + 2.0 * np.pi / count * np.arange(count)
    phases = np.stack(np.meshgrid(*[along] * dimensions, indexing="ij"), axis=-1)
    return xarray.DataArray(
        phases.reshape(-1, dimensions), dims=("phase", "period"),
        attrs={"units": "rad", "grid": np.array([count] * dimensions)},
    )  # fmt: skip


def special_points(vectors: NDArray) -> dict[str, NDArray]:
    """Points (d,) of high symmetry by name, rad."""
    pi = np.pi
    if len(vectors) == 1:
        return {"G": np.zeros(1), "X": np.full(1, pi)}
    corners = {"G": (0.0, 0.0), "X": (pi, 0.0), "Y": (0.0, pi), "M": (pi, pi)}
    found = {name: np.array(corner) for name, corner in corners.items()}
    lengths = np.linalg.norm(vectors, axis=1)
    if lengths.all():
        cosine = vectors[0] @ vectors[1] / lengths.prod()
        alike = abs(lengths[0] / lengths[1] - 1.0) < HEXAGONAL
        if alike and abs(abs(cosine) - 0.5) < HEXAGONAL:
            found["K"] = 2.0 * pi / 3.0 * np.array([1.0, -1.0 if cosine > 0.0 else 1.0])
    return found


def of_phases(phases: object, given: NDArray) -> tuple[dict[str, Any], dict[str, Any]]:
    """Coordinates and attributes of results that describe their phases (n, d)."""
    along: dict[str, Any] = {"wave_vector": (("phase", "period"), given, {"units": "rad"})}
    if not isinstance(phases, xarray.DataArray):
        return along, {}
    if "distance" in phases.coords:
        along["distance"] = phases.coords["distance"]
    return along, {key: value for key, value in phases.attrs.items() if key in OF_PHASES}


def checked_phases(phases: object, dimensions: int) -> NDArray[np.float64]:
    """Phases (n, d), rad; for d = 1 also a list of numbers."""
    values = phases.values if isinstance(phases, xarray.DataArray) else phases
    array = numbers("phases", values)
    if array.ndim == 1 and dimensions == 1:
        array = array[:, None]
    if array.ndim != 2 or array.shape[1] != dimensions or not len(array):
        raise InputError(
            f": shape {array.shape}: give (n, {dimensions}), rad per period, as cell.path makes "
            "them",
            "phases",
        )
    return array
