"""Measurements from files: CSV with units, tracks of films and photographs, results (NetCDF)."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.cases.csv_table import read_headings, read_numbers, some
from foldyn.cases.directions import AXES
from foldyn.errors import InputError
from foldyn.experiment.calibration import modal, modal_files
from foldyn.experiment.calibration.histories import Spectrum, TimeHistory
from foldyn.experiment.calibration.measured import IMPOSED, ForceDisplacement, Measured, Shapes
from foldyn.experiment.calibration.measurement import Measurement
from foldyn.experiment.calibration.tables import by_node, limits, listed_nodes, made
from foldyn.experiment.camera import Sight
from foldyn.experiment.tracking.tracks_dataset import load_tracks
from foldyn.values import choice, show

IN_FILE = "leave it out, the file has a column of that name"


def force_displacement(
    file: Path, columns: Mapping[str, str] | None = None, **known: Any
) -> ForceDisplacement:
    """Force-displacement points from a CSV file with the columns displacement and force.

    Parameters
    ----------
    file : Path
    columns : mapping, optional
        Column headings, if not "displacement" and "force".
    **known
        Other arguments of `ForceDisplacement`.
    """
    units = {"displacement": "m", "force": "N"}
    headings = {} if columns is None else columns
    sound = isinstance(headings, Mapping) and {*headings} <= {*units}
    if not sound or not _texts(list(headings.values())):
        raise InputError(
            f"columns = {show(columns)}: give the headings of displacement and force, as in "
            '{ displacement = "way", force = "load" }'
        )
    wanted = {name: (headings.get(name, name), unit) for name, unit in units.items()}
    return made(ForceDisplacement, file, **read_numbers(file, wanted), **known)


def shapes(
    file: Path, nodes: Any = None, load_factor: Sequence[float] | None = None, **known: Any
) -> Shapes:
    """Shapes from a CSV file with a line for each node and load factor, or from tracks.

    Parameters
    ----------
    file : Path
        CSV with the columns load_factor, node, and those of x, y, z that were measured, empty where
        a node was lost; or tracks of photographs (``*.nc`` or ``*.csv``).
    nodes : sequence of int, optional
        Nodes to take; by default all in the file.
    load_factor : sequence of float, optional
        Load factor of each photograph in tracks.
    **known
        Other arguments of `Shapes`.
    """
    tracks, names = _opened(file)
    if tracks is not None or "photo" in names:
        moved = _table(file, names) if tracks is None else _moved(file, tracks, "photo")
        return _shapes_of_tracks(file, moved, nodes, load_factor, **known)
    if load_factor is not None:
        raise InputError(f"{file}: load_factor: {IN_FILE}")
    steps, chosen, axes, values = by_node(file, "load_factor", nodes, "m")
    return made(Shapes, file, nodes=chosen, load_factor=steps, values=values, axes=axes, **known)


def measured(file: Path, **known: Any) -> Measured:
    """Values of a measure from a CSV file with the columns load_factor and value, SI units.

    Other arguments as in `Measured`.
    """
    if "load_factor" in known:
        raise InputError(f"{file}: load_factor: {IN_FILE}")
    wanted = {"load_factor": ("load_factor", "-"), "values": ("value", "-")}
    return made(Measured, file, **read_numbers(file, wanted), **known)


def history(
    file: Path,
    nodes: Any,
    axis: str = "x",
    columns: Sequence[str] | None = None,
    window: Sequence[float] | None = None,
    **known: Any,
) -> TimeHistory:
    """Histories from a CSV file with columns of time and nodes, or from tracks.

    Parameters
    ----------
    file : Path
        CSV with a first column of times and columns "node 8 x", ..., empty where a node was lost;
        or tracks of a film (``*.nc``).
    nodes : sequence of int
    axis : {"x", "y", "z"}
    columns : sequence of str, optional
        Headings of the nodes' columns, in order.
    window : (float, float), optional
        First and last time (s) to take.
    **known
        Other arguments of `TimeHistory`.
    """
    chosen = listed_nodes(file, nodes)
    tracks, names = _opened(file)
    time, values = _motions(file, tracks, names, chosen, axis, columns)
    if tracks is not None:
        known["sight"] = Sight.of(tracks)
    if window is not None:
        first, last = limits("window", window, "times (s)")
        within = (time >= first) & (time <= last)
        if within.sum() < 2:
            raise InputError(
                f"{file}: window = {show(list(window))}: holds {within.sum()} of the times "
                f"{time[0]:.6g} to {time[-1]:.6g} s"
            )
        time, values = time[within], values[within]
    return made(TimeHistory, file, nodes=chosen, time=time, values=values, axis=axis, **known)


def spectrum(
    file: Path, band: Sequence[float] | None = None, taper: str | None = None, **known: Any
) -> Spectrum:
    """Spectra of histories within a required band (Hz); other arguments as in `history`."""
    chosen = limits("band", band, "frequencies (Hz)")
    detrend = known.pop("detrend", "constant")
    return Spectrum.of(history(file, **known), chosen, detrend=detrend, taper=taper)


def recognize(file: Path, axis: str = "x", **known: Any) -> Measurement:
    """Recognize a measurement in a file from its columns.

    Columns displacement and force mean forces on all nodes that supports move along the axis. A
    column load_factor means shapes. A first column of times, with columns such as "node 8 x", means
    histories of these nodes along the axis. Tracks of a film are histories of all nodes that were
    seen; a node that was seen only once shows no motion and is left out. A column mode means mode
    shapes if there is also a column node, else natural frequencies. A column frequency, with
    columns such as "node 8 x real", means frequency responses of these nodes along the axis.
    Results of Foldyn are natural frequencies or frequency responses.
    """
    choice(f"{file}: axis", axis, AXES)
    modal = modal_files.recognized(file, axis, **known)
    if modal is not None:
        return modal
    tracks, names = _opened(file)
    if "photo" in names:
        raise InputError(
            f"{file}: holds tracks of photographs, whose load factors only a fit file can name: "
            'kind = "shapes", load_factor = [...]'
        )
    if tracks is not None:
        moved = _moved(file, tracks, "time").sel(axis=axis)
        nodes = moved["node"].values[np.isfinite(moved.values).any(axis=0)].tolist()
        if not nodes:
            raise InputError(f"{file}: no node was measured along {axis}; choose another axis")
    elif "displacement" in names and "force" in names:
        return force_displacement(file, nodes=IMPOSED, axis=axis, **known)
    elif "load_factor" in names:
        return shapes(file, **known)
    else:
        nodes = [node for node, other in _columns(names) if other == axis]
        if not nodes:
            raise InputError(
                f'{file}: the columns are {some(names)}; needed are "displacement" and '
                f'"force", or "load_factor", "node", "x", ..., or "time", "node 8 {axis}", ..., or '
                f'"mode", "frequency", or "mode", "node", "x", ..., or "frequency", '
                f'"node 8 {axis} real", "node 8 {axis} imag", ...'
            )
    time, values = _motions(file, tracks, names, nodes, axis)
    shown = np.isfinite(values).sum(axis=0) != 1
    kept = np.flatnonzero(shown if shown.any() else ~shown)
    known |= {"nodes": np.array(nodes)[kept].tolist(), "values": values[:, kept]}
    if tracks is not None:
        known["sight"] = Sight.of(tracks)
    return made(TimeHistory, file, time=time, axis=axis, **known)


def _opened(file: Path) -> tuple[xr.Dataset | None, list[str]]:
    """Tracks and the names of their dimensions, or None and the column names of a CSV file."""
    if file.suffix.lower() == ".nc":
        tracks = load_tracks(file)
        return tracks, [str(name) for name in tracks.sizes]
    return None, [name for name, _ in read_headings(file)]


def _moved(file: Path, tracks: xr.Dataset, along: str) -> xr.DataArray:
    """Displacements of nodes in tracks."""
    if "displacement" not in tracks or along not in tracks.sizes:
        what = "a film" if along == "time" else "photographs"
        raise InputError(
            f"{file}: holds no displacements of nodes over {along}; track {what} with --model"
        )
    return tracks["displacement"]


def _columns(names: Sequence[str]) -> list[tuple[int, str]]:
    """Nodes and axes of the columns "node 8 x", ..."""
    headings = [re.fullmatch(rf"node (\d+) ([{AXES}])", name) for name in names]
    return [(int(heading[1]), heading[2]) for heading in headings if heading]


def _motions(
    file: Path,
    tracks: xr.Dataset | None,
    names: Sequence[str],
    nodes: Sequence[int],
    axis: str,
    columns: Sequence[str] | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times, and displacements of nodes along an axis, shape (t, m)."""
    choice(f"{file}: axis", axis, AXES)
    if "photo" in names:
        raise InputError(f'{file}: holds photographs, which have no times; use kind = "shapes"')
    if tracks is not None:
        moved = _of_nodes(file, _moved(file, tracks, "time").sel(axis=axis), nodes)
        return moved["time"].values, moved.values
    headings = [f"node {n} {axis}" for n in nodes] if columns is None else columns
    if not _texts(headings) or len(headings) != len(nodes):
        raise InputError(f"columns = {show(columns)}: give {len(nodes)} headings, one per node")
    fields = [f"node {n}" for n in nodes]
    wanted = {"time": (names[0], "s")}
    wanted |= {name: (heading, "m") for name, heading in zip(fields, headings, strict=True)}
    table = read_numbers(file, wanted, gaps=fields)
    return table["time"], np.stack([table[name] for name in fields], axis=1)


def _shapes_of_tracks(
    file: Path, moved: xr.DataArray, nodes: Any, load_factor: Any, **known: Any
) -> Shapes:
    """Shapes from displacements along the dimension `photo`, one for each load factor."""
    count = moved.sizes["photo"]
    if not isinstance(load_factor, Sequence | np.ndarray) or len(load_factor) != count:
        raise InputError(f"{file}: load_factor: give one for each of its {count} photographs")
    moved = moved.dropna("node", how="all")
    if not moved.size:
        raise InputError(f"{file}: no node was measured in any photograph")
    if nodes is not None:
        moved = _of_nodes(file, moved, listed_nodes(file, nodes))
    moved = moved.dropna("axis", how="all")
    return made(
        Shapes, file, nodes=moved["node"].values.tolist(), load_factor=load_factor,
        values=moved.values, axes="".join(moved["axis"].values), **known,
    )  # fmt: skip


def _table(file: Path, names: Sequence[str]) -> xr.DataArray:
    """Displacements from a CSV file with a line for each photograph, in the layout of tracks."""
    columns = _columns(names)
    if not columns:
        raise InputError(f'{file}: has no columns "node 8 x", ... of displacements')
    headings = [f"node {node} {axis}" for node, axis in columns]
    table = read_numbers(file, {name: (name, "m") for name in headings}, gaps=headings)
    nodes = sorted({node for node, _ in columns})
    values = np.full((len(table[headings[0]]), len(nodes), len(AXES)), np.nan)
    for heading, (node, axis) in zip(headings, columns, strict=True):
        values[:, nodes.index(node), AXES.index(axis)] = table[heading]
    return xr.DataArray(values, {"node": nodes, "axis": list(AXES)}, ("photo", "node", "axis"))


def _of_nodes(file: Path, moved: xr.DataArray, nodes: Sequence[int]) -> xr.DataArray:
    """Displacements of some nodes in tracks."""
    missing = sorted(set(nodes) - set(moved["node"].values.tolist()))
    if missing:
        raise InputError(f"{file}: node {missing[0]} was not measured")
    return moved.sel(node=list(nodes))


def _texts(given: Any) -> bool:
    """Whether this is a list of strings."""
    return isinstance(given, list | tuple) and all(isinstance(one, str) for one in given)


# Function that reads each kind of measurement: ``reader(file, **arguments)`` returns it.
READERS: Mapping[type[Measurement], Any] = {
    ForceDisplacement: force_displacement,
    Shapes: shapes,
    Measured: measured,
    TimeHistory: history,
    Spectrum: spectrum,
    modal.NaturalFrequencies: modal_files.frequencies,
    modal.DampingRatios: modal_files.damping_ratios,
    modal.ModeShapes: modal_files.mode_shapes,
    modal.FrequencyResponse: modal_files.frf,
}
