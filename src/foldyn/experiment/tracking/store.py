"""Tracks in files: NetCDF with everything, CSV with the histories."""

from __future__ import annotations

import csv
import os

import numpy as np
import xarray as xr

from foldyn.errors import InputError
from foldyn.results import netcdf
from foldyn.results.contents import TEXTS, WHOLES, check_variable


def save_tracks(ds: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write tracks to a NetCDF file, which appears only when it is complete.

    Raises
    ------
    InputError
        Not tracks, or the path cannot be written.
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
    else the pixels of the points ("point 3 u [px]"). What is lost is left empty.
    """
    along = "photo" if "photo" in ds.dims else "time"
    names = ["time [s]"] if along == "time" else ["photo"]
    columns = [ds[along].values]
    if "load" in ds.coords:
        names.append("load [N]")
        columns.append(ds["load"].values)
    if "displacement" in ds:
        moved = ds["displacement"]
        for node in ds["node"].values:
            for axis in ds["axis"].values:
                values = moved.sel(node=node, axis=axis).values
                if np.isfinite(values).any():
                    names.append(f"node {node} {axis} [m]")
                    columns.append(values)
    else:
        for point in ds["point"].values:
            for k, axis in enumerate("uv"):
                names.append(f"point {point} {axis} [px]")
                columns.append(ds["position_px"].values[:, point, k])
    with open(path, "w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(names)
        for row in zip(*columns, strict=True):
            rows.writerow(["" if not np.isfinite(value) else f"{value:.9g}" for value in row])
