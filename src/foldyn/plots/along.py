"""What figures read from a path: how far it has come, where it is stable, what nodes do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.cases.supports import signed
from foldyn.errors import InputError
from foldyn.plots.chosen import AXES, check_nodes_of

CRITICAL = ("limit", "bifurcation")
"""Kinds of points that figures mark."""


class Run(NamedTuple):
    """Points from `start` to `stop` (inclusive) of a path that are alike in stability."""

    start: int
    stop: int
    stable: bool


def check_path(path: xr.Dataset, name: str) -> None:
    """Refuse what is not a path, or one with NaN."""
    missing = [key for key in ("displacement", "load_factor", "point") if key not in path]
    if missing or "step" not in path.sizes:
        raise InputError(f"{name}: is no path (it has no {missing or ['step']}); give one of trace")
    if not np.isfinite(path["displacement"].values).all():
        raise InputError(f"{name}: its displacement contains NaN or infinity")


def check_paths(paths: Mapping[str, xr.Dataset]) -> None:
    """Refuse what is not a mapping of label to path."""
    if not isinstance(paths, Mapping) or not paths or "displacement" in paths:  # a path is one
        raise InputError("paths: give a mapping of label to path, as {'specimen': path}")
    for label, path in paths.items():
        check_path(path, f"paths[{label!r}]")


def way(path: xr.Dataset) -> NDArray[np.float64]:
    """How far the nodes have moved along the path, on average, at each point (m), never falling."""
    motion = np.diff(path["displacement"].transpose("step", "node", "axis").values, axis=0)
    steps = np.sqrt((motion**2).sum(axis=2).mean(axis=1))
    return np.concatenate([[0.0], np.cumsum(steps)])


def evenly(path: xr.Dataset, count: int) -> list[int]:
    """Numbers of `count` points, the first and the last among them, spread evenly over the way."""
    length = way(path)
    wanted = np.linspace(0.0, length[-1], count) if count > 1 else length[-1:]
    return np.unique(np.abs(length[:, None] - wanted).argmin(axis=0)).tolist()


def runs(path: xr.Dataset) -> list[Run]:
    """Stretches of the path that are stable or not.

    A stretch between two points is unstable where the tangent has a negative eigenvalue at either
    of them; critical points count as the better of their sides. Where eigenvalues were not
    counted, everything counts as stable.
    """
    negative = path["negative_eigenvalues"].values
    stable = np.maximum(negative[:-1], negative[1:]) <= 0
    bounds = [0, *(np.flatnonzero(stable[1:] != stable[:-1]) + 1).tolist(), len(stable)]
    return [
        Run(start, stop, bool(stable[start])) for start, stop in pairwise(bounds) if start < stop
    ]


def along(path: xr.Dataset, nodes: Sequence[int], direction: str) -> NDArray[np.float64]:
    """Mean displacement (m) of nodes in a direction at each point."""
    axis, sign = signed("direction", direction)
    moved = path["displacement"].sel(node=list(nodes), axis=AXES[axis])
    return sign * moved.mean("node").values + 0.0  # no -0


def main_direction(paths: Mapping[str, xr.Dataset], nodes: Sequence[int]) -> str:
    """The direction in which nodes move farthest."""
    best, found = -1.0, "x"
    for path in paths.values():
        moved = path["displacement"].sel(node=list(nodes)).transpose("step", "node", "axis").values
        _, _, axis = np.unravel_index(np.abs(moved).argmax(), moved.shape)
        extreme = moved[..., axis].ravel()[np.abs(moved[..., axis]).argmax()]
        if abs(extreme) > best:
            best, found = abs(extreme), ("-" if extreme < 0.0 else "") + AXES[axis]
    return found


def asked(
    paths: Mapping[str, xr.Dataset], nodes: Sequence[int], direction: str | None
) -> tuple[list[int], str]:
    """Nodes that all paths have, and the direction, by default that in which they move farthest."""
    numbers = check_nodes_of(paths, nodes)
    return numbers, main_direction(paths, numbers) if direction is None else direction
