"""Modes and frequency responses from files: CSV with units, and results of Foldyn (NetCDF)."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.cases.csv_table import UNITS, read_headings, read_numbers, some
from foldyn.cases.directions import AXES, check_axes
from foldyn.errors import InputError
from foldyn.experiment.calibration import modal
from foldyn.experiment.calibration.measurement import Measurement
from foldyn.experiment.calibration.tables import by_node, limits, listed_nodes, made
from foldyn.linear import convert
from foldyn.linear.frf import PER_FORCE, quantity_of
from foldyn.results import load
from foldyn.results.netcdf import read
from foldyn.results.quantities import RESPONSES
from foldyn.values import choice, indices, show

# Units of each quantity of a response in a CSV file.
UNITS_OF: Mapping[str, Sequence[str]] = {
    **{name: tuple(UNITS[name]) for name in PER_FORCE},
    modal.MOTION: tuple(UNITS["number without unit"]),
}
# Parts of a response in columns such as "node 8 x real".
PARTS = ("real", "imag", "magnitude", "sigma")


def frequencies(
    file: Path, modes: Any = None, shapes: Path | None = None, **known: Any
) -> modal.NaturalFrequencies:
    """Natural frequencies from a CSV file with the columns mode and frequency, or from a result.

    Parameters
    ----------
    file : Path
        CSV, with standard errors in an optional column frequency_sigma; or a result of `fd.modes`.
    modes : sequence of int, optional
        Numbers of the modes to take; all in the file by default.
    shapes : Path, optional
        File with the shapes of these modes, by which they are paired with modes of the model.
    **known
        Other arguments of `NaturalFrequencies`.
    """
    return _of_modes(modal.NaturalFrequencies, file, modes, shapes, known)


def damping_ratios(
    file: Path, modes: Any = None, shapes: Path | None = None, **known: Any
) -> modal.DampingRatios:
    """Damping ratios, as in `frequencies`: columns mode, damping_ratio, damping_ratio_sigma."""
    return _of_modes(modal.DampingRatios, file, modes, shapes, known)


def _with_sigma(file: Path, known: dict[str, Any], errors: NDArray) -> dict[str, Any]:
    """Add the standard errors of a file to the arguments; refuse them if `sigma` is also given."""
    if known.get("sigma") is not None:
        raise InputError(f"{file}: sigma: leave it out, the file has a column of it")
    return {**known, "sigma": errors}


def _of_modes(kind: Any, file: Path, modes: Any, shapes: Path | None, known: dict[str, Any]) -> Any:
    """Measurement of a kind from a file with one number for each mode."""
    name, unit = kind.quantity, kind.unit or "-"
    if _is_result(file):
        found = _result(file, "modes")
        values = found[name].values[modal.resisted(found)]
        table = {"mode": np.arange(1.0, len(values) + 1.0), name: values}
    else:
        wanted = {"mode": ("mode", "-"), name: (name, unit)}
        sigma = f"{name}_sigma"
        if sigma in dict(read_headings(file)):
            wanted["sigma"] = sigma, unit
        table = read_numbers(file, wanted)
    chosen = _chosen(file, table["mode"], modes)
    given: dict[str, Any] = {key: column[chosen] for key, column in table.items()}
    if shapes is not None:
        given["shapes"] = mode_shapes(shapes, modes=given["mode"].astype(int).tolist())
    if "sigma" in given:
        known = _with_sigma(file, known, given.pop("sigma"))
    return made(kind, file, **known, **given)


def mode_shapes(
    file: Path, nodes: Any = None, axes: Any = None, modes: Any = None, **known: Any
) -> modal.ModeShapes:
    """Mode shapes from a CSV file with a line for each mode and node, or from a result.

    Parameters
    ----------
    file : Path
        CSV with the columns mode, node, and those of x, y, z that were measured, empty where a
        value is missing; or a result of `fd.modes`.
    nodes : sequence of int, optional
        Nodes to take; all in the file by default.
    axes : str, optional
        Axes to take; all in the file by default.
    modes : sequence of int, optional
        Numbers of the modes to take; all in the file by default.
    **known
        Other arguments of `ModeShapes`.
    """
    if _is_result(file):
        found = _result(file, "modes")
        whole = found["shape"].transpose("mode", "node", "axis").values[modal.resisted(found)]
        numbers, there = np.arange(1.0, len(whole) + 1.0), AXES
        listed = list(range(whole.shape[1])) if nodes is None else listed_nodes(file, nodes)
        values = whole[:, _nodes_of(file, listed, whole.shape[1])]
    else:
        numbers, listed, there, values = by_node(file, "mode", nodes, None)
    taken = there if axes is None else axes
    check_axes(f"{file}: axes", taken)
    missing = [axis for axis in taken if axis not in there]
    if missing:
        raise InputError(f'{file}: axes = "{taken}": has no column "{missing[0]}"')
    chosen = _chosen(file, numbers, modes)
    values = values[chosen][..., [there.index(axis) for axis in taken]]
    given = {"nodes": listed, "values": values, "axes": taken, "mode": numbers[chosen]}
    return made(modal.ModeShapes, file, **given, **known)


def frf(
    file: Path, nodes: Any, axis: str = "x", quantity: str | None = None,
    magnitude: bool | None = None, band: Sequence[float] | None = None, **known: Any,
) -> modal.FrequencyResponse:  # fmt: skip
    """Frequency responses from a CSV file or from a result of `fd.frf`.

    Parameters
    ----------
    file : Path
        CSV with the columns frequency and, for each node, "node 8 x real" and "node 8 x imag" or
        "node 8 x magnitude", empty where nothing was measured; "node 8 x sigma" holds standard
        errors. The unit determines the quantity. Or a result of `fd.frf`.
    nodes : sequence of int
    axis : {"x", "y", "z"}
    quantity : str, optional
        Quantity to which a result is converted.
    magnitude : bool, optional
        Whether to compare only magnitudes if the file has complex values.
    band : (float, float), optional
        First and last frequency (Hz) to take.
    **known
        Other arguments of `FrequencyResponse`.
    """
    choice(f"{file}: axis", axis, AXES)
    chosen, errors = listed_nodes(file, nodes), None
    if _is_result(file):
        found = _result(file, "frf")
        held = quantity_of(found)
        quantity = held if quantity is None else quantity
        found = convert(found, quantity) if quantity != held else found
        whole = found[quantity].transpose("frequency", "node", "axis").values[..., AXES.index(axis)]
        frequency = found["frequency"].values
        values = whole[:, _nodes_of(file, chosen, len(whole.T))]
    else:
        if quantity is not None:
            choice(f"{file}: quantity", quantity, RESPONSES)
        quantity, frequency, values, errors = _columns(file, chosen, axis, quantity)
    if magnitude and np.iscomplexobj(values):
        values = np.abs(values)
    if band is not None:
        first, last = limits("band", band, "frequencies (Hz)")
        within = (frequency >= first) & (frequency <= last)
        if not within.any():
            raise InputError(
                f"{file}: band = {show(list(band))}: holds none of the frequencies "
                f"{frequency[0]:.6g} to {frequency[-1]:.6g} Hz"
            )
        frequency, values = frequency[within], values[within]
        errors = None if errors is None else errors[within]
    if errors is not None:
        known = _with_sigma(file, known, errors)
    real = not np.iscomplexobj(values)
    return made(
        modal.FrequencyResponse, file, nodes=chosen, frequency=frequency, values=values, axis=axis,
        quantity=quantity, magnitude=real if magnitude is None else magnitude, **known,
    )  # fmt: skip


def recognized(file: Path, axis: str, **known: Any) -> Measurement | None:
    """Measurement of modes or frequency responses in a file; None if the file has neither."""
    if _is_result(file):
        kind = read(file, "cannot be read as NetCDF").attrs.get("foldyn_result")
        if kind == "modes":
            return frequencies(file, **known)
        if kind == "frf":
            raise InputError(
                f"{file}: holds a frequency response of all nodes; say in a fit file which were "
                'measured: kind = "frf", nodes = [...]'
            )
        return None
    names = [name for name, _ in read_headings(file)]
    if "mode" in names:
        return mode_shapes(file, **known) if "node" in names else frequencies(file, **known)
    nodes = sorted({node for node, there, _ in _parts(names) if there == axis})
    return frf(file, nodes, axis, **known) if nodes and "frequency" in names else None


def _columns(
    file: Path, nodes: Sequence[int], axis: str, quantity: str | None
) -> tuple[str, NDArray, NDArray, NDArray | None]:
    """Quantity, frequencies (f,), values (f, m) and their standard errors, if any."""
    units = dict(read_headings(file))
    there = {part for node, along, part in _parts(units) if along == axis and node in nodes}
    parts = ("magnitude",) if "magnitude" in there else ("real", "imag")
    if not there & {*PARTS[:3]}:
        raise InputError(
            f'{file}: the columns are {some([*units])}; needed are "frequency", and for each node '
            f'"node {nodes[0]} {axis} real" and "node {nodes[0]} {axis} imag", or '
            f'"node {nodes[0]} {axis} magnitude"'
        )
    unit = next(
        units[f"node {node} {axis} {part}"] or "-"
        for node, along, part in _parts(units)
        if along == axis and node in nodes and part in parts
    )
    named = next((name for name, of in UNITS_OF.items() if unit in of), None)
    if named is None:
        known = ", ".join(one for of in UNITS_OF.values() for one in of)
        raise InputError(f"{file}: [{unit}] is not a unit of a response; use one of {known}")
    if quantity is not None and quantity != named:
        raise InputError(f"{file}: quantity = {show(quantity)}: the columns have a {named}")
    parts += ("sigma",) if "sigma" in there else ()
    base = UNITS_OF[named][0]
    fields = {f"{n} {p}": (f"node {n} {axis} {p}", base) for n in nodes for p in parts}
    table = read_numbers(file, {"frequency": ("frequency", "Hz"), **fields}, gaps=[*fields])
    columns = {p: np.stack([table[f"{n} {p}"] for n in nodes], axis=1) for p in parts}
    values = (
        columns["magnitude"] if "magnitude" in parts else columns["real"] + 1j * columns["imag"]
    )
    return named, table["frequency"], values, columns.get("sigma")


def _parts(names: Any) -> list[tuple[int, str, str]]:
    """Nodes, axes and parts of the columns "node 8 x real", ..."""
    headings = [re.fullmatch(rf"node (\d+) ([{AXES}]) ({'|'.join(PARTS)})", name) for name in names]
    return [(int(one[1]), one[2], one[3]) for one in headings if one]


def _chosen(file: Path, numbers: NDArray, modes: Any) -> NDArray[np.int64]:
    """Indices of the requested modes in a file, in the order of their numbers."""
    broken = numbers[numbers != numbers.astype(int)]
    if broken.size:
        raise InputError(f"{file}: mode = {broken[0]:g}: must be a whole number")
    order = np.argsort(numbers, kind="stable")
    twice = numbers[order][1:][np.diff(numbers[order]) == 0.0]
    if twice.size:
        raise InputError(f"{file}: has mode {twice[0]:g} twice")
    if modes is None:
        return order
    taken = indices("modes", modes, "mode", "counted from 1")
    missing = [mode for mode in taken if mode not in numbers]
    if missing:
        listed = some([f"{number:g}" for number in numbers[order]])
        raise InputError(f"{file}: modes: there is no mode {missing[0]}; it has {listed}")
    return np.array([np.flatnonzero(numbers == mode)[0] for mode in sorted(taken)])


def _nodes_of(file: Path, nodes: Sequence[int], count: int) -> list[int]:
    beyond = [node for node in nodes if node >= count]
    if beyond:
        raise InputError(f"{file}: node {beyond[0]} is out of range; it has nodes 0 to {count - 1}")
    return list(nodes)


def _is_result(file: Path) -> bool:
    return file.suffix.lower() == ".nc"


def _result(file: Path, kind: str) -> xr.Dataset:
    """Read a result that must be of one kind of analysis."""
    found = load(file)
    held = found.attrs["foldyn_result"]
    if held != kind:
        raise InputError(f'{file}: is a result of kind "{held}"; one of kind "{kind}" is needed')
    return found
