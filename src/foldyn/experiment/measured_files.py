"""Measurements from files: CSV with units, and the tracks of films and photographs (NetCDF)."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.csv_table import read_headings, read_numbers
from foldyn.cases.supports import AXES
from foldyn.cases.values import show
from foldyn.errors import InputError
from foldyn.experiment.measured_motions import History, Spectrum
from foldyn.experiment.measured_paths import IMPOSED, ForceDisplacement, Shapes
from foldyn.experiment.measurement import Measurement
from foldyn.experiment.store import load_tracks


def force_displacement(
    file: Path, columns: Mapping[str, str] | None = None, **known: Any
) -> ForceDisplacement:
    """Points of a CSV file with the columns displacement and force.

    Parameters
    ----------
    file : Path
    columns : mapping, optional
        Headings, where they are not "displacement" and "force".
    **known
        Other arguments of `ForceDisplacement`.
    """
    headings = {"displacement": "displacement", "force": "force"} | dict(columns or {})
    units = {"displacement": "m", "force": "N"}
    return ForceDisplacement(
        **read_numbers(file, {name: (headings[name], unit) for name, unit in units.items()}),
        **known,
    )


def shapes(
    file: Path, nodes: Any = None, load_factor: Sequence[float] | None = None, **known: Any
) -> Shapes:
    """Shapes from a CSV file with a line for each node and load factor, or from tracks.

    Parameters
    ----------
    file : Path
        CSV with the columns load_factor, node, and x, y, z as far as they were measured; or tracks
        of photographs (``*.nc``).
    nodes : sequence of int, optional
        Those to take; all in the file by default.
    load_factor : sequence of float, optional
        Of the photographs in tracks.
    **known
        Other arguments of `Shapes`.
    """
    if file.suffix == ".nc":
        return _shapes_of_tracks(file, nodes, load_factor, **known)
    names = [name for name, _ in read_headings(file)]
    axes = "".join(axis for axis in AXES if axis in names)
    if not axes:
        raise InputError(f'{file}: has no column "x", "y" or "z"; shapes need at least one')
    wanted = {"load_factor": ("load_factor", "-"), "node": ("node", "-")}
    table = read_numbers(file, wanted | {axis: (axis, "m") for axis in axes})
    numbers, steps = table["node"].astype(int), np.unique(table["load_factor"])
    chosen = np.unique(numbers).tolist() if nodes is None else _listed(file, nodes)
    missing = sorted(set(chosen) - set(numbers.tolist()))
    if missing:
        raise InputError(f"{file}: has no line for node {missing[0]}")
    values = np.full((len(steps), len(chosen), len(axes)), np.nan)
    places = {node: k for k, node in enumerate(chosen)}
    for line, node in enumerate(numbers.tolist()):
        if node in places:
            step = np.searchsorted(steps, table["load_factor"][line])
            values[step, places[node]] = [table[axis][line] for axis in axes]
    return Shapes(nodes=chosen, load_factor=steps, values=values, axes=axes, **known)


def history(
    file: Path,
    nodes: Any,
    axis: str = "x",
    columns: Sequence[str] | None = None,
    window: Sequence[float] | None = None,
    **known: Any,
) -> History:
    """Histories from a CSV file with a column of times and one for each node, or from tracks.

    Parameters
    ----------
    file : Path
        CSV with a first column of times and columns "node 8 x", ...; or tracks of a film
        (``*.nc``).
    nodes : sequence of int
    axis : {"x", "y", "z"}
    columns : sequence of str, optional
        Headings of the nodes' columns, in their order.
    window : (float, float), optional
        First and last time (s) to take.
    **known
        Other arguments of `History`.
    """
    numbers = _listed(file, nodes)
    if file.suffix == ".nc":
        tracks = _tracks(file, "time")
        time, values = tracks["time"].values, _moved(file, tracks, numbers, [axis])[..., 0]
    else:
        headings = [f"node {n} {axis}" for n in numbers] if columns is None else list(columns)
        if len(headings) != len(numbers):
            raise InputError(f"columns: names {len(headings)} columns for {len(numbers)} nodes")
        first = read_headings(file)[0][0]
        wanted = {"time": (first, "s")} | {name: (name, "m") for name in headings}
        table = read_numbers(file, wanted)
        time, values = table["time"], np.stack([table[name] for name in headings], axis=1)
    if window is not None:
        chosen = (time >= window[0]) & (time <= window[1])
        if chosen.sum() < 2:
            raise InputError(
                f"{file}: window = {show(list(window))}: holds {chosen.sum()} of the times "
                f"{time[0]:.6g} to {time[-1]:.6g} s"
            )
        time, values = time[chosen], values[chosen]
    try:
        return History(nodes=numbers, time=time, values=values, axis=axis, **known)
    except InputError as error:
        raise InputError(f"{file}: {error}") from None


def spectrum(file: Path, band: Sequence[float], taper: str | None = None, **known: Any) -> Spectrum:
    """Spectra of histories within a band (Hz); other arguments as for `history`."""
    detrend = known.pop("detrend", "constant")
    first, last = band
    return Spectrum.of(history(file, **known), (first, last), detrend, taper)


def recognize(file: Path, axis: str = "x", **known: Any) -> Measurement:
    """Measurement in a file, of the kind that its columns tell.

    Columns displacement and force are forces on all nodes that supports move along the axis; a
    column load_factor makes shapes; a first column of times, histories of the nodes along the
    axis, "node 8 x"; as do the tracks of a film, of all nodes that were seen.
    """
    if file.suffix == ".nc":
        moved = _tracks(file, "time")["displacement"].sel(axis=axis)
        seen = moved["node"].values[np.isfinite(moved.values).sum(axis=0) > 1]
        return history(file, seen.tolist(), axis, **known)
    headings = read_headings(file)
    names = [name for name, _ in headings]
    if "displacement" in names and "force" in names:
        return force_displacement(file, nodes=IMPOSED, axis=axis, **known)
    if "load_factor" in names:
        return shapes(file, **known)
    nodes = [
        int(found[1]) for name in names if (found := re.fullmatch(rf"node (\d+) {axis}", name))
    ]
    if not nodes:
        raise InputError(
            f'{file}: the columns are {", ".join(names)}; needed are "displacement" and "force", '
            f'or "load_factor", "node", "x", ..., or "time", "node 8 {axis}", ...'
        )
    return history(file, nodes, axis, **known)


def _shapes_of_tracks(
    file: Path, nodes: Any, load_factor: Sequence[float] | None, **known: Any
) -> Shapes:
    tracks = _tracks(file, "photo")
    numbers = tracks["node"].values.tolist() if nodes is None else _listed(file, nodes)
    if load_factor is None or len(load_factor) != tracks.sizes["photo"]:
        raise InputError(
            f"{file}: load_factor: give the load factor of each of its {tracks.sizes['photo']} "
            "photographs"
        )
    axes = [str(axis) for axis in tracks["axis"].values]
    values = _moved(file, tracks, numbers, axes)
    seen = [k for k in range(len(axes)) if np.isfinite(values[..., k]).any()]
    kept = "".join(axes[k] for k in seen)
    return Shapes(
        nodes=numbers, load_factor=load_factor, values=values[..., seen], axes=kept, **known
    )


def _tracks(file: Path, along: str) -> Any:
    tracks = load_tracks(file)
    if "displacement" not in tracks or along not in tracks.sizes:
        what = "a film" if along == "time" else "photographs"
        raise InputError(
            f"{file}: holds no displacements of nodes over {along}; track {what} with --model"
        )
    return tracks


def _moved(
    file: Path, tracks: Any, nodes: Sequence[int], axes: Sequence[str]
) -> NDArray[np.float64]:
    """Displacements of nodes along axes, shape (times or photographs, m, a)."""
    missing = sorted(set(nodes) - set(tracks["node"].values.tolist()))
    if missing:
        raise InputError(f"{file}: node {missing[0]} was not tracked")
    return tracks["displacement"].sel(node=list(nodes), axis=list(axes)).values


def _listed(file: Path, nodes: Any) -> list[int]:
    """Numbers of nodes: a file knows nothing of a pattern, so that no expression can be read."""
    if isinstance(nodes, int) and not isinstance(nodes, bool):
        return [nodes]
    if not isinstance(nodes, Sequence) or isinstance(nodes, str) or not nodes:
        raise InputError(f"nodes = {show(nodes)}: give the numbers of the nodes in {file.name}")
    return list(nodes)


READERS: Mapping[str, Any] = {
    ForceDisplacement.kind: force_displacement,
    Shapes.kind: shapes,
    History.kind: history,
    Spectrum.kind: spectrum,
}
"""What reads each kind of measurement: ``reader(file, **arguments)`` gives it."""


def read_measurement(kind: str, file: Path, **arguments: Any) -> Measurement:
    """Read a measurement of one of the kinds of `READERS`."""
    return READERS[kind](file, **arguments)
