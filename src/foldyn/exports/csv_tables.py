"""CSV, tidy: a row for each sample and node, a column for each component, units in the header.

``pandas.read_csv`` reads it as a DataFrame. Numbers are written with all digits; with
``float_precision="round_trip"`` pandas reads them exactly.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.exports.chosen import ALONG, chosen_fields, chosen_nodes, quantities_of
from foldyn.results.frames import chosen_samples
from foldyn.values import show
from foldyn.writing import whole

Rows = tuple[str, ...]


def write(
    result: xr.Dataset,
    path: Path,
    case: None,
    *,
    rows: str | None = None,
    fields: str | Sequence[str] | None = None,
    nodes: int | str | Sequence[int] | None = None,
    every: int | None = None,
    frames: int | None = None,
) -> list[Path]:
    """Write one table of a result.

    Parameters
    ----------
    result : xarray.Dataset
    path : Path
    case : None
        Not needed.
    rows : str, optional
        Dimensions of the rows: "time,node" (default for a motion) for displacements, "time" for
        energies, "time,support" for reactions, "node" for constant quantities.
    fields : str or sequence of str, optional
        Names of variables; by default all variables with these dimensions.
    nodes : int or sequence of int, optional
        Numbers of nodes; by default all.
    every : int, optional
        Take every n-th sample, and the last one.
    frames : int, optional
        Take this many samples, evenly spread.
    """
    tables = tables_of(result)
    asked = _asked(result, rows, tables)
    names = chosen_fields(tables[asked], fields)
    if nodes is not None and "node" not in asked:
        raise InputError(f": rows of this table are not for nodes but {', '.join(asked)}", "nodes")
    chosen = result if nodes is None else result.isel(node=chosen_nodes(result, nodes))
    table = [chosen[name] for name in (*_coordinates(result, asked), *names)]
    samples = chosen_samples(result.sizes[asked[0]], every, frames)
    with whole(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow([title for column in table for title in _titles(column)])
        for block in _blocks([_over(column, asked) for column in table], samples):
            out.writerows(block)
    return [path]


def tables_of(result: xr.Dataset) -> dict[Rows, list[str]]:
    """Names of the variables of each table of a result, by the dimensions of its rows."""
    found: dict[Rows, list[str]] = {}
    for name in quantities_of(result):
        rows = tuple(str(dim) for dim in result[name].dims if dim != "axis")
        if rows:
            found.setdefault(rows, []).append(name)
    return found


def _asked(result: xr.Dataset, rows: Any, tables: dict[Rows, list[str]]) -> Rows:
    """Row dimensions of the requested table."""
    along = ALONG[result.attrs["foldyn_result"]]
    if rows is None:
        usual = ((along, "node"), (along, "model"), (along,))
        return next(table for table in (*usual, *tables) if table in tables)
    asked = sorted(part.strip() for part in rows.split(",")) if isinstance(rows, str) else None
    for table in tables:
        if sorted(table) == asked:
            return table
    known = ", ".join(f'"{",".join(table)}"' for table in tables)
    raise InputError(f" = {show(rows)}: choose one of {known}", "rows")


def _coordinates(result: xr.Dataset, rows: Rows) -> list[str]:
    """Names of the columns that identify a row: dimensions and their coordinates."""
    coords = {str(name): each.dims for name, each in result.coords.items()}
    return [
        name
        for dim in rows
        for name in (dim, *(n for n, dims in coords.items() if dims == (dim,) and n != dim))
    ]


def _titles(column: xr.DataArray) -> list[str]:
    """Titles of a variable's columns: name, axis and part, with the unit."""
    axes = "xyz" if "axis" in column.dims else ("",)
    parts = ("real", "imag") if np.iscomplexobj(column.values) else ("",)
    unit = str(column.attrs.get("units", ""))
    end = f" [{unit}]" if unit and unit != "1" else ""
    return [
        "_".join(word for word in (str(column.name), axis, part) if word) + end
        for axis in axes
        for part in parts
    ]


def _blocks(table: list[xr.DataArray], samples: NDArray[np.int64]) -> Iterator[Iterator[tuple]]:
    """Rows of the table, one sample at a time to save memory."""
    arrays = [column.values for column in table]
    inner = np.broadcast_shapes(*(array.shape[1:-1] for array in arrays))
    for sample in samples.tolist():
        columns: list[list] = []
        for array in arrays:
            values = array[sample if len(array) > 1 else 0]
            spread = np.broadcast_to(values, (*inner, values.shape[-1]))
            for column in spread.reshape(-1, values.shape[-1]).T:
                parts = (np.real(column), np.imag(column)) if np.iscomplexobj(column) else (column,)
                columns += [part.tolist() for part in parts]
        yield zip(*columns, strict=True)


def _over(column: xr.DataArray, rows: Rows) -> xr.DataArray:
    """A variable with all row dimensions and the axis; dimensions it lacks get the length 1."""
    missing = [dim for dim in (*rows, "axis") if dim not in column.dims]
    return column.expand_dims(missing).transpose(*rows, "axis")
