"""Shared readings of results for figures: nodes, directions, and the course of a path."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.cases.directions import signed
from foldyn.errors import InputError
from foldyn.plots.given import alone
from foldyn.results.contents import nodes_of
from foldyn.values import choice

AXES = ("x", "y", "z")
CRITICAL = {"limit": "limit point", "bifurcation": "bifurcation"}
"""Kinds of points marked in figures, and their names."""


def check_nodes_of(
    results: Mapping[str, xr.Dataset], nodes: int | str | Sequence[int]
) -> list[int]:
    """Return nodes as a list; a selection applies to the first pattern. Refuse unknown nodes."""
    for label, result in results.items():
        nodes = nodes_of(result, nodes, repr(label) if label else "the result")
    return list(nodes)  # pyright: ignore[reportArgumentType]


def directions(
    axes: str | Sequence[str] | None,
    count: int,
    moved: Iterable[NDArray],
    known: Sequence[str] = AXES,
) -> list[str]:
    """One direction for each node, by default the one in which it moves most.

    Parameters
    ----------
    axes : str, sequence of str, or None
        As given by the user.
    count : int
        Number of nodes.
    moved : iterable of ndarray, shape (samples, count, 3)
        Displacements shown of each result; used only if no axes are given.
    """
    if axes is None:
        largest = np.max([np.abs(values).max(axis=0) for values in moved], axis=0)
        return [AXES[k] for k in largest.argmax(axis=1)]
    chosen = [axes] if isinstance(axes, str) else list(axes)
    for direction in chosen:
        choice("axes", direction, known)
    if len(chosen) == 1:
        return chosen * count
    if len(chosen) != count:
        raise InputError(
            f"axes: {len(chosen)} directions for {count} nodes; give one, or one per node"
        )
    return chosen


def check_path(path: xr.Dataset, name: str) -> None:
    """Refuse what is not a path, or one with NaN."""
    alone(name, path)
    missing = [key for key in ("displacement", "load_factor", "point") if key not in path]
    if missing or "step" not in path.sizes:
        raise InputError(f"{name}: is not a path of fd.trace; it has no {missing or ['step']}")
    if not np.isfinite(path["displacement"].values).all():
        raise InputError(f"{name}: its displacement contains NaN or infinity")


def critical_word(path: xr.Dataset, number: int) -> str:
    """Word for a critical point; if it could not be located, with its interval of load factors."""
    word = CRITICAL.get(str(path["point"].values[number]), "")
    if is_loose(path)[number]:
        low, high = path["interval"].transpose("step", "end").values[number]
        word += f" between {low:.4g} and {high:.4g}"
    return word


def is_loose(path: xr.Dataset) -> NDArray[np.bool_]:
    """Which points of a path stand for critical points that could not be located."""
    if "interval" not in path:
        return np.zeros(path.sizes["step"], bool)
    return np.ptp(path["interval"].transpose("step", "end").values, axis=1) > 0.0


def displacements(result: xr.Dataset, dimension: str = "step") -> NDArray[np.float64]:
    """Displacements (m) of all nodes at each point or time, shape (m, n, 3)."""
    return result["displacement"].transpose(dimension, "node", "axis").values


def way(path: xr.Dataset) -> NDArray[np.float64]:
    """Mean distance (m) that the nodes have traveled up to each point, never falling."""
    motion = np.diff(displacements(path), axis=0)
    steps = np.sqrt((motion**2).sum(axis=2).mean(axis=1))
    return np.concatenate([[0.0], np.cumsum(steps)])


def evenly(path: xr.Dataset, count: int) -> list[int]:
    """Numbers of `count` points evenly spread over that distance, first and last included."""
    length = way(path)
    wanted = np.linspace(0.0, length[-1], count) if count > 1 else length[-1:]
    return np.unique(np.abs(length[:, None] - wanted).argmin(axis=0)).tolist()


class Stretch(NamedTuple):
    """Points from `start` to `stop` (inclusive) of a path, all stable or all unstable."""

    start: int
    stop: int
    stable: bool


def stretches(path: xr.Dataset) -> list[Stretch]:
    """Stable and unstable stretches of the path.

    A stretch between two points is unstable if the tangent has a negative eigenvalue at either of
    them; critical points count as their more stable side. Without counted eigenvalues everything
    counts as stable.
    """
    negative = path["negative_eigenvalues"].values
    stable = np.maximum(negative[:-1], negative[1:]) <= 0
    bounds = [0, *(np.flatnonzero(stable[1:] != stable[:-1]) + 1).tolist(), len(stable)]
    return [
        Stretch(start, stop, bool(stable[start]))
        for start, stop in pairwise(bounds)
        if start < stop
    ]


def along(path: xr.Dataset, nodes: Sequence[int], direction: str) -> NDArray[np.float64]:
    """Mean displacement (m) of nodes in a direction at each point."""
    axis, sign = signed("direction", direction)
    moved = path["displacement"].sel(node=list(nodes), axis=AXES[axis])
    return sign * moved.mean("node").values + 0.0  # avoid -0


def farthest(moved: NDArray[np.float64]) -> tuple[float, str]:
    """Largest component of displacements (..., 3), and its direction."""
    place = np.unravel_index(np.abs(moved).argmax(), moved.shape)
    extreme = float(moved[place])
    return extreme, ("-" if extreme < 0.0 else "") + AXES[place[-1]]


def main_direction(paths: Mapping[str, xr.Dataset], nodes: Sequence[int]) -> str:
    """Direction in which nodes move farthest."""
    moved = [displacements(path[["displacement"]].sel(node=list(nodes))) for path in paths.values()]
    return farthest(np.concatenate(moved))[1]


def asked(
    paths: Mapping[str, xr.Dataset], nodes: int | str | Sequence[int], direction: str | None
) -> tuple[list[int], str]:
    """Nodes that all paths have, and the direction, by default the one in which they move farthest.

    Raises
    ------
    InputError
        Not paths, no node, or one that a path does not have.
    """
    for label, path in paths.items():
        check_path(path, f"paths[{label!r}]" if label else "path")
    numbers = check_nodes_of(paths, nodes)
    return numbers, main_direction(paths, numbers) if direction is None else direction
