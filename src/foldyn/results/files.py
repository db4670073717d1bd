"""Results in files (NetCDF).

NetCDF has no complex numbers: a complex variable is stored as two, its real and its imaginary
part, and put together again on loading.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import xarray as xr

from foldyn.errors import InputError
from foldyn.results import netcdf
from foldyn.results.contents import check_result, whole_attribute
from foldyn.results.dataset import FORMAT

_PARTS = ("real", "imag")
_WHOLE = "part_of_complex"  # attribute of both parts: the name of the variable


def save(ds: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a result to a NetCDF file.

    The file appears only when it is complete; one of the same name is replaced.

    Parameters
    ----------
    ds : xarray.Dataset
        A result.
    path : path
        The file, usually ``*.nc``; its folder must exist.

    Raises
    ------
    InputError
        Not a result, or the path cannot be written.
    """
    check_result(ds, "cannot save: the dataset ")
    netcdf.write(_split(ds), path)


def load(path: str | os.PathLike[str]) -> xr.Dataset:
    """Read a result from a NetCDF file, whole into memory.

    Parameters
    ----------
    path : path
        A file that `save` wrote.

    Returns
    -------
    xarray.Dataset

    Raises
    ------
    InputError
        There is no such file, or it is not a Foldyn result.
    """
    path = Path(path)
    ds = netcdf.read(path, "is not a Foldyn result (it cannot be read as NetCDF)")
    check_result(ds, f"{path}: ")
    try:
        newer = whole_attribute(ds, "foldyn_format") > FORMAT
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    if newer:
        raise InputError(
            f"{path}: was written by Foldyn {ds.attrs.get('foldyn_version')}, whose format this "
            "version does not know; update Foldyn"
        )
    try:
        return _joined(ds)
    except (KeyError, TypeError, ValueError):
        raise InputError(
            f"{path}: is damaged: a complex variable lacks its real or imaginary part; restore it "
            "from a copy, or compute it again"
        ) from None


def _split(ds: xr.Dataset) -> xr.Dataset:
    """Dataset with the two parts of each complex variable instead of it."""
    split = ds
    for name, whole in ds.data_vars.items():
        if np.iscomplexobj(whole.values):
            own = {**whole.attrs, _WHOLE: str(name)}
            parts = {f"{name}_{part}": getattr(whole, part).assign_attrs(own) for part in _PARTS}
            split = split.drop_vars(str(name)).assign(parts)
    return split


def _joined(ds: xr.Dataset) -> xr.Dataset:
    """Dataset with complex variables put together from their parts."""
    names = dict.fromkeys(part.attrs.get(_WHOLE) for part in ds.data_vars.values())
    for name in names:
        if name is None:
            continue
        real, imag = (ds[f"{name}_{part}"] for part in _PARTS)
        if real.dims != imag.dims or {real.dtype.kind, imag.dtype.kind} != {"f"}:
            raise TypeError(name)
        # not real + 1j * imag: an infinite part would make the other one nan
        whole = np.empty(real.shape, np.complex128)
        whole.real, whole.imag = real.values, imag.values
        own = {key: value for key, value in real.attrs.items() if key != _WHOLE}
        ds = ds.drop_vars([f"{name}_{part}" for part in _PARTS])
        ds = ds.assign({name: (real.dims, whole, own)})
    return ds
