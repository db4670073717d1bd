"""Datasets in NetCDF files: written whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

import xarray as xr

from foldyn.errors import InputError

ENGINE = "h5netcdf"


def write(ds: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a dataset to a file, which appears only when it is complete.

    Raises
    ------
    InputError
        The path cannot be written.
    """
    path = Path(path)
    if path.is_dir():
        raise InputError(f"{path}: is a folder; give the name of a file")
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist; make it first")
    partial = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        ds.to_netcdf(partial, engine=ENGINE)
        os.replace(partial, path)
    except PermissionError:
        raise InputError(f"{path}: may not be written; choose another folder") from None
    finally:
        partial.unlink(missing_ok=True)


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
