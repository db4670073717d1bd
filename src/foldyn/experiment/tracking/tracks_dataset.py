"""Datasets of tracks: made from steps of a film or photographs, with displacements, and saved."""

from __future__ import annotations

import csv
import os
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.experiment.camera import axes_of_view
from foldyn.experiment.tracking.follow import Step
from foldyn.experiment.tracking.matching import Match, Placing
from foldyn.experiment.tracking.view import TrackedModel
from foldyn.results import netcdf
from foldyn.results.contents import TEXTS, WHOLES, check_variable
from foldyn.writing import whole


def tracks_of(
    steps: Sequence[Step],
    nodes: NDArray[np.int64],
    size: tuple[int, ...],
    box: tuple[int, ...],
    along: str = "time",
) -> xr.Dataset:
    """Tracks of corners in a film, or in photographs.

    Parameters
    ----------
    steps : sequence of Step
    nodes : ndarray of int, shape (p,)
        Node of each corner, -1 for none.
    size : tuple of int
        Width and height of the pictures (pixels).
    box : tuple of int
        Region of interest; pixels of the steps count from its first pixel.
    along : {"time", "photo"}
    """
    place, units = (along, "point"), {"units": "pixel"}
    positions = np.array([step.position for step in steps]) + np.array(box[:2], dtype=np.float64)
    data: dict[str, Any] = {
        "position_px": ((*place, "uv"), positions, units),
        "status": (place, np.array([step.status for step in steps])),
        "node_of_point": (("point",), np.asarray(nodes, dtype=np.int64)),
    }
    coords: dict[str, Any] = {"point": np.arange(len(nodes)), "uv": ["u", "v"]}
    if along == "time":
        data["error_px"] = (place, np.array([step.error for step in steps]), units)
        data["repeated"] = (("time",), np.array([step.repeated for step in steps]))
        coords["time"] = ("time", np.array([step.time for step in steps]), {"units": "s"})
    else:
        coords["photo"] = np.arange(len(steps))
    attrs = {"foldyn_tracks": 1, "size": np.array(size), "roi": np.array(box)}
    return xr.Dataset(data, coords, attrs)


def add_displacements(
    ds: xr.Dataset, model: TrackedModel, matches: Sequence[Match], placing: Placing
) -> xr.Dataset:
    """Add displacements from rest of the tracked nodes.

    Each node is assumed to keep the distance from the camera that it had when the model was
    recognized: `camera_depth`, along `camera_direction` from `camera_position`. The component along
    the line of sight is unknown (NaN). The camera must stand still.

    Parameters
    ----------
    ds : xarray.Dataset
        Result of `tracks_of`.
    model : TrackedModel
    matches : sequence of Match
        One for the film, or one for each photograph.
    placing : Placing

    Returns
    -------
    xarray.Dataset
        Tracks with `displacement` (m), `rest_position`, `tracked` (share of frames in which a node
        was measured), `longest_gap` (frames), `error` (m, root mean square of the standard errors),
        and, for pictures, `projected_px` and `edges` of the model as it was recognized.
    """
    along = "photo" if "photo" in ds.dims else "time"
    origin = np.asarray(ds.attrs["roi"][:2], dtype=np.float64)
    count, vertices = ds.sizes[along], model.vertices
    node = ds["node_of_point"].values
    point = np.flatnonzero(node >= 0)
    seen = np.full((count, vertices, 2), np.nan)
    seen[:, node[point]] = ds["position_px"].values[:, point] - origin
    view = matches[0].view  # the camera stands still: one view serves all photographs
    depth = np.stack([view.depth(one.positions[:vertices]) for one in matches])
    moved = view.back(seen, depth) - model.rest[:vertices]
    moved[..., int(np.argmax(np.abs(axes_of_view(placing.up, placing.facing)[2])))] = np.nan
    measured = np.isfinite(seen[..., 0])
    out = ds.assign(
        displacement=((along, "node", "axis"), moved, {"units": "m"}),
        rest_position=(("node", "axis"), model.rest[:vertices], {"units": "m"}),
        tracked=(("node",), measured.mean(axis=0)),
        longest_gap=(("node",), _longest_gaps(measured)),
        edges=(("edge", "end"), model.edges),
    ).assign_coords(node=np.arange(vertices), axis=["x", "y", "z"])
    if "error_px" in ds:
        error = np.full((count, vertices), np.nan)
        error[:, node[point]] = ds["error_px"].values[:, point]
        square = np.nansum(error**2, axis=0) / np.maximum(measured.sum(axis=0), 1)
        rms = np.where(measured.any(axis=0), np.sqrt(square), np.nan)
        out["error"] = (("node",), rms * view.metres_per_pixel, {"units": "m"})
    projected = np.array([one.view.project(one.positions[:vertices]) for one in matches]) + origin
    dims = ("node", "uv") if along == "time" else ("photo", "node", "uv")
    shown = projected[0] if along == "time" else projected
    out["projected_px"] = (dims, shown, {"units": "pixel"})
    if along == "time":
        out["camera_depth"] = (("node",), depth[0] - view.depth(view.camera()), {"units": "m"})
    out.attrs |= {
        "metres_per_pixel": float(view.metres_per_pixel),
        "camera_position": view.camera(),
        "camera_direction": view.rotation[2],
        "camera_distance": float(view.distance),
        "match_rms_px": np.array([one.rms for one in matches]),
        "match_state": np.array([one.state for one in matches]),
        "matched_nodes": np.array([len(one.node) for one in matches]),
        "up": placing.up,
        "facing": placing.facing,
    }
    return out


def _longest_gaps(measured: np.ndarray) -> np.ndarray:
    """Longest run of frames in which a node was not measured, shape (n,)."""
    frame = np.arange(1, len(measured) + 1)[:, np.newaxis]
    last = np.maximum.accumulate(np.where(measured, frame, 0), axis=0)
    return (frame - last).max(axis=0)


def save_tracks(ds: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write tracks to a NetCDF file, which appears only when it is complete.

    Raises
    ------
    InputError
        The dataset holds no tracks, or the path cannot be written.
    """
    if "foldyn_tracks" not in ds.attrs:
        raise InputError("cannot save: these are no tracks; use foldyn.save for results")
    netcdf.write(ds, path)


def load_tracks(path: str | os.PathLike[str]) -> xr.Dataset:
    """Read tracks from a NetCDF file.

    Raises
    ------
    InputError
        There is no such file, or it holds no tracks.
    """
    ds = netcdf.read(path, "cannot be read as NetCDF")
    if "foldyn_tracks" not in ds.attrs:
        raise InputError(f"{path}: holds no tracks; foldyn track writes them")
    if "displacement" in ds:
        along, place = "photo" if "photo" in ds.dims else "time", f"{path}: "
        check_variable(ds, "displacement", (along, "node", "axis"), place=place)
        check_variable(ds, along, (along,), place=place)
        check_variable(ds, "node", ("node",), WHOLES, place)
        check_variable(ds, "axis", ("axis",), TEXTS, place)
        for name in ("node", "axis"):
            if not ds.indexes[name].is_unique:
                raise InputError(f"{path}: is damaged: it has a {name} twice")
    return ds


def write_csv(ds: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write histories to a CSV file: one row for each frame or photograph.

    With a model the columns are the measured displacements of the nodes in m ("node 8 x [m]"),
    else the pixels of the points ("point 3 u [px]"). Lost values are left empty.
    """
    columns = {"photo": ds["photo"]} if "photo" in ds.dims else {"time [s]": ds["time"]}
    if "load" in ds.coords:
        columns["load [N]"] = ds["load"]
    if "displacement" in ds:
        for node in ds["node"].values:
            for axis in ds["axis"].values:
                moved = ds["displacement"].sel(node=node, axis=axis)
                if np.isfinite(moved).any():
                    columns[f"node {node} {axis} [m]"] = moved
    else:
        for point in ds["point"].values:
            for axis in "uv":
                columns[f"point {point} {axis} [px]"] = ds["position_px"].sel(point=point, uv=axis)
    with whole(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(columns)
        for row in zip(*(column.values for column in columns.values()), strict=True):
            rows.writerow(["" if not np.isfinite(value) else f"{value:.9g}" for value in row])
