"""Datasets in NetCDF files: written whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

import xarray as xr

from foldyn.errors import InputError
from foldyn.results.sink import Sink
from foldyn.writing import whole

ENGINE = "h5netcdf"


def write(ds: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a dataset to a file, which appears only when it is complete.

    Raises
    ------
    InputError
        The path cannot be written.
    OSError
        The disk is full, or fails.
    """
    path = Path(path)
    if path.is_dir():
        raise InputError(f"{path}: is a folder; give the name of a file")
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist; make it first")
    try:
        with whole(path) as part, Sink(part, "w+") as sink:
            _fill(sink, ds)
    except PermissionError:
        raise InputError(f"{path}: may not be written; choose another folder") from None


def _fill(sink: Sink, ds: xr.Dataset) -> None:
    """Write a dataset; what went wrong with the file comes before what HDF5 made of it."""
    try:
        ds.to_netcdf(sink, engine=ENGINE)
    except Exception:
        if sink.failure is None:
            raise
    if sink.failure is not None:
        raise sink.failure


def read(path: str | os.PathLike[str], unreadable: str) -> xr.Dataset:
    """Read a dataset, whole into memory.

    Raises
    ------
    InputError
        There is no such file, or it is no NetCDF: the message then says `unreadable`.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: there is no such file")
    try:
        return xr.load_dataset(path, engine=ENGINE, decode_times=False)
    except (OSError, ValueError, KeyError):
        raise InputError(f"{path}: {unreadable}") from None
