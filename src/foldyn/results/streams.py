"""Datasets that are larger than memory, into NetCDF files piece by piece."""

from __future__ import annotations

from typing import Any, Literal

import h5netcdf
import xarray as xr

from foldyn.results.columns import PIECE, pieces

ALONG = "time"
"""The dimension that may be long."""
CHUNK = 2**20
"""Bytes of a chunk of a variable, which is what is read at least."""


def put(ds: xr.Dataset, sink: Any, engine: Literal["h5netcdf"]) -> None:
    """Write a dataset to a file that is open; what is long along `ALONG`, piece by piece."""
    along = {name: v for name, v in ds.variables.items() if v.dims[:1] == (ALONG,)}
    if all(variable.nbytes <= PIECE for variable in along.values()):
        ds.to_netcdf(sink, engine=engine)
        return
    count = ds.sizes[ALONG]
    chunks = {
        str(name): {
            "chunksizes": (min(count, max(1, CHUNK // max(1, v.nbytes // count))), *v.shape[1:])
        }
        for name, v in along.items()
    }
    first = ds.isel({ALONG: slice(0, 1)})
    first.to_netcdf(sink, engine=engine, unlimited_dims=[ALONG], encoding=chunks)
    with h5netcdf.File(sink, "r+") as file:
        file.resize_dimension(ALONG, count)
        for name, variable in along.items():
            for rows in pieces(count, variable.nbytes // count):
                file.variables[str(name)][rows] = variable[rows].values
