"""Datasets in NetCDF files: written whole or not at all, and read whole or not at all."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

import h5py
import xarray as xr

from foldyn.errors import InputError
from foldyn.input_files import check_file
from foldyn.results import seal

ENGINE = "h5netcdf"
MOST_PACKED = 1100
"""Bytes that one byte of a file may stand for: deflate packs no more than 1032."""


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
        seal.seal(partial)
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
        There is no such file, or it is damaged, or it is no NetCDF: the message then says
        `unreadable`.
    """
    path = check_file(path, "a NetCDF file")
    try:
        if seal.broken(path):
            raise InputError(
                f"{path}: is damaged: its checksum does not match its content; restore it from a "
                "copy, or compute it again"
            )
        _check_size(path)
        with warnings.catch_warnings():  # of xarray, on what it finds odd
            warnings.simplefilter("ignore")
            return xr.load_dataset(path, engine=ENGINE, decode_times=False, decode_timedelta=False)
    except InputError:
        raise
    except PermissionError:
        raise InputError(f"{path}: may not be read") from None
    except Exception as error:  # what libraries raise on damaged files is of any kind
        raise InputError(
            f"{path}: {unreadable}; if it was one, it is damaged: restore it from a copy, or "
            "compute it again"
        ) from error


def _check_size(path: Path) -> None:
    """Refuse a file that declares more than it can hold, before memory is taken for that."""
    with h5py.File(path) as file:
        declared = sum(
            item.size * item.dtype.itemsize
            for item in file.values()
            if isinstance(item, h5py.Dataset) and item.size and not _is_bare(item)
        )
    size = path.stat().st_size
    if declared > MOST_PACKED * size:
        raise InputError(
            f"{path}: is damaged: it declares {declared:.3g} bytes of numbers in a file of {size}; "
            "restore it from a copy, or compute it again"
        )


def _is_bare(item: h5py.Dataset) -> bool:
    """Whether this stands for a dimension alone, without any numbers."""
    name = item.attrs.get("NAME")
    return isinstance(name, bytes) and name.startswith(b"This is a netCDF dimension but not a")
