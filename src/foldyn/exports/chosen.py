"""Selection of exported variables by name, and of exported nodes by number."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.results.contents import nodes_of
from foldyn.values import choice, indices, show

ALONG = {
    "trajectory": "time",
    "path": "step",
    "modes": "mode",
    "frf": "frequency",
    "bands": "phase",
    "fidelity": "mode",
    "folding": "step",
    "periodic_motion": "time",
    "response_curve": "point",
    "backbone": "point",
}
"""The dimension along which a kind of results runs."""


def quantities_of(result: xr.Dataset) -> list[str]:
    """Names of the computed variables and the rest position, without the variables of the case."""
    return [str(name) for name in result.data_vars if name != "case"]


def chosen_fields(known: Iterable[str], fields: str | Sequence[str] | None) -> list[str]:
    """Names of the requested variables, or of all known variables.

    Raises
    ------
    InputError
        An unknown variable.
    """
    known = list(known)
    if fields is None:
        return known
    if not isinstance(fields, str | Sequence):
        raise InputError(f' = {show(fields)}: give names, as in ["displacement"]', "fields")
    asked = fields.split(",") if isinstance(fields, str) else fields
    stripped = (name.strip() if isinstance(name, str) else name for name in asked)
    return list(dict.fromkeys(choice("fields", name, known) for name in stripped))


def chosen_nodes(result: xr.Dataset, nodes: int | str | Sequence[int] | None) -> NDArray[np.int64]:
    """Numbers of the requested nodes, or of all.

    Raises
    ------
    InputError
        Not nodes of the result.
    """
    count = result.sizes["node"]
    if nodes is None:
        return np.arange(count)
    if isinstance(nodes, str):
        words = nodes.replace(",", " ").split()
        if not all(word.isascii() and word.isdecimal() for word in words):
            return np.array(nodes_of(result, nodes), np.int64)
        nodes = [int(word) for word in words]
    asked = np.array(indices("nodes", nodes, "node", "or leave it out for all"), np.int64)
    beyond = asked[(asked < 0) | (asked >= count)]
    if len(beyond):
        raise InputError(f": node {beyond[0]} is out of range; there are 0 to {count - 1}", "nodes")
    return asked
