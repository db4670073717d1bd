"""Datasets of sweeps: creation, and reading for figures, main effects and Sobol indices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.arguments import brief
from foldyn.cases import Case
from foldyn.cases.document import to_document
from foldyn.errors import InputError
from foldyn.results.attributes import facts, own_attributes
from foldyn.results.contents import check_result
from foldyn.results.stored_case import case_variables
from foldyn.values import choice, number, whole

POINT = "point"
"""Name of the dimension of sampled points."""
SALTELLI = "saltelli"
"""Name of the sampling design for Sobol indices."""
FEWEST = 8
"""Least number of design points of each kind for estimating indices."""
BINS = 8
"""Number of ranges, with equally many sampled points each, for main effects."""


def sweep_dataset(
    case: Case,
    data: Mapping[str, Any],
    coordinates: Mapping[str, Any],
    statistics: Mapping[str, Any],
) -> xr.Dataset:
    """Dataset of a sweep, including the case of the original case file.

    Parameters
    ----------
    case : Case
        Case of the unchanged case file.
    data, coordinates : mapping
        Variables, and the values of the varied keys.
    statistics : mapping
        Facts about the sweep, each stored as an attribute.
    """
    document = to_document(case)
    attributes = own_attributes("sweep", document.obstacles) | facts(statistics)
    return xr.Dataset({**data, **case_variables(document)}, coordinates, attributes)


def check_sweep(ds: xr.Dataset) -> None:
    """Refuse a dataset that is not the result of a sweep."""
    check_result(ds, "sweep: ")
    if ds.attrs["foldyn_result"] != "sweep" or "failure" not in ds:
        raise InputError("sweep: give a result of foldyn.sweep")


def keys_of(ds: xr.Dataset) -> list[str]:
    """Names of all keys of a sweep, in order, including keys with one value."""
    check_sweep(ds)
    return [str(name) for name, one in ds.coords.items() if "key" in one.attrs]


def parameters_of(ds: xr.Dataset) -> list[str]:
    """Names of the varied parameters: keys with several values, or all keys if none has several."""
    names = keys_of(ds)
    return [name for name in names if np.unique(ds[name].values).size > 1] or names


def measures_of(ds: xr.Dataset) -> list[str]:
    """Names of the measures of a sweep."""
    check_sweep(ds)
    return [str(name) for name, one in ds.data_vars.items() if "measure" in one.attrs]


def has_values(ds: xr.Dataset) -> bool:
    """Whether any measure has a value at any point."""
    return any(np.isfinite(ds[name].values).any() for name in measures_of(ds))


def is_grid(ds: xr.Dataset) -> bool:
    """Whether a sweep covers all combinations of values."""
    return POINT not in ds.dims


def label(one: xr.DataArray, own: str = "") -> str:
    """Axis label of a variable or coordinate, with its unit."""
    units, text = one.attrs.get("units", ""), own or one.attrs.get("long_name", str(one.name))
    return f"{text} ({units})" if units not in ("", "1") else str(text)


def measured(ds: xr.Dataset, measure: str, at: Mapping[str, Any] | None = None) -> xr.DataArray:
    """A measure at the points of a sweep.

    Parameters
    ----------
    ds : xarray.Dataset
    measure : str
    at : mapping, optional
        Coordinates along the measure's own dimensions, such as {"mode": 2}, by default the first,
        and values of the grid's parameters, by default all.

    Raises
    ------
    InputError
        Not a sweep, or no such measure, dimension or value.
    """
    found = ds[choice("measure", measure, measures_of(ds))]
    keys, left = keys_of(ds), parameters_of(ds)
    own = [dim for dim in map(str, found.dims) if dim != POINT and dim not in keys]
    given = {dim: ds[dim].values[0] for dim in keys if dim in found.dims and dim not in left}
    given |= at or {}
    for dim in given:
        choice("at: dimension", dim, [dim for dim in map(str, found.dims) if dim != POINT])
    for dim in (*own, *(dim for dim in given if dim not in own)):
        values = found[dim].values.tolist()
        if not values:
            raise InputError(f" = {measure}: has no values at any point", "measure")
        value = given.get(dim, values[0])
        if value not in values:
            raise InputError(f" = {value!r}: {measure} has {values}", f"at[{dim!r}]")
        found = found.sel({dim: value}, drop=dim in keys and dim not in (at or {}))
    return found


@brief
@dataclass(frozen=True, eq=False)
class MainEffect:
    """Mean of a measure over all other parameters, at values of one parameter.

    Attributes
    ----------
    name : str
        Name of the parameter.
    values : ndarray, shape (k,)
        Values of the parameter; for sampled points, the mean of each range.
    mean, deviation : ndarray, shape (k,)
        Mean and standard deviation of the measure at these values.
    """

    name: str
    values: NDArray
    mean: NDArray[np.float64]
    deviation: NDArray[np.float64]


def main_effects(
    ds: xr.Dataset, measure: str, *, at: Mapping[str, Any] | None = None
) -> tuple[MainEffect, ...]:
    """Main effects of all parameters of a sweep on a measure; failed points are left out.

    Parameters
    ----------
    ds : xarray.Dataset
        A result of `foldyn.sweep`.
    measure, at
        See `measured`.

    Returns
    -------
    tuple of MainEffect
        One per parameter, in order. For sampled points, means are over 8 ranges with equal numbers
        of points, or over the values of a list.

    Raises
    ------
    InputError
        See `measured`.
    """
    found = measured(ds, measure, at)
    left = [name for name in parameters_of(ds) if name not in (at or {})]
    return tuple(_effect(found, name) for name in left)


def _effect(found: xr.DataArray, name: str) -> MainEffect:
    if name in found.dims:
        rows = found.transpose(name, ...).values.reshape(found.sizes[name], -1)
        return _means(name, found[name].values, list(rows))
    given, values = found[name].values, found.values
    levels, place = np.unique(given, return_inverse=True)
    if len(levels) <= BINS or given.dtype.kind not in "iuf":
        return _means(name, levels, [values[place == k] for k in range(len(levels))])
    parts = np.array_split(np.argsort(given, kind="stable"), BINS)
    centers = np.array([given[part].mean() for part in parts])
    return _means(name, centers, [values[part] for part in parts])


def _means(name: str, values: NDArray, rows: Sequence[NDArray]) -> MainEffect:
    finite = [row[np.isfinite(row)] for row in rows]
    mean = np.array([row.mean() if row.size else np.nan for row in finite])
    deviation = np.array([row.std() if row.size else np.nan for row in finite])
    return MainEffect(name, values, mean, deviation)


@brief
@dataclass(frozen=True, eq=False)
class SobolIndices:
    """Shares of the variance of a measure that parameters explain.

    Attributes
    ----------
    names : tuple of str
        Names of the parameters.
    first, total : ndarray, shape (d,)
        Share of each parameter alone, and of each parameter with all its interactions.
    first_interval, total_interval : ndarray, shape (d, 2)
        Confidence intervals of both, from resampled points.
    points : int
        Number of design points of each kind that were used; failed points are left out.
    """

    names: tuple[str, ...]
    first: NDArray[np.float64]
    total: NDArray[np.float64]
    first_interval: NDArray[np.float64]
    total_interval: NDArray[np.float64]
    points: int


def sobol_indices(
    ds: xr.Dataset,
    measure: str,
    *,
    at: Mapping[str, Any] | None = None,
    confidence: float = 0.95,
    resamples: int = 999,
    seed: int = 0,
) -> SobolIndices:
    """Sobol indices of the parameters of a sweep with ``method="saltelli"``.

    Parameters
    ----------
    ds : xarray.Dataset
        A result of `foldyn.sweep`.
    measure, at
        See `measured`.
    confidence : float
        Confidence level of the intervals, which are bootstrap percentiles.
    resamples, seed : int
        Number of bootstrap resamples, and the random seed.

    Returns
    -------
    SobolIndices

    Raises
    ------
    InputError
        Another design, fewer than 8 successful points, or a measure that does not vary.

    Notes
    -----
    First-order indices follow Saltelli et al. (Comput. Phys. Commun. 181, 2010, table 2 (b)), total
    indices Jansen (table 2 (f)), as in `scipy.stats.sobol_indices`. A row of the design with any
    failed point is left out.
    """
    found = measured(ds, measure, at)
    if ds.attrs["method"] != SALTELLI:
        raise InputError(
            f'sweep: its method is "{ds.attrs["method"]}", but Sobol indices need samples of '
            'method = "saltelli"'
        )
    number("confidence", confidence, above=0.0, below=1.0)
    whole("resamples", resamples, least=1)
    names = parameters_of(ds)
    rows = found.values.reshape(len(names) + 2, -1)
    rows = rows[:, np.isfinite(rows).all(axis=0)]
    count = rows.shape[1]
    if count < FEWEST:
        raise InputError(f"sweep: only {count} rows of the design succeeded; {FEWEST} are needed")
    if np.ptp(rows) <= 1e-12 * np.abs(rows).max():
        raise InputError(f"measure = {measure}: does not vary, so there is no variance to explain")
    first, total = _indices(rows)
    drawn = np.random.default_rng(seed).integers(0, count, (resamples, count))
    repeated = np.array([_indices(rows[:, chosen]) for chosen in drawn])
    tails = 50.0 * (1.0 - confidence)
    ends = np.nanpercentile(repeated, [tails, 100.0 - tails], axis=0)
    return SobolIndices(tuple(names), first, total, ends[:, 0].T, ends[:, 1].T, count)


def _indices(rows: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """First-order and total indices from the rows A, B, AB_1, ..., AB_d of a design."""
    a, b, *mixed = rows - rows[:2].mean()
    variance = np.var([a, b])
    with np.errstate(divide="ignore", invalid="ignore"):  # a resample may have zero variance
        first = np.array([np.mean(b * (one - a)) for one in mixed]) / variance
        total = np.array([0.5 * np.mean((a - one) ** 2) for one in mixed]) / variance
    return first, total
