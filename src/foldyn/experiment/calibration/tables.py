"""Shared readers of measurements: nodes and ranges of fit files, tables with a line per node."""

from __future__ import annotations

from collections.abc import Sized
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.csv_table import read_headings, read_numbers
from foldyn.cases.directions import AXES
from foldyn.cases.selection import check_nodes
from foldyn.errors import InputError, within
from foldyn.values import numbers, show


def made(kind: Any, file: Path, **known: Any) -> Any:
    """Create a measurement; error messages name the file."""
    with within("", file):
        return kind(**known)


def listed_nodes(file: Path, nodes: Any) -> list[int]:
    """Node numbers; expressions that select vertices of a pattern are refused."""
    empty = isinstance(nodes, Sized) and not len(nodes)
    chosen = "" if empty else check_nodes("nodes", nodes)
    if isinstance(chosen, str):
        raise InputError(f"nodes = {show(nodes)}: give the numbers of the nodes in {file.name}")
    return list(chosen)


def limits(name: str, given: Any, what: str) -> tuple[float, float]:
    """Check that a range is two increasing numbers, and return them."""
    pair = numbers(name, given) if isinstance(given, list | tuple) else np.zeros(0)
    if pair.shape != (2,) or not pair[0] < pair[1]:
        raise InputError(f"{name} = {show(given)}: give two {what}, as in [2, 30]")
    return float(pair[0]), float(pair[1])


def by_node(
    file: Path, key: str, nodes: Any, unit: str | None
) -> tuple[NDArray[np.float64], list[int], str, NDArray[np.float64]]:
    """Contents of a CSV file with a line for each node and value of a key.

    Parameters
    ----------
    file : Path
        CSV file with the columns `key`, node, and those of x, y, z that were measured.
    key : str
    nodes : sequence of int or None
        Nodes to take; all in the file by default.
    unit : str, optional
        Unit to which components are converted; by default the unit of the first component column.

    Returns
    -------
    (ndarray, list, str, ndarray)
        Values (s,) of the key, nodes, axes, and components (s, nodes, axes); NaN where missing.
    """
    units = dict(read_headings(file))
    axes = "".join(axis for axis in AXES if axis in units)
    if not axes:
        raise InputError(f'{file}: has no column "x", "y" or "z"; shapes need at least one')
    unit = unit or units[axes[0]] or "-"
    wanted = {key: (key, "-"), "node": ("node", "-")} | {axis: (axis, unit) for axis in axes}
    table = read_numbers(file, wanted, gaps=axes)
    listed, steps = table["node"].astype(int), np.unique(table[key])
    broken = np.flatnonzero(table["node"] != listed)
    if broken.size:
        raise InputError(f"{file}: node = {table['node'][broken[0]]:g}: must be a whole number")
    lines, times = np.unique([listed, table[key]], axis=1, return_counts=True)
    for node, step in lines.T[times > 1]:
        raise InputError(
            f"{file}: has two lines for node {node:g} at the {key.replace('_', ' ')} {step:g}"
        )
    every = np.unique(listed)
    values = np.full((len(steps), len(every), len(axes)), np.nan)
    place = np.searchsorted(steps, table[key]), np.searchsorted(every, listed)
    values[place] = np.stack([table[axis] for axis in axes], axis=1)
    chosen = every.tolist() if nodes is None else listed_nodes(file, nodes)
    missing = sorted(set(chosen) - set(every.tolist()))
    if missing:
        raise InputError(f"{file}: has no line for node {missing[0]}")
    return steps, chosen, axes, values[:, np.searchsorted(every, chosen)]
