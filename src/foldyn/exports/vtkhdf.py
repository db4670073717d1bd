"""VTKHDF: all samples of a result with their fields, for ParaView and VTK.

One mesh (`PolyData`) of triangles and lines. Connectivity is stored once; positions and all fields
are stored at every sample, in single precision. It is one mesh and not a collection of panels,
creases and bars, because VTK 9.3 cannot read a time-dependent collection, and VTK 9.7 shows its
first sample at all times. The field `kind` names each cell's type.

Source of the format: https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.exports.chosen import ALONG
from foldyn.formats.writers import warn_of_boards
from foldyn.linear import stresses as find_stresses
from foldyn.results import shapes_of
from foldyn.results.netcdf import fill
from foldyn.structures import Structure
from foldyn.structures.discretized import Discretized
from foldyn.values import flag
from foldyn.viewer.sheet import KINDS, edge_pieces
from foldyn.viewer.states import Field, fields, folding_fields, stress_fields
from foldyn.writing import whole

VERSION = (2, 0)
"""Version of the format: the first version with samples in time."""
CELLS = ("Vertices", "Lines", "Polygons", "Strips")
"""Kinds of cells, in the order of their fields."""
BAR, PANEL = len(KINDS), len(KINDS) + 1
"""Kinds of cells other than edges; the kind of an edge is the index of its letter in `KINDS`."""
NAMES = {"bar_strain": "strain", "fold_moment": "moment"}
"""Cell fields that have another name in the file."""
ROWS = 1 << 14
"""Number of rows in a compressed chunk of an array; a chunk has at least one sample."""


class Mesh(NamedTuple):
    """Lines (k, 2) and triangles (t, 3) between nodes, with the type of each of these cells.

    kind : 0 to 4 as in `KINDS`, `BAR` or `PANEL`.
    crease, bar, panel : number of the cell's crease, bar or panel, -1 if it is none.
    """

    lines: NDArray
    triangles: NDArray
    kind: NDArray
    crease: NDArray
    bar: NDArray
    panel: NDArray


def write(
    result: xr.Dataset,
    path: Path,
    case: Case,
    *,
    every: int | None = None,
    frames: int | None = None,
    stresses: bool | None = None,
) -> list[Path]:
    """Write a result with its fields at all samples.

    Parameters
    ----------
    result : xarray.Dataset
        A motion, a path or a folding, whose nodes move; or modes, whose nodes stay in place and
        have a field `shape`.
    path : Path
    case : Case
        Case of the result.
    every, frames : int, optional
        Take every n-th sample and the last one, or this many samples, evenly spread; all by
        default.
    stresses : bool, optional
        Whether panels and creases have fields of `foldyn.stresses`, too: `von_mises`, the largest
        of the panel, and `crease_moment`, per length. Of motions, paths and modes.
    """
    warn_of_boards(case.structure.pattern)
    shapes = shapes_of(result, every, frames=frames)
    dimension = ALONG[result.attrs["foldyn_result"]]
    some = result.isel({dimension: shapes.samples})
    moments = some[dimension].values if dimension in some.coords else shapes.samples
    mesh = _mesh(case.structure)
    cells = {name: getattr(mesh, name) for name in ("kind", "crease", "panel")}
    if dimension == "mode":
        points = shapes.nodes[None]
    else:
        points = shapes.nodes + shapes.displacement
        if result.attrs["foldyn_result"] == "folding":
            known = folding_fields(case, shapes.displacement, some["fold_angle"].values)
        else:
            known = fields(case, some, shapes.displacement)
        cells |= _cell_fields(mesh, known)
    if flag("stresses", bool(stresses) if stresses is None else stresses):
        found = find_stresses(result).isel({dimension: shapes.samples})
        cells |= _cell_fields(mesh, stress_fields(found))

    def put(sink: Any) -> None:
        with h5py.File(sink, "w") as file:
            root = file.create_group("VTKHDF")
            root.attrs["Version"] = np.array(VERSION, np.int64)
            root.attrs["Type"] = np.bytes_("PolyData")
            _put_steps(root, np.asarray(moments, float))
            _put_nodes(root, points, _along(some, dimension, "node"))
            _put_cells(root, mesh, cells)
            _put_numbers(root, _along(some, dimension))

    with whole(path) as part:
        fill(part, put)
    return [path]


def _mesh(structure: Discretized) -> Mesh:
    """Mesh of a structure's edges, bars and triangles, in this order."""
    pairs, kind, edge, _ = edge_pieces(structure.pattern, structure.nodes, structure.edge_nodes)
    bars = structure.bars if isinstance(structure, Structure) else np.empty((0, 2), int)
    counts = len(pairs), len(bars), len(structure.triangles)

    def numbered(part: int, numbers: NDArray) -> NDArray:
        rows = [np.full(count, -1) for count in counts]
        rows[part] = numbers
        return np.concatenate(rows)

    return Mesh(
        np.concatenate([pairs, bars]),
        structure.triangles,
        np.concatenate([kind, np.repeat([BAR, PANEL], counts[1:])]),
        numbered(0, np.where(kind < KINDS.index("B"), edge, -1)),
        numbered(1, np.arange(len(bars))),
        numbered(2, structure.triangle_panel),
    )


def _cell_fields(mesh: Mesh, known: Mapping[str, Field]) -> dict[str, NDArray]:
    """Fields of cells (samples, cells), nan where a cell has none."""
    out = {}
    for name, field in known.items():
        if field.on == "node":
            continue
        numbers = getattr(mesh, field.on)
        values = np.full((len(field.values), len(numbers)), np.nan, np.float32)
        values[:, numbers >= 0] = field.values[:, numbers[numbers >= 0]]
        out[NAMES.get(name, name)] = values
    return out


def _along(result: xr.Dataset, dimension: str, *rest: str) -> dict[str, NDArray]:
    """Scalars and vectors of a result along a dimension and, if given, along further dimensions."""
    shapes = {(dimension, *rest), (dimension, *rest, "axis")} if rest else {(dimension,)}
    return {
        str(name): each.values
        for name, each in result.variables.items()
        if each.dtype.kind in "iuf" and each.dims in shapes and name != dimension
    }


def _put_steps(root: Any, moments: NDArray) -> None:
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = len(moments)
    steps["Values"] = moments
    steps["NumberOfParts"] = np.ones(len(moments), np.int64)
    steps["PartOffsets"] = np.zeros(len(moments), np.int64)
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        steps[name] = np.zeros((len(moments), len(CELLS)), np.int64)


def _put_nodes(root: Any, points: NDArray, values: Mapping[str, NDArray]) -> None:
    """Write nodes (1 or samples, n, 3) and their fields."""
    root["NumberOfPoints"] = points.shape[1:2]
    _put(root, "Points", points, root["Steps"], "PointOffsets")
    for name, field in values.items():
        _put(root, f"PointData/{name}", field, root["Steps"], f"PointDataOffsets/{name}")


def _put_cells(root: Any, mesh: Mesh, values: Mapping[str, NDArray]) -> None:
    """Write cells, constant in time, and their fields (cells,) or (samples, cells)."""
    empty = np.empty((0, 1), int)
    for kind, cells in zip(CELLS, (empty, mesh.lines, mesh.triangles, empty), strict=True):
        count, corners = cells.shape
        root[f"{kind}/NumberOfCells"] = [count]
        root[f"{kind}/NumberOfConnectivityIds"] = [cells.size]
        root[f"{kind}/Offsets"] = corners * np.arange(count + 1)
        root[f"{kind}/Connectivity"] = cells.ravel().astype(np.int64)
    for name, field in values.items():
        own = field if field.ndim > 1 else field[None]
        _put(root, f"CellData/{name}", own, root["Steps"], f"CellDataOffsets/{name}")


def _put(root: Any, name: str, values: NDArray, steps: Any, offsets: str) -> None:
    """Write values (1 or samples, k, ...), all samples in sequence, and the offset of each."""
    kind = np.float32 if values.dtype.kind == "f" else np.int32
    rows = values.reshape(-1, *values.shape[2:]).astype(kind)
    chunk = (max(1, min(len(rows), max(ROWS, values.shape[1]))), *rows.shape[1:])
    root.create_dataset(name, data=rows, chunks=chunk, compression="gzip", shuffle=True)
    changes = len(values) > 1
    steps[offsets] = changes * values.shape[1] * np.arange(steps.attrs["NSteps"])


def _put_numbers(root: Any, values: Mapping[str, NDArray]) -> None:
    """Write a number for each sample."""
    for name, numbers in values.items():
        root[f"FieldData/{name}"] = numbers
        root[f"Steps/FieldDataOffsets/{name}"] = np.arange(len(numbers))
        root[f"Steps/FieldDataSizes/{name}"] = np.ones((len(numbers), 2), np.int64)
