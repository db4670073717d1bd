"""Contents of a stored dataset: checks, the case, the pattern, selected nodes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from foldyn.cases import Case
from foldyn.cases.document import from_document, pattern_from_document
from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.patterns.selection import given_as, select
from foldyn.results.stored_case import document_of
from foldyn.values import show, whole

NUMBERS, WHOLES, TEXTS = "iuf", "iu", "UOST"
"""Kinds of data types, as NumPy's letters."""
_KINDS = {NUMBERS: "numbers", WHOLES: "whole numbers", TEXTS: "texts"}


def check_variable(
    ds: xr.Dataset, name: str, dims: tuple[str, ...], kind: str = NUMBERS, place: str = ""
) -> xr.DataArray:
    """Return a variable that a dataset must have with given dimensions and type.

    Raises
    ------
    InputError
        The variable is missing or has other dimensions or another type.
    """
    found = ds.variables.get(name)
    if found is not None and found.dims == dims and found.dtype.kind in kind:
        return ds[name]
    over = f" over {', '.join(dims)}" if dims else ""
    has = "lacks it"
    if found is not None:
        has = f"has {found.dtype} over {', '.join(map(str, found.dims))}"
    raise InputError(
        f"{place}the result's variable {name} must be {_KINDS[kind]}{over}; it {has}: it is "
        "damaged, or was changed"
    )


def whole_attribute(ds: xr.Dataset, name: str) -> int:
    """Return an attribute that is a whole number; 0 if the dataset lacks it."""
    value = ds.attrs.get(name, 0)
    if not isinstance(value, int | np.integer):
        raise InputError(f"its attribute {name} must be a whole number: the result is damaged")
    return int(value)


def case_of(ds: xr.Dataset) -> Case:
    """Rebuild the case from a result.

    Parameters
    ----------
    ds : xarray.Dataset
        A result, computed or loaded.

    Returns
    -------
    Case
        Case with exactly the numbers of the original. Functions of time have become tables.

    Raises
    ------
    InputError
        Not a result, or a result whose case cannot be rebuilt (because of user laws).
    """
    check_result(ds)
    if not whole_attribute(ds, "rerunnable"):
        reason = ds.attrs.get("not_rerunnable_because", "the result says so")
        raise InputError(
            f"this result cannot be run again from itself: {reason}; make the case again in Python"
        )
    return from_document(*document_of(ds))


def pattern_of(ds: xr.Dataset) -> Pattern:
    """Pattern of a result, even if its case cannot be rebuilt.

    Raises
    ------
    InputError
        Not a result, or a damaged one.
    """
    check_result(ds)
    return pattern_from_document(*document_of(ds))


def check_result(ds: xr.Dataset, place: str = "") -> None:
    """Refuse a dataset that is not a Foldyn result."""
    if not isinstance(ds, xr.Dataset) or "case" not in ds or "foldyn_result" not in ds.attrs:
        raise InputError(
            f"{place}is not a Foldyn result: it lacks the variable `case` or the attribute "
            "`foldyn_result` (arithmetic on a dataset drops attributes: keep them)"
        )
    if not isinstance(ds.attrs["foldyn_result"], str) or ds["case"].ndim:
        raise InputError(
            f"{place}is damaged: its attribute `foldyn_result` or its variable `case` is no text"
        )


def nodes_of(
    result: xr.Dataset, nodes: int | str | Sequence[int], name: str = "the result"
) -> list[int]:
    """Return node numbers, given directly or as a selection of vertices such as "xmax".

    Parameters
    ----------
    result : xarray.Dataset
    nodes : int, sequence of int, or str
        Nodes, in any order; repeats are allowed.
    name : str
        Name of the result in messages.

    Raises
    ------
    InputError
        Nothing given, not node numbers, a node that the result lacks, or an empty selection.
    """
    stored = result["node"].values
    for node in (numbers := _numbers(result, nodes, name)):
        if node not in stored:
            span = f"{stored.min()}..{stored.max()}"
            raise InputError(f": {node} is not in {name}, whose nodes are {span}", "nodes")
    return numbers


def _numbers(result: xr.Dataset, nodes: int | str | Sequence[int], name: str) -> list[int]:
    if isinstance(nodes, str):
        _, arrays = document_of(result) if "case" in result else ({}, {})
        if "vertices" not in arrays:
            raise InputError(f" = {show(nodes)}: {name} has no pattern; give numbers", "nodes")
        with given_as("nodes"):
            return select(arrays["vertices"], nodes).tolist()
    given = np.atleast_1d(np.asarray(nodes, dtype=object))
    if given.ndim > 1 or not given.size:
        raise InputError(
            f' = {show(nodes)}: give nodes to show, as in [6, 7], or a selection such as "xmax"',
            "nodes",
        )
    return [whole("nodes", node) for node in given]


def latched(result: xr.Dataset) -> xr.DataArray:
    """Whether a latch holds each crease in each state of a motion or a path.

    Parameters
    ----------
    result : Dataset
        From `fd.simulate` or `fd.trace`, of a case with latches.

    Returns
    -------
    DataArray of bool
        Along the states of the result and `crease`.

    Raises
    ------
    InputError
        The case has no latches.
    """
    case, at = case_of(result), 0
    if not case.latches:
        raise InputError(": has no latches; give its case fd.Latch", "result")
    state = result["memory"].transpose("branch", "variable", ...)[:, 0]
    holds = np.zeros((len(case.structure.folds), state.shape[1]), bool)
    for part in case.remembering:
        if part.latches:
            np.logical_or.at(holds, part.hinges.fold, state.values[at : at + part.count] > 0.0)
        at += part.count
    dims = str(state.dims[1]), "crease"
    return xr.DataArray(holds.T, dims=dims, coords=result[dims[0]].coords)
