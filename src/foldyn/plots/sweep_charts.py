"""Charts of sweeps: a measure against one parameter, and main effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.plots.charts import Chart, Curve
from foldyn.results import sweep_dataset
from foldyn.results.sweep_dataset import label, measured, parameters_of
from foldyn.values import choice

MOST_LINES = 12  # largest number of curves in one chart
RATIO = 30.0  # an axis is logarithmic from this ratio of the largest to the smallest value


def line_chart(
    sweep: xr.Dataset,
    measure: str,
    x: str | None,
    by: str | None,
    at: Mapping[str, Any] | None,
    most: int = MOST_LINES,
) -> Chart:
    """Measure against one parameter, a curve for each value of another; see `plot_sweep_lines`."""
    choice("measure", measure, sweep_dataset.measures_of(sweep))
    names = [name for name in parameters_of(sweep) if name not in (at or {})]
    along = choice("x", x, names) if x is not None else (names or parameters_of(sweep))[0]
    others = [name for name in names if name != along]
    known = *sweep_dataset.keys_of(sweep), "point"
    own = [str(dim) for dim in sweep[measure].dims if dim not in known]
    grid = sweep_dataset.is_grid(sweep)
    if by is not None:
        choice("by", by, [*others, *own])
    elif grid and others:
        by = others[0]
    found: dict[str, xr.DataArray] = {}
    if by is None:
        found[""] = measured(sweep, measure, at)
    elif by in sweep[measure].dims:
        values = sweep[by].values.tolist()
        for k in np.unique(np.linspace(0, len(values) - 1, min(len(values), most)).astype(int)):
            name = f"{label(sweep[by])} {short(values[k])}"
            found[name] = measured(sweep, measure, {**(at or {}), by: values[k]})
    else:
        raise InputError(f" = {by}: every sample has its own value of it; name a dimension", "by")
    check_some(np.concatenate([one.values.ravel() for one in found.values()]), measure)
    if grid:
        for one in found.values():
            check_left(one, (along,))
    across, words = places(sweep[along].values)
    curves = [Curve(name, across, one.values, dots=not grid) for name, one in found.items()]
    ylabel = named(next(iter(found.values())), by)
    return Chart(label(sweep[along]), ylabel, curves, words=words, by_ratio=by_ratio(across, words))


def effect_charts(
    sweep: xr.Dataset, measure: str, at: Mapping[str, Any] | None, points: bool = False
) -> list[Chart]:
    """Main effects on a measure, a chart for each parameter, optionally with the sweep's points."""
    found, charts = measured(sweep, measure, at), []
    check_some(found.values, measure)
    for effect in sweep_dataset.main_effects(sweep, measure, at=at):
        one = sweep[effect.name]
        across, words = places(effect.values)
        curves = [Curve("mean over everything else", across, effect.mean, spread=effect.deviation)]
        if points:
            there = [words.index(str(value)) for value in one.values] if words else one.values
            curves.append(Curve("points", there, found.values, dots=True))
        ratio = by_ratio(across, words)
        charts.append(Chart(label(one), named(found), curves, words=words, by_ratio=ratio))
    return charts


def places(values: NDArray) -> tuple[NDArray[np.float64], list[str]]:
    """Coordinates of values along an axis, and the labels of 0, 1, 2, ... if they are words."""
    if values.dtype.kind in "iuf":
        return values.astype(float), []
    words = [str(value) for value in dict.fromkeys(values.tolist())]
    return np.array([words.index(str(value)) for value in values], float), words


def by_ratio(values: NDArray, words: Sequence[str] = ()) -> bool:
    """Whether values are spaced by ratios, so that a logarithmic axis suits them."""
    steps = np.unique(values)
    return not words and bool(steps.size > 2 and steps[0] > 0.0 and steps[-1] > RATIO * steps[0])


def check_left(found: xr.DataArray, shown: Sequence[str]) -> None:
    """Refuse parameters left over: they have several values, and none is given."""
    left = [str(dim) for dim in found.dims if dim not in shown]
    if left:
        raise InputError(
            f": {', '.join(left)}: has several values; name one, as in "
            f"{{{left[0]!r}: {found[left[0]].values[0]!r}}}",
            "at",
        )


def check_some(values: NDArray, measure: str) -> None:
    """Refuse a measure without any value."""
    if not np.isfinite(values).any():
        raise InputError(f" = {measure}: has no value at any point", "measure")


def named(found: xr.DataArray, by: str | None = None) -> str:
    """Label of a measure, with its position along its own dimensions, such as the mode."""
    at = [
        f"{one.attrs.get('long_name', name)} {short(one.item())}"
        for name, one in found.coords.items()
        if one.ndim == 0 and name != by
    ]
    return label(found, ", ".join([str(found.attrs.get("long_name", found.name)), *at]))


def short(value: Any) -> str:
    """Write a value with four digits."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
