"""Universal files (UFF, UNV) for modal software: geometry, modes, frequency responses, histories.

The file has datasets 164 (units: SI), 2411 (nodes), 82 (lines along all edges), 2412 (panels), then
55 for each mode, or 58 for each node and axis of a response or a motion. Node numbers start at 1.
Formats follow https://www.ceas3.uc.edu/sdrluff (I-DEAS universal file format). In them, abscissae
and displacements of modes have six digits, ordinates of dataset 58 thirteen.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.errors import InputError, warn
from foldyn.exports.chosen import chosen_fields, chosen_nodes
from foldyn.patterns import Pattern
from foldyn.results.contents import pattern_of
from foldyn.writing import whole

TRIANGLE, QUADRILATERAL = 91, 94  # thin shells, linear
TRACED = 80  # edges in one dataset 82, which has at most 250 entries
DIGITS = 5e-6  # relative error of an abscissa of six digits
NONE = "NONE"


class Function(NamedTuple):
    """Header fields of dataset 58 for a variable."""

    kind: int  # time response 1, frequency response 4, transmissibility 5, coherence 6
    ordinate: tuple[int, str, str]  # specific data type, label, unit
    denominator: tuple[int, str, str]


DISPLACEMENT, NOTHING = (8, "Displacement", "m"), (0, NONE, NONE)
FUNCTIONS = {
    "displacement": Function(1, DISPLACEMENT, NOTHING),
    "velocity": Function(1, (11, "Velocity", "m/s"), NOTHING),
    "receptance": Function(4, DISPLACEMENT, (13, "Force", "N")),
    "transmissibility": Function(5, DISPLACEMENT, DISPLACEMENT),
    "coherence": Function(6, (1, "Coherence", NONE), NOTHING),
}
ABSCISSAE = {"trajectory": ("time", 17, "Time", "s"), "frf": ("frequency", 18, "Frequency", "Hz")}
USUAL = ("displacement", "receptance", "transmissibility")
"""Variables written by default."""


def write(
    result: xr.Dataset,
    path: Path,
    case: None,
    *,
    fields: str | Sequence[str] | None = None,
    nodes: int | str | Sequence[int] | None = None,
) -> list[Path]:
    """Write a result.

    Parameters
    ----------
    result : xarray.Dataset
        Modes, a frequency response or a motion.
    path : Path
    case : None
        Not needed.
    fields : str or sequence of str, optional
        Names of variables. A motion has "displacement" (default) and "velocity"; a response has the
        variable of its own name (default) and "coherence".
    nodes : int or sequence of int, optional
        Nodes with functions or mode shapes, counted from 0; by default all.

    Raises
    ------
    InputError
        Values are missing; the format cannot express missing values.

    Warns
    -----
    FoldynWarning
        Unstable modes are left out.
    """
    chosen = chosen_nodes(result, nodes)
    kind = result.attrs["foldyn_result"]
    if kind == "modes":
        chosen_fields(["shape"], fields)
        datasets = _modes(result, chosen)
    else:
        along = ABSCISSAE[kind][0]
        known = [name for name in FUNCTIONS if name in result and along in result[name].dims]
        usual = [name for name in known if name in USUAL]
        names = usual if fields is None else chosen_fields(known, fields)
        datasets = _functions(result, names, chosen)
    with whole(path) as part, part.open("w", encoding="ascii", newline="\n") as file:
        for number, lines in chain(_geometry(result), datasets):
            _put(file, number, lines)
    return [path]


Dataset = tuple[int, Iterable[str]]


def _put(file: TextIO, number: int, lines: Iterable[str]) -> None:
    """Write a dataset between its delimiters."""
    file.write(f"{-1:6d}\n{number:6d}\n")
    file.writelines(f"{line}\n" for line in lines)
    file.write(f"{-1:6d}\n")


# ------------------------------------------------------------------ units and geometry
def _geometry(result: xr.Dataset) -> Iterator[Dataset]:
    pattern = pattern_of(result)
    yield 164, _units()
    yield 2411, _nodes(result["rest_position"].values)
    for number, start in enumerate(range(0, len(pattern.edges), TRACED), 1):
        yield 82, _trace(number, pattern.edges[start : start + TRACED])
    yield 2412, _panels(pattern)


def _units() -> Iterator[str]:
    yield f"{1:10d}{'SI: Meter (newton)':<20}{2:10d}"
    yield "".join(f"{factor:25.16E}" for factor in (1.0, 1.0, 1.0)).replace("E", "D")
    yield f"{273.15:25.16E}".replace("E", "D")


def _nodes(position: NDArray) -> Iterator[str]:
    for number, point in enumerate(position.tolist(), 1):
        yield f"{number:10d}{1:10d}{1:10d}{11:10d}"
        yield "".join(f"{x:25.16E}" for x in point).replace("E", "D")


def _trace(number: int, edges: NDArray) -> Iterator[str]:
    """A line that jumps from edge to edge; 0 lifts the pen."""
    entries = [entry for a, b in (edges + 1).tolist() for entry in (a, b, 0)][:-1]
    yield f"{number:10d}{len(entries):10d}{0:10d}"
    yield f"{'Edges of panels':<80}"
    yield from _rows(entries, "{:10d}", 8)


def _panels(pattern: Pattern) -> Iterator[str]:
    """Panels with three and four corners; larger panels as triangles from the first corner."""
    for number, piece in enumerate(chain.from_iterable(map(_pieces, pattern.faces)), 1):
        kind = TRIANGLE if len(piece) == 3 else QUADRILATERAL
        yield f"{number:10d}{kind:10d}{1:10d}{1:10d}{7:10d}{len(piece):10d}"
        yield "".join(f"{vertex + 1:10d}" for vertex in piece)


def _pieces(face: tuple[int, ...]) -> list[tuple[int, ...]]:
    if len(face) <= 4:
        return [face]
    return [(face[0], *face[k : k + 2]) for k in range(1, len(face) - 1)]


# ------------------------------------------------------------------ modes
def _modes(result: xr.Dataset, nodes: NDArray) -> Iterator[Dataset]:
    """Dataset 55 of each oscillating or rigid mode: mass 1, viscous damping ratio."""
    frequency, ratio = result["frequency"].values, result["damping_ratio"].values
    unstable = np.flatnonzero(np.isnan(frequency)) + 1
    if len(unstable):
        warn(
            f"modes {unstable.tolist()} are unstable, have no frequency and are left out",
            "exports.md#modal-software",
        )
    for mode, f in enumerate(frequency.tolist()):
        if not math.isnan(f):
            shape = result["shape"].values[mode][nodes]
            damping = 0.0 if math.isnan(ratio[mode]) else float(ratio[mode])
            yield 55, _mode(int(result["mode"].values[mode]), f, damping, nodes, shape)


def _mode(number: int, f: float, damping: float, nodes: NDArray, shape: NDArray) -> Iterator[str]:
    yield from _titles(f"Mode {number}, {f:.6g} Hz", "Normal mode, modal mass 1 kg m2")
    yield "".join(f"{code:10d}" for code in (1, 2, 2, 8, 2, 3))
    yield "".join(f"{code:10d}" for code in (2, 4, 1, number))
    yield "".join(f"{value:13.5E}" for value in (f, 1.0, damping, 0.0))
    for node, vector in zip((nodes + 1).tolist(), shape.tolist(), strict=True):
        yield f"{node:10d}"
        yield "".join(f"{x:13.5E}" for x in vector)


# ------------------------------------------------------------------ functions
def _functions(result: xr.Dataset, names: list[str], nodes: NDArray) -> Iterator[Dataset]:
    """Dataset 58 of each node and axis."""
    along, *what = ABSCISSAE[result.attrs["foldyn_result"]]
    abscissa = result[along].values
    reference = _reference(result)
    for name in names:
        values = result[name].values
        if name != "coherence":
            _check_finite(name, values[:, nodes], abscissa, along)
        for node in nodes.tolist():
            for axis in range(3):
                response = values[:, node, axis]
                if np.isfinite(response).all():  # coherence is missing where nothing moves
                    yield 58, _function(name, what, abscissa, response, (node, axis + 1), reference)


def _check_finite(name: str, values: NDArray, abscissa: NDArray, along: str) -> None:
    bad = np.flatnonzero(~np.isfinite(values).all(axis=(1, 2)))
    if len(bad):
        raise InputError(
            f": {name} has no value at {len(bad)} of {len(abscissa)} samples, the first at {along} "
            f"{abscissa[bad[0]]:g}, and universal files cannot hold missing values; leave these "
            f"out, as with result.isel({along}=...), or export .csv or .mat",
            "result",
        )


def _reference(result: xr.Dataset) -> tuple[int, int, int]:
    """Load case, node and direction of the force; an extra load case if several act."""
    drive = result["drive"].values if "drive" in result else np.zeros((1, 3))
    driven = np.argwhere(drive)
    if "receptance" not in result or len(driven) != 1:
        return int(len(driven) > 1), 0, 0
    node, axis = driven[0].tolist()
    return 0, node + 1, (axis + 1) * (1 if drive[node, axis] > 0.0 else -1)


def _function(
    name: str, what: list, abscissa: NDArray, values: NDArray, place: tuple[int, int],
    reference: tuple[int, int, int],
) -> Iterator[str]:  # fmt: skip
    function, (node, axis) = FUNCTIONS[name], place
    case, to, direction = reference
    first, step = _even(abscissa)
    even = step > 0.0
    is_complex = np.iscomplexobj(values)
    yield from _titles(f"{name} of node {node + 1} along {'xyz'[axis - 1]}", NONE)
    yield (
        f"{function.kind:5d}{0:10d}{0:5d}{case:10d} {NONE:<10}{node + 1:10d}{axis:4d} "
        f"{NONE:<10}{to:10d}{direction:4d}"
    )
    head = f"{6 if is_complex else 4:10d}{len(values):10d}{even:10d}"
    yield f"{head}{first:13.5E}{step:13.5E}{0.0:13.5E}"
    for code, label, unit in (what, function.ordinate, function.denominator, NOTHING):
        yield f"{code:10d}{0:5d}{0:5d}{0:5d} {label:<20} {unit:<20}"
    parts = [np.real(values), np.imag(values)] if is_complex else [values]
    columns = np.stack(parts if even else [abscissa, *parts], axis=1)
    if even:
        yield from _rows(columns.ravel().tolist(), "{:20.12E}", 4)
        return
    per_line = 1 if is_complex else 2
    form = "{:13.5E}" + "{:20.12E}" * len(parts)
    lines = [form.format(*row) for row in columns.tolist()]
    yield from ("".join(lines[k : k + per_line]) for k in range(0, len(lines), per_line))


def _even(abscissa: NDArray) -> tuple[float, float]:
    """First value and spacing to six digits, or (0, 0) if that loses accuracy."""
    if len(abscissa) < 2:
        return 0.0, 0.0
    step = (abscissa[-1] - abscissa[0]) / (len(abscissa) - 1)
    first, step = (float(f"{value:.5E}") for value in (abscissa[0], step))
    told = first + step * np.arange(len(abscissa))
    even = np.abs(told - abscissa).max() <= DIGITS * np.abs(abscissa).max()
    return (first, step) if even else (0.0, 0.0)


def _titles(first: str, second: str) -> Iterator[str]:
    yield from (f"{text:<80}" for text in (first, second, NONE, NONE, NONE))


def _rows(values: Sequence, form: str, count: int) -> Iterator[str]:
    for k in range(0, len(values), count):
        yield "".join(form.format(value) for value in values[k : k + count])
