"""Charts of a design search: objective and violation against evaluations, and slopes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from foldyn.plots.charts import Chart, Curve


def convergence_charts(history: xr.Dataset) -> list[Chart]:
    """Objective and largest violation against evaluations, a curve for each search."""
    number = 1 + history["evaluation"].values
    search = history["search"].values
    objective, violation = history["objective"].values, history["violation"].values
    best = int(history["best"])
    along = "evaluation"

    def curves(values: NDArray) -> list[Curve]:
        several = len(np.unique(search)) > 1
        return [
            Curve(f"search {k + 1}" if several else "", number[search == k], values[search == k])
            for k in np.unique(search).tolist()
        ]

    label = str(history["objective"].attrs["long_name"])
    marked = Curve("best", number[[best]], objective[[best]], dots=True)
    charts = [Chart(along, label, [*curves(objective), marked])]
    if "constraint" in history.dims:
        with np.errstate(divide="ignore"):
            decades = np.log10(np.maximum(violation, 0.1 * history.attrs["slack"]))
        allowed = Curve("slack", number[[0, -1]], np.full(2, np.log10(history.attrs["slack"])))
        charts.append(Chart(along, "log10 of the largest violation", [*curves(decades), allowed]))
    return charts


def slope_chart(slopes: Mapping[str, ArrayLike], objective: str) -> Chart:
    """Change of an objective over the range of each parameter by its slope; for arrays the norm."""
    names: Sequence[str] = list(slopes)
    sizes = np.array([np.linalg.norm(one) if np.ndim(one) else one for one in slopes.values()])
    dots = Curve("", np.arange(len(names)), sizes, dots=True)
    label = f"change of {objective} over the range"
    return Chart("parameter", label, [dots], words=names, zero=True)
