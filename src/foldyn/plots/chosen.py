"""Which nodes and directions of results a figure is asked to show."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.errors import InputError

AXES = ("x", "y", "z")


def check_nodes_of(results: Mapping[str, xr.Dataset], nodes: Sequence[int]) -> list[int]:
    """The nodes as a list, refused where a result does not have one."""
    numbers = [int(node) for node in nodes]
    if not numbers:
        raise InputError("nodes: empty; name at least one node to show")
    for label, result in results.items():
        stored = result["node"].values
        for node in numbers:
            if node not in stored:
                raise InputError(
                    f"nodes: {node} is not in {label!r}, whose nodes are "
                    f"{stored.min()}..{stored.max()}"
                )
    return numbers


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
        As the user gives them.
    count : int
        Number of nodes.
    moved : iterable of ndarray, shape (samples, count, 3)
        What is shown of each result; looked at only where no axes are given.
    """
    if axes is None:
        largest = np.max([np.abs(values).max(axis=0) for values in moved], axis=0)
        return [AXES[k] for k in largest.argmax(axis=1)]
    chosen = [axes] if isinstance(axes, str) else list(axes)
    for direction in chosen:
        if direction not in known:
            listed = ", ".join(f'"{name}"' for name in known)
            raise InputError(f"axes: {direction!r} is no direction; use one of {listed}")
    if len(chosen) == 1:
        return chosen * count
    if len(chosen) != count:
        raise InputError(
            f"axes: {len(chosen)} directions for {count} nodes; give one, or one per node"
        )
    return chosen
