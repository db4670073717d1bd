"""Nodes of a result, by number or by place, for whoever shows or exports some of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from foldyn.errors import InputError
from foldyn.patterns.selection import given_as, select
from foldyn.values import show, whole


def nodes_of(
    result: xr.Dataset, nodes: int | str | Sequence[int], name: str = "the result"
) -> list[int]:
    """Numbers of nodes: those given, or those that a selection ("xmax") of the pattern means.

    Parameters
    ----------
    result : xarray.Dataset
    nodes : int, sequence of int, or str
        In any order; one may be there twice.
    name : str
        What a message calls the result.

    Raises
    ------
    InputError
        None, something else, one that the result does not have, or a selection of none.
    """
    stored = result["node"].values
    for node in (numbers := _numbers(result, nodes, name)):
        if node not in stored:
            span = f"{stored.min()}..{stored.max()}"
            raise InputError(f": {node} is not in {name}, whose nodes are {span}", "nodes")
    return numbers


def _numbers(result: xr.Dataset, nodes: int | str | Sequence[int], name: str) -> list[int]:
    if isinstance(nodes, str):
        if "vertices" not in result:
            raise InputError(f" = {show(nodes)}: {name} has no pattern; give numbers", "nodes")
        with given_as("nodes"):
            return select(result["vertices"].values, nodes).tolist()
    given = np.atleast_1d(np.asarray(nodes, dtype=object))
    if given.ndim > 1 or not given.size:
        raise InputError(
            f' = {show(nodes)}: give nodes to show, as in [6, 7], or a selection such as "xmax"',
            "nodes",
        )
    return [whole("nodes", node) for node in given]
